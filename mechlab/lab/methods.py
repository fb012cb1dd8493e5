"""Methods of simulation as data: engine, integrator, treatment of the constraints, and the control that refines them.

One registry; `mechlab.studies.chart.run` runs all of it. Adding a method is adding a row.
"""

from __future__ import annotations

import inspect
import math
from dataclasses import replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from mechlab.engines.protocol import available, engine
from mechlab.errors import unknown
from mechlab.experiment.prices import CALLBACK, OWN_EQUATIONS, Price, price_of_laws
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Scene, Settings
from mechlab.integrate.work import ADAPTIVE_STAGE, FIXED_STAGE, LSODA_CALL
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism

OWN = "analytic"
"""Not an engine: the own equations of motion of the entry."""
KINKED_LAWS = ("floor", "one_sided_stop", "held_rates")
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)


@dataclass(frozen=True)
class Problem:
    """A scene of a design to be run by many methods, compared at `outputs` + 1 even times."""

    design: Design
    scene: Scene
    outputs: int = 100

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism at the fidelity of the scene."""
        return self.design.mechanism(self.scene.fidelity)


@dataclass(frozen=True)
class Method:
    """constraints: "default" (the engine's own softness), "hard" (solref 2h, solimp .9999), "extrapolated" (hard, and
    2 run(h / 2) - run(h), Richardson 1911), "soft" or "stiff" Baumgarte gains, "exact" (own coordinates). control: what is
    refined, "step" [s] or "tolerance". order: expected of the error.
    friction: how dry friction enters the right-hand side, "sign" or "tanh" of the sliding rate; such a method is for
    mechanisms with dry friction alone."""

    name: str
    engine: str
    integrator: str
    constraints: str
    control: str = "step"
    order: int = 1
    friction: str = ""

    @property
    def is_default(self) -> bool:
        """True for an engine as it comes, which a chart always shows."""
        return self.constraints == "default"

    def settings(self, value: float) -> Settings:
        """Settings at a step [s] or tolerance."""
        how: dict[str, Any] = {"engine": self.engine, "integrator": self.integrator, "preset": self.name}
        how["timestep" if self.control == "step" else "tolerance"] = value
        if self.is_default:
            how |= {"timeconst": None, "impedance": None}
        return Settings(**how)

    def available(self, problem: Problem) -> str:
        """Why it cannot run the problem; empty when it can."""
        if self.engine == OWN:
            return _why_no_own_equations(problem)
        missing = available(self.engine)
        return missing or engine(self.engine).refuses(
            problem.mechanism, problem.scene, self.settings(1.0), self.constraints, self.friction
        )

    def run(self, problem: Problem, value: float) -> Trace:
        """The problem at a step [s] that divides the output distance, or at a tolerance."""
        if self.engine == OWN:
            return _own_equations(self, problem, value)
        return engine(self.engine).trace(
            problem.mechanism, problem.scene, self.settings(value), problem.outputs, self.constraints, self.friction
        )

    def price(self, problem: Problem) -> float:
        """Expected counted work [s] of a step, or of an evaluation where a tolerance is what is refined."""
        laws = problem.scene.laws
        own = self.engine == OWN
        one = Price(OWN_EQUATIONS) if own else engine(self.engine).price(problem.mechanism, laws)
        stage = one.of(problem.mechanism) + price_of_laws(laws)
        if self.engine == "mujoco":
            stage += 0.0 if all(law.kind == "constant" for law in laws) else CALLBACK
            between = 0.0
        else:
            between = FIXED_STAGE if self.control == "step" else ADAPTIVE_STAGE
        if self.integrator == "LSODA":
            between = LSODA_CALL
        return (stage + between) * (4.0 if self.integrator == "RK4" else 1.0)

    def stepper(self, problem: Problem, value: float) -> Stepper:
        """The problem at a step [s] or tolerance, ready to start; the caller decides how far it runs."""
        found: Stepper | None = None
        if self.engine != OWN and self.control == "step" and self.constraints != "extrapolated":
            between = problem.scene.duration / problem.outputs
            found = engine(self.engine).stepper(
                problem.mechanism, problem.scene, self.settings(value), between, self.constraints, self.friction
            )
        return found or _Again(self, problem, value)


class Stepper(Protocol):
    """A run that can be continued."""

    def advance(self, outputs: int) -> Trace:
        """The present state and the states after each of `outputs` further output intervals."""
        ...


class _Again:
    """A method that cannot continue a run: it runs from the start every time, at the full cost."""

    def __init__(self, method: Method, problem: Problem, value: float) -> None:
        self.method, self.problem, self.value, self.done = method, problem, value, 0

    def advance(self, outputs: int) -> Trace:
        """See `Stepper`."""
        before, self.done = self.done, self.done + outputs
        p = self.problem
        scene = replace(p.scene, duration=p.scene.duration / p.outputs * self.done)
        whole = self.method.run(Problem(p.design, scene, self.done), self.value)
        return replace(whole, q=whole.q[before:], v=whole.v[before:])


def _orders(integrator: str) -> int:
    return {"RK4": 4, "DOP853": 8, "Radau": 5}.get(integrator, 1)


METHODS: tuple[Method, ...] = (
    *(Method(f"MuJoCo {i}, defaults", "mujoco", i, "default", order=_orders(i)) for i in MUJOCO_INTEGRATORS),
    *(Method(f"MuJoCo {i}, hard", "mujoco", i, "hard", order=min(2, _orders(i))) for i in MUJOCO_INTEGRATORS),
    Method("MuJoCo discrete, extrapolated", "mujoco", "discrete", "extrapolated", order=2),
    Method("Pinocchio semi-implicit Euler", "pinocchio", "semi_implicit_Euler", "stiff"),
    Method("Pinocchio RK4, soft stabilisation", "pinocchio", "RK4", "soft", order=4),
    Method("Pinocchio RK4, stiff stabilisation", "pinocchio", "RK4", "stiff", order=4),
    Method("Pinocchio DOP853", "pinocchio", "DOP853", "soft", "tolerance", 8),
    Method("LSODA on MuJoCo's tree", "mujoco", "LSODA", "exact", "tolerance", 5),
    Method("LSODA on Pinocchio's tree", "pinocchio", "LSODA", "exact", "tolerance", 5),
    Method("one freedom RK4", "one_freedom", "RK4", "exact", order=4),
    Method("one freedom DOP853", "one_freedom", "DOP853", "exact", "tolerance", 8),
    Method(
        "Pinocchio semi-implicit Euler, friction by tanh", "pinocchio", "semi_implicit_Euler", "exact", friction="tanh"
    ),
    Method("Pinocchio RK4, friction by tanh", "pinocchio", "RK4", "exact", friction="tanh"),
    Method("Pinocchio RK4, friction by sign", "pinocchio", "RK4", "exact", friction="sign"),
    Method("Pinocchio DOP853, friction by sign", "pinocchio", "DOP853", "exact", "tolerance", friction="sign"),
    Method("hybrid DOP853", "hybrid", "DOP853", "exact", "tolerance", 8),
    Method("own equations, scipy DOP853", "analytic", "DOP853", "exact", "tolerance", 8),
    Method("own equations, scipy Radau", "analytic", "Radau", "exact", "tolerance", 5),
)
"""Softness of MuJoCo's hard constraints goes with h^2, which limits RK4 with loops to order 2."""

