"""Methods of simulation as data: engine, integrator, treatment of the constraints, and what one turns to make it sharper.

One registry; `mechlab.studies.chart.chart` runs all of it. Adding a method is adding a row.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from mechlab.errors import unknown
from mechlab.experiment.prices import (
    CALLBACK,
    CONSTRAINED,
    EQUATIONS,
    MUJOCO,
    ONE_FREEDOM,
    OWN_EQUATIONS,
    Price,
    price_of_laws,
)
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Scene, Settings
from mechlab.integrate.work import ADAPTIVE_STAGE, FIXED_STAGE, LSODA_CALL
from mechlab.kit.witness import ENGINES, room
from mechlab.lab.design import Design
from mechlab.mechanism import Mechanism

SMOOTH_LAWS = ("constant", "harmonic", "table", "servo", "viscous", "constant_power")
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
        return _AVAILABLE[self.engine](self, problem)

    def run(self, problem: Problem, value: float) -> Trace:
        """The problem at a step [s] that divides the output distance, or at a tolerance."""
        return _RUN[self.engine](self, problem, value)

    def price(self, problem: Problem) -> float:
        """Expected counted work [s] of a step, or of an evaluation where a tolerance is what is refined."""
        laws = problem.scene.laws
        stage = _stage(self, problem).of(problem.mechanism) + price_of_laws(laws)
        if self.engine == "mujoco":
            stage += 0.0 if all(law.kind == "constant" for law in laws) else CALLBACK
            between = 0.0
        else:
            between = FIXED_STAGE if self.control == "step" else ADAPTIVE_STAGE
        if self.integrator == "LSODA":
            between = LSODA_CALL
        return (stage + between) * (4.0 if self.integrator == "RK4" else 1.0)

    def stepper(self, problem: Problem, value: float) -> Stepper:
        """The problem at a step [s] or tolerance, to be run as far as is worth it: ready to start."""
        if self.engine == "mujoco" and self.control == "step" and self.constraints != "extrapolated":
            from mechlab.engines.mujoco.trace import Steps

            between = problem.scene.duration / problem.outputs
            return Steps(problem.mechanism, problem.scene, self.settings(value), between)
        return _Again(self, problem, value)


class Stepper(Protocol):
    """A run that goes on from where it stands."""

    def advance(self, outputs: int) -> Trace:
        """The states as they stand and after each of `outputs` output distances more."""
        ...


class _Again:
    """A method that cannot go on: it runs from the start every time, and that is what it costs."""

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
    Method("Exudyn generalized-alpha", "exudyn", "generalized-alpha", "own", order=2),
    Method("Exudyn trapezoidal", "exudyn", "trapezoidal", "own", order=2),
    Method("Exudyn RK44", "exudyn", "RK44", "own", order=4),
    Method("Exudyn RK67", "exudyn", "RK67", "own", order=6),
    Method("Exudyn DOPRI5", "exudyn", "DOPRI5", "own", "tolerance", 5),
    Method("Drake discrete SAP", "drake", "SAP", "own"),
    Method("Drake RK3", "drake", "runge_kutta3", "own", "tolerance", 3),
    Method("Drake RK5", "drake", "runge_kutta5", "own", "tolerance", 5),
    Method("Drake Radau3", "drake", "radau3", "own", "tolerance", 3),
    Method("OpenSim Runge-Kutta-Merson", "opensim", "RungeKuttaMerson", "own", "tolerance", 4),
    Method("OpenSim Runge-Kutta-Fehlberg", "opensim", "RungeKuttaFeldberg", "own", "tolerance", 5),
    Method("OpenSim CPodes", "opensim", "CPodes", "own", "tolerance", 5),
)
"""Other people's engines, run only by charts that are asked for them; their constraints are the engine's own."""

GAINS = {"soft": (0.01, 0.2), "stiff": (0.25, 1.0)}
"""Baumgarte gains kp h^2, kd h. Soft keeps the order of RK4; stiff survives singular positions."""


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


def is_rough(mechanism: Mechanism) -> bool:
    """Whether a joint or shaft has dry friction."""
    return any(j.friction for j in mechanism.joints) or any(s.friction for s in mechanism.shafts)


def has_kinks(scene: Scene) -> bool:
    """Whether a law of the scene jumps or bends on the way: contact, a stop, a rate that is caught, a servo at its limit. No
    method by steps keeps its order there."""
    return any(law.kind in KINKED_LAWS or math.isfinite(getattr(law, "limit", math.inf)) for law in scene.laws)


def why_no_tree(problem: Problem) -> str:
    """Why a problem is not a smooth tree of one-coordinate joints under laws without memory; empty when it is."""
    m, laws = problem.mechanism, problem.scene.laws
    if m.loops or m.relations:
        return "it has loops or gears"
    if is_rough(m) or any(j.nv != 1 for j in m.joints) or any(s.inertia or s.damping or s.stiffness for s in m.shafts):
        return "its joints or shafts are of other kinds, or have dry friction"
    other = [law.kind for law in laws if law.kind not in SMOOTH_LAWS]
    return f"a law of kind {other[0]}" if other else ""


# -- engines ---------------------------------------------------------------------------------------------------------------


def _room(m: Method, problem: Problem) -> str:
    from mechlab.errors import EngineMissing

    try:
        room(m.engine if m.engine in ENGINES else "pinocchio")
    except EngineMissing as missing:
        return str(missing)
    return ""


def _loose(m: Method, problem: Problem) -> str:
    mechanism = problem.mechanism
    if m.integrator == "LSODA":
        return why_no_tree(problem) or _room(m, problem)
    if m.constraints == "hard" and not (mechanism.loops or mechanism.relations or is_rough(mechanism)):
        return "nothing to harden: it has no loops, no gears, no dry friction"
    return _room(m, problem)


def _pinocchio_fits(m: Method, problem: Problem) -> str:
    missing = _room(m, problem)
    if not missing and m.integrator == "LSODA":
        return why_no_tree(problem)
    if not missing and is_rough(problem.mechanism) != bool(m.friction):
        return "no dry friction" if m.friction else "dry friction: see the methods that say how they take it"
    if not missing and m.constraints == "stiff" and m.integrator == "RK4":
        from mechlab.engines.pinocchio.trace import fits

        if not problem.mechanism.loops or not fits(problem.mechanism, problem.scene.laws):
            return "no stabilisation to choose"
    return missing


def _one_freedom(m: Method, problem: Problem) -> str:
    from mechlab.mechanism import structure

    try:
        import mechlab.engines.own.one_freedom  # noqa: F401
    except ImportError as error:
        return f"not available: {error}"
    freedoms = structure(problem.mechanism).freedoms
    return "" if freedoms == 1 else f"it has {freedoms} freedoms"


def _hybrid(m: Method, problem: Problem) -> str:
    return _room(m, problem) if is_rough(problem.mechanism) else "no dry friction: the same as Pinocchio DOP853"


def _own(m: Method, problem: Problem) -> str:
    reference = problem.design.entry.reference
    if reference is None or not {"method", "tolerance"} <= set(inspect.signature(reference).parameters):
        return "it has no own equations of motion"
    return ""


def _mujoco(m: Method, problem: Problem, value: float) -> Trace:
    from mechlab.engines.mujoco.trace import adaptive, extrapolated, trace

    if m.integrator == "LSODA":
        return adaptive(problem.mechanism, problem.scene, m.settings(value), problem.outputs)
    if m.constraints == "extrapolated":
        return extrapolated(problem.mechanism, problem.scene, m.settings(value), problem.outputs)
    return trace(problem.mechanism, problem.scene, m.settings(value), problem.outputs)


def _pinocchio(m: Method, problem: Problem, value: float) -> Trace:
    from mechlab.engines.pinocchio.trace import Stabilisation, trace

    if m.friction:
        from mechlab.engines.pinocchio.trace import trace_friction as rough_trace

        return rough_trace(problem.mechanism, problem.scene, m.settings(value), problem.outputs, m.friction)
    gains = Stabilisation(*GAINS["soft" if m.integrator == "LSODA" else m.constraints])
    return trace(problem.mechanism, problem.scene, m.settings(value), problem.outputs, gains)


def _stage(m: Method, problem: Problem) -> Price:
    """The price of an evaluation by the engine of a method."""
    if m.engine != "pinocchio":
        return {"mujoco": MUJOCO, "one_freedom": ONE_FREEDOM, "hybrid": EQUATIONS}.get(m.engine, Price(OWN_EQUATIONS))
    from mechlab.engines.pinocchio.trace import fits

    return CONSTRAINED if fits(problem.mechanism, problem.scene.laws) else EQUATIONS


def _times(problem: Problem) -> np.ndarray:
    return np.linspace(0.0, problem.scene.duration, problem.outputs + 1)


def _runner(m: Method, problem: Problem, value: float) -> Trace:
    """A runner that makes a Recording; its cost is that of its integration."""
    from importlib import import_module

    module = import_module(
        "mechlab.engines.own.one_freedom" if m.engine == "one_freedom" else "mechlab.engines.own.hybrid"
    )
    recording = module.run(problem.mechanism, problem.scene, m.settings(value), _times(problem))
    ends = [f.sentence for f in recording.health.findings if f.name == "blow_up"]
    cost = recording.cost
    return Trace(recording.q, recording.v, cost.cpu_s, cost.steps, ends[0] if ends else "", cost.evaluations)


def _equations(m: Method, problem: Problem, value: float) -> Trace:
    reference: Any = problem.design.entry.reference
    recording = reference(problem.design.parameters, problem.scene, method=m.integrator, tolerance=value)
    at = np.searchsorted(recording.t, _times(problem) * (1.0 - 1e-12))
    cost = recording.cost
    return Trace(recording.q[at], recording.v[at], cost.cpu_s, cost.steps, evaluations=cost.evaluations)


def _peer_fits(m: Method, problem: Problem) -> str:
    from mechlab.engines.peers import refusal

    return refusal(m.engine, m.integrator, problem.mechanism, problem.scene)


def _peer(m: Method, problem: Problem, value: float) -> Trace:
    from mechlab.engines.peers.process import trace

    return trace(problem.mechanism, problem.scene, m.settings(value), problem.outputs)


_AVAILABLE: dict[str, Callable[[Method, Problem], str]] = {
    "mujoco": _loose, "pinocchio": _pinocchio_fits, "one_freedom": _one_freedom, "hybrid": _hybrid, "analytic": _own,
    "exudyn": _peer_fits, "drake": _peer_fits, "opensim": _peer_fits,
}  # fmt: skip
_RUN: dict[str, Callable[[Method, Problem, float], Trace]] = {
    "mujoco": _mujoco, "pinocchio": _pinocchio, "one_freedom": _runner, "hybrid": _runner, "analytic": _equations,
    "exudyn": _peer, "drake": _peer, "opensim": _peer,
}  # fmt: skip
