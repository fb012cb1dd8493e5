"""What one map needs before anything is run: its rows, methods and timesteps; and methods with other softness of the constraints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.design import Design
from mechlab.lab.methods import Method, Problem, method
from mechlab.mechanism import Mechanism
from mechlab.studies.stability.data import StabilityAxis, Theory
from mechlab.studies.stability.vary import with_mechanism, without_ranges


@dataclass(frozen=True)
class SoftenedMethod(Method):
    """time_constant [s] and impedance of MuJoCo's rows (0: as the method has it), `mu` of Pinocchio's (0: as it has it)."""

    time_constant: float = 0.0
    impedance: float = 0.0
    mu: float = 0.0

    def settings(self, value: float) -> Settings:
        """Settings at a step [s], with the softness set by hand."""
        base = Method.settings(self, value)
        if self.time_constant:
            base = replace(base, timeconst=self.time_constant / value)
        if self.impedance:
            base = replace(base, impedance=self.impedance)
        return base

    def run(self, problem: Problem, value: float) -> Trace:
        """The problem at a step [s] that divides the output distance."""
        if self.engine != "pinocchio" or not self.mu:
            return Method.run(self, problem, value)
        engine("pinocchio")  # raises EngineMissing where it is not installed
        from mechlab.engines.pinocchio.trace import GAINS, Stabilisation, trace

        gains = Stabilisation(*GAINS[self.constraints], self.mu)
        return trace(problem.mechanism, problem.scene, self.settings(value), problem.outputs, gains)


def with_softness(
    method: Method, time_constant: float = 0.0, impedance: float = 0.0, mu: float = 0.0
) -> SoftenedMethod:
    """The method with these set; see `Tuned`."""
    kept = {f.name: getattr(method, f.name) for f in fields(Method)}
    return SoftenedMethod(**kept, time_constant=time_constant, impedance=impedance, mu=mu)


OUTPUTS = 10
"""Output times of every run; a timestep divides their distance."""
DIVISIONS = (1, 2, 3, 5, 8, 13, 21, 34, 55)
"""Steps between two outputs: timesteps over almost two decades."""
STEERING = ("servo", "computed_torque", "held_rates")
LONGEST = 2.0
"""Simulated time [s] of the maps that need no particular one, at most."""
FALL = 3.0
"""Simulated time of a mechanism whose servos are left out, in units of sqrt(size / g)."""
FREE = "without the servos of the scene"


@dataclass(frozen=True)
class StabilityPlan:
    """problem(y) makes the row of y; tune(method, y) the method as it is used there. measure: "error" (of the coordinates,
    relative to how far they move), "energy" (relative to the energy turned over) or "gap" (of loops and relations, rad or
    m); `right` and `wrong`: limits of it. theory(methods, steps) -> boundaries to draw. reference: the method that
    gives the reference runs ("": see `measure.sharp_method`)."""

    kind: str
    title: str
    y: StabilityAxis
    problem: Callable[[float], Problem]
    methods: tuple[Method, ...]
    steps: tuple[float, ...]
    measure: str = "error"
    right: float = 1e-2
    wrong: float = 1e-1
    tune: Callable[[Method, float], Method] = lambda method, y: method
    theory: Callable[[tuple[Method, ...]], tuple[Theory, ...]] = lambda methods: ()
    reference: str = ""
    remark: str = ""

    @property
    def compare(self) -> bool:
        """Whether a reference run is needed."""
        return self.measure != "gap"


def steps_of(duration: float, divisions: tuple[int, ...] = DIVISIONS) -> tuple[float, ...]:
    """Timesteps [s], ascending, that divide the distance of the output times."""
    return tuple(sorted(duration / OUTPUTS / k for k in divisions))


@dataclass(frozen=True)
class StabilityCase:
    """A scene of a design: where the plans come from. `only`: names of the methods that the user chose."""

    design: Design
    scene: Scene
    only: tuple[str, ...] = ()
    remark: str = ""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism at the fidelity of the scene."""
        return self.design.mechanism(self.scene.fidelity)

    def problem(self, mechanism: Mechanism | None = None, scene: Scene | None = None, duration: float = 0.0) -> Problem:
        """The case with another mechanism, scene or duration [s]; joints have no ends of their ranges."""
        design = with_mechanism(self.design, without_ranges(mechanism or self.mechanism))
        used = scene or self.scene
        return Problem(design, replace(used, duration=duration or used.duration), OUTPUTS)

    @property
    def free(self) -> StabilityCase:
        """The same start without servos and computed torques: what they limit is seen in the map of stiffness."""
        kept = tuple(law for law in self.scene.laws if law.kind not in STEERING)
        if len(kept) == len(self.scene.laws):
            return replace(self, scene=replace(self.scene, duration=min(self.scene.duration, LONGEST)))
        size = max([float(np.linalg.norm(b.placement.translation)) for b in self.mechanism.bodies] + [1e-3])
        short = min(self.scene.duration, LONGEST, FALL * (size / 9.81) ** 0.5)
        return replace(self, scene=replace(self.scene, laws=kept, duration=short), remark=FREE)

    def methods(self, *names: str) -> tuple[Method, ...]:
        """The methods that the user chose, else those of these names."""
        return tuple(method(n) for n in self.only or names)


def usual_methods(case: StabilityCase) -> tuple[Method, ...]:
    """What most maps show: each way to step once, the engine's defaults among them."""
    if case.mechanism.loops or case.mechanism.relations:
        return case.methods(
            "MuJoCo implicitfast, defaults", "MuJoCo implicitfast, hard", "MuJoCo discrete, hard", "MuJoCo RK4, hard",
            "Pinocchio semi-implicit Euler", "Pinocchio RK4, soft stabilisation",
        )  # fmt: skip
    return tree_methods(case)


def tree_methods(case: StabilityCase) -> tuple[Method, ...]:
    """The same for mechanisms without rows, and for what rows have no part in."""
    rows = "hard" if case.mechanism.loops or case.mechanism.relations else "defaults"
    names = [f"MuJoCo {i}, {rows}" for i in ("Euler", "implicitfast", "discrete", "RK4")]
    return case.methods(*names, "Pinocchio semi-implicit Euler", "Pinocchio RK4, soft stabilisation")