PEER_METHODS: tuple[Method, ...] = (
    *(
        Method(f"Exudyn {rule}{bodies}{newton}", "exudyn", f"{rule}{bodies}{newton}", "own", order=2)
        for rule in ("generalized-alpha", "trapezoidal")
        for bodies in ("", ", planar bodies")
        for newton in ("", ", full Newton")
    ),
    Method("Exudyn RK44", "exudyn", "RK44", "own", order=4),
    Method("Exudyn RK67", "exudyn", "RK67", "own", order=6),
    Method("Exudyn DOPRI5", "exudyn", "DOPRI5", "own", "tolerance", 5),
    Method("Drake discrete SAP", "drake", "SAP", "own"),
    Method("Drake RK3", "drake", "runge_kutta3", "own", "tolerance", 3),
    Method("Drake RK5", "drake", "runge_kutta5", "own", "tolerance", 5),
    Method("Drake Radau3", "drake", "radau3", "own", "tolerance", 3),
    Method("OpenSim Runge-Kutta 3", "opensim", "RungeKutta3", "own", "tolerance", 3),
    Method("OpenSim Runge-Kutta-Merson", "opensim", "RungeKuttaMerson", "own", "tolerance", 4),
    Method("OpenSim Runge-Kutta-Fehlberg", "opensim", "RungeKuttaFeldberg", "own", "tolerance", 5),
    Method("OpenSim CPodes", "opensim", "CPodes", "own", "tolerance", 5),
    Method("mujoco-warp RK4", "mujoco_warp", "RK4", "own", order=2),
    Method("mujoco-warp implicitfast", "mujoco_warp", "implicitfast", "own"),
    Method("Kamino LOX", "newton", "LOX", "own"),
    Method("Kamino DVI", "newton", "DVI", "own"),
)
"""Other people's engines, run only by charts that are asked for them; their constraints are the engine's own."""


def method(name: str) -> Method:
    """The method of that name; raises MechlabError that lists them."""
    for found in METHODS:
        if found.name == name:
            return found
    raise unknown("method", name, [m.name for m in METHODS])


def steps(problem: Problem, count: int = 13) -> tuple[float, ...]:
    """Step sizes to choose from: the output distance and its halves, so that every output time is the end of a step."""
    between = problem.scene.duration / problem.outputs
    return tuple(between / 2**k for k in range(count))


def has_kinks(scene: Scene) -> bool:
    """Whether a law of the scene jumps or bends on the way: contact, a stop, a rate that is caught, a servo at its limit. No
    method by steps keeps its order there."""
    return any(law.kind in KINKED_LAWS or math.isfinite(getattr(law, "limit", math.inf)) for law in scene.laws)


def _why_no_own_equations(problem: Problem) -> str:
    reference = problem.design.entry.reference
    if reference is None or not {"method", "tolerance"} <= set(inspect.signature(reference).parameters):
        return "it has no own equations of motion"
    return ""


def _own_equations(m: Method, problem: Problem, value: float) -> Trace:
    reference: Any = problem.design.entry.reference
    recording = reference(problem.design.parameters, problem.scene, method=m.integrator, tolerance=value)
    times = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
    at = np.searchsorted(recording.t, times * (1.0 - 1e-12))
    cost = recording.cost
    return Trace(recording.q[at], recording.v[at], cost.cpu_s, cost.steps, evaluations=cost.evaluations)
