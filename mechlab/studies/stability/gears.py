"""Maps of gears and friction: gear ratio, light parts under load, sticking."""

from __future__ import annotations

from dataclasses import replace

from mechlab.experiment.lag import predicted_lags
from mechlab.experiment.laws import Constant
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.methods import Method, Problem
from mechlab.mechanism import Mechanism
from mechlab.studies.stability.data import StabilityAxis, Theory
from mechlab.studies.stability.loops import loop_bodies
from mechlab.studies.stability.plan import (
    StabilityCase,
    StabilityPlan,
    steps_of,
    usual_methods,
)
from mechlab.studies.stability.vary import (
    faster_joint,
    rough_parts,
    scale_friction,
    scale_mass,
    with_mechanism,
)

RATIOS = (1e-2, 1e-1, 1.0, 1e1, 1e2)
LIGHT = (1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1)
LAG = 1e-3
"""Largest lag of a relation [rad or m] that counts as right."""
PROBE = 1e-3


def with_relations(case: StabilityCase) -> StabilityCase | str:
    """The case at its own fidelity, or at the first one that has gear relations as rows; or why there is none."""
    if case.mechanism.relations:
        return _smooth(case)
    for level in case.design.entry.fidelities:
        if level == "kinematic" or level == case.scene.fidelity:
            continue
        other = replace(case, scene=case.design.scene(case.scene.name, level))
        if other.mechanism.relations:
            return _smooth(other)
    return "it has no gear relations at any fidelity"


def _smooth(case: StabilityCase) -> StabilityCase:
    """The case without dry friction, which has a map of its own."""
    m = case.mechanism
    if not rough_parts(m):
        return case
    return replace(case, design=with_mechanism(case.design, scale_friction(m, 0.0)))


def free_gear(case: StabilityCase) -> str | None:
    """A joint of a relation that carries no other body, is in no loop, and is not driven, loaded or set by the
    scene."""
    m, scene = case.mechanism, case.scene
    parents = {b.parent for b in m.bodies}
    looped = {n for x in m.loops for n in loop_bodies(m, x)}
    set_by = set(scene.initial) | set(scene.initial_rates) | {n for law in scene.laws for n in law.targets()}
    set_by |= {n for s in m.shafts if s.name in set_by for n, _ in s.coefficients}
    home = {j.name: b for b in m.bodies for j in b.joints}
    related = dict.fromkeys(n for r in m.relations for n, _ in r.coefficients)
    free = [n for n in related if n not in set_by and home[n].name not in parents and home[n].name not in looped]
    return free[-1] if free else None


def plan_gear_ratio(case: StabilityCase) -> StabilityPlan | str:
    """The map of the gear ratio: one gear turns faster or slower than given. A text says why there is no map."""
    found = with_relations(case)
    if isinstance(found, str):
        return found
    joint = free_gear(found)
    if joint is None:
        return "each gear carries a part, closes a loop or is set by the scene: no ratio can be changed alone"
    case, m = found.free, found.mechanism
    duration = case.scene.duration

    def problem(y: float) -> Problem:
        return case.problem(faster_joint(m, joint, y), None, duration)

    axis = StabilityAxis("ratio / as given", "", RATIOS, f"{joint} turns this times as fast", 1.0)
    return StabilityPlan(
        "gear-ratio", "timestep and gear ratio", axis, problem, usual_methods(case), steps_of(duration),
        remark=_fidelity(case),
    )  # fmt: skip


def plan_light_parts(case: StabilityCase) -> StabilityPlan | str:
    """The map of light parts: one gear with scaled inertia under the same load. A text says why there is no map.

    Its value is the lag of the soft row, r = (1-d) tc^2 zeta^2 A f.
    """
    found = with_relations(case)
    if isinstance(found, str):
        return found
    joint = free_gear(found)
    if joint is None:
        return "each gear carries a part, closes a loop or is set by the scene: none can be made light alone"
    m = found.mechanism
    body = next(b.name for b in m.bodies if any(j.name == joint for j in b.joints))
    case, duration = found.free, found.free.scene.duration
    load = _load(m, case.scene)
    scene = replace(case.scene, laws=(*case.scene.laws, Constant(joint, load)))
    names = [f"MuJoCo {i}, hard" for i in ("RK4", "implicitfast", "discrete")] + ["MuJoCo RK4, defaults"]
    methods = tuple(w for w in case.methods(*names) if w.engine == "mujoco")
    if not methods:
        return "the lag of soft rows is MuJoCo's: none of the methods asked for has it"

    def theory(shown: tuple[Method, ...]) -> tuple[Theory, ...]:
        lines = {w.name: tuple(_step(m, scene, body, y, w) for y in LIGHT) for w in shown if not w.is_default}
        law = f"(1-d) tc^2 A f = {LAG:g}, tc = 2h"
        return tuple(Theory(f"predicted lag {LAG:g}", law, x, LIGHT, (name,)) for name, x in lines.items())

    text = f"mass and moments of {body} times this; a constant load of {load:.3g} N m on {joint}"
    return StabilityPlan(
        "light-parts", "timestep and light loaded parts", StabilityAxis("inertia / as given", "", LIGHT, text, 1.0),
        lambda y: case.problem(scale_mass(m, body, y), scene, duration), methods, steps_of(duration), "gap", LAG,
        10.0 * LAG, theory=theory, remark=_fidelity(case),
    )  # fmt: skip


def _load(m: Mechanism, scene: Scene) -> float:
    """Load [N m] for the light gear: the largest reaction of a relation in the scene, at least that of the total weight
    at a lever of 1 mm."""

    loads = [x.load for x in predicted_lags(m, scene, Settings())]
    return max([*loads, 1e-3 * m.total_mass * 9.81])


def _step(m: Mechanism, scene: Scene, body: str, factor: float, way: Method) -> float:
    """Timestep h [s] at which the largest predicted lag of a relation is LAG; the lag is proportional to h^2."""
    lags = predicted_lags(scale_mass(m, body, factor), scene, way.settings(PROBE))
    return PROBE * (LAG / max([x.lag for x in lags] + [1e-300])) ** 0.5


def _fidelity(case: StabilityCase) -> str:
    free = f", {case.remark}" if case.remark else ""
    return f"fidelity {case.scene.fidelity}{free}, where gears are rows; dry friction, if any, is left out"


FRICTION_FACTORS = (0.01, 0.1, 0.3, 1.0, 3.0, 10.0)
LONGEST = 0.3


def plan_sticking(case: StabilityCase) -> StabilityPlan | str:
    """The map of dry friction, or a text that says why there is none."""
    m = case.mechanism
    rough = rough_parts(m)
    if not rough:
        return "it has no dry friction"
    duration = min(case.scene.duration, LONGEST)

    def problem(y: float) -> Problem:
        return case.problem(scale_friction(m, y), None, duration)

    names = [f"MuJoCo {i}, hard" for i in ("implicitfast", "discrete", "RK4")]
    methods = case.methods(
        "MuJoCo RK4, defaults", *names, "Pinocchio RK4, friction by sign", "Pinocchio RK4, friction by tanh"
    )
    text = "dry friction of " + ", ".join(f"{n} ({f:.3g} N m or N)" for n, f in rough.items()) + " times this"
    return StabilityPlan(
        "sticking", "timestep and dry friction", StabilityAxis("friction / as given", "", FRICTION_FACTORS, text, 1.0), problem,
        methods, steps_of(duration),
    )  # fmt: skip
