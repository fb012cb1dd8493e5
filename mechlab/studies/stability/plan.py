"""The plan of a stability map: its rows, methods and timesteps; and methods with another softness of the
constraints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.design import Design
from mechlab.lab.methods import Method, Problem, method
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.studies.stability.data import StabilityAxis, Theory
from mechlab.studies.stability.vary import with_mechanism, without_ranges


@dataclass(frozen=True)
class SoftenedMethod(Method):
    """A method with another softness of its constraint rows. MuJoCo: time_constant [s] and impedance; Pinocchio: `mu`.
    A value of 0 keeps that of the method."""

    time_constant: float = 0.0
    impedance: float = 0.0
    mu: float = 0.0

    def settings(self, value: float) -> Settings:
        """Settings at a step [s], with this softness."""
        base = Method.settings(self, value)
        if self.time_constant:
            base = replace(base, timeconst=self.time_constant / value)
        if self.impedance:
            base = replace(base, impedance=self.impedance)
        return base

    def run(self, problem: Problem, value: float) -> Trace:
        """Run the problem at a step [s] that divides the time between outputs."""
        if self.engine != "pinocchio" or not self.mu:
            return Method.run(self, problem, value)
        engine("pinocchio")  # raises EngineMissing where it is not installed
        from mechlab.engines.pinocchio.trace import GAINS, Stabilisation, trace

        gains = Stabilisation(*GAINS[self.constraints], self.mu)
        return trace(problem.mechanism, problem.scene, self.settings(value), problem.outputs, gains)


def with_softness(
    method: Method, time_constant: float = 0.0, impedance: float = 0.0, mu: float = 0.0
) -> SoftenedMethod:
    """The method with this softness; see `SoftenedMethod`."""
    kept = {f.name: getattr(method, f.name) for f in fields(Method)}
    return SoftenedMethod(**kept, time_constant=time_constant, impedance=impedance, mu=mu)


OUTPUTS = 10
"""Number of output intervals of every run; a timestep divides an interval."""
DIVISIONS = (1, 2, 3, 5, 8, 13, 21, 34, 55)
"""Numbers of steps between two outputs: timesteps over almost two decades."""
STEERING = ("servo", "computed_torque", "held_rates")
LONGEST = 2.0
"""Longest simulated time [s] of maps that set none of their own."""
FALL = 3.0
"""Simulated time of a mechanism whose servos are left out, in units of sqrt(size / g)."""
FREE = "without the servos of the scene"


@dataclass(frozen=True)
class StabilityPlan:
    """The plan of a map. problem(y): the problem of row y; tune(method, y): the method as used there.

    measure: "error" (of coordinates, relative to their motion), "energy" (error relative to the turnover) or "gap"
    (residual of loops and relations [rad or m]); `right`, `wrong`: its limits. theory(methods): boundaries to draw.
    reference: name of the method of the reference runs ("": see `measure.sharp_method`).
    """

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
    """Timesteps [s], ascending, that divide the time between outputs."""
    return tuple(sorted(duration / OUTPUTS / k for k in divisions))


@dataclass(frozen=True)
class StabilityCase:
    """The design and scene that plans are made for. `only`: names of the methods that the user chose
    (empty: no choice)."""

    design: Design
    scene: Scene
    only: tuple[str, ...] = ()
    remark: str = ""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism at the fidelity of the scene."""
        return self.design.mechanism(self.scene.fidelity)

    def problem(self, mechanism: Mechanism | None = None, scene: Scene | None = None, duration: float = 0.0) -> Problem:
        """The problem of the case, with another mechanism, scene or duration [s]; ranges of joints are removed."""
        design = with_mechanism(self.design, without_ranges(mechanism or self.mechanism))
        used = scene or self.scene
        return Problem(design, replace(used, duration=duration or used.duration), OUTPUTS)

    @property
    def free(self) -> StabilityCase:
        """The same start without servos, computed torques and held rates, whose limits the map of stiffness shows."""
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
    """The methods of most maps: with loops or relations, MuJoCo's defaults and hard rows, and Pinocchio's."""
    if case.mechanism.is_closed:
        return case.methods(
            "MuJoCo implicitfast, defaults", "MuJoCo implicitfast, hard", "MuJoCo discrete, hard", "MuJoCo RK4, hard",
            "Pinocchio semi-implicit Euler", "Pinocchio RK4, soft stabilisation",
        )  # fmt: skip
    return tree_methods(case)


def tree_methods(case: StabilityCase) -> tuple[Method, ...]:
    """The methods for mechanisms without constraint rows, and for maps that do not depend on the rows."""
    rows = "hard" if case.mechanism.is_closed else "defaults"
    names = [f"MuJoCo {i}, {rows}" for i in ("Euler", "implicitfast", "discrete", "RK4")]
    return case.methods(*names, "Pinocchio semi-implicit Euler", "Pinocchio RK4, soft stabilisation")
