"""Maps of mechanisms with gear relations: gear ratio, and light parts under load."""

from __future__ import annotations

from dataclasses import replace

from mechlab.experiment.lag import predicted_lags
from mechlab.experiment.laws import Constant
from mechlab.experiment.scene import Scene
from mechlab.mechanism import Mechanism
from mechlab.study.methods import Method, Problem
from mechlab.study.stability.data import Axis, Theory
from mechlab.study.stability.loops import loop_bodies
from mechlab.study.stability.plan import Case, Plan, steps_of, usual_methods
from mechlab.study.stability.vary import faster_joint, rough_parts, scale_friction, scale_mass, with_mechanism

RATIOS = (1e-2, 1e-1, 1.0, 1e1, 1e2)
LIGHT = (1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1)
LAG = 1e-3
"""A lag of a relation [rad or m] that is still right."""
PROBE = 1e-3


def with_relations(case: Case) -> Case | str:
    """The case at its own fidelity, or at the cheapest that has gear relations as rows; or why there is none."""
    if case.mechanism.relations:
        return _smooth(case)
    for level in case.design.entry.fidelities:
        if level == "kinematic" or level == case.scene.fidelity:
            continue
        other = replace(case, scene=case.design.scene(case.scene.name, level))
        if other.mechanism.relations:
            return _smooth(other)
    return "it has no gear relations at any fidelity"


def _smooth(case: Case) -> Case:
    """Without dry friction, which has a map of its own."""
    m = case.mechanism
    if not rough_parts(m):
        return case
    return replace(case, design=with_mechanism(case.design, scale_friction(m, 0.0)))


def free_gear(case: Case) -> str | None:
    """A joint in a relation that carries nothing, is in no loop, and is neither driven, loaded nor set by the scene."""
    m, scene = case.mechanism, case.scene
    parents = {b.parent for b in m.bodies}
    looped = {n for x in m.loops for n in loop_bodies(m, x)}
    set_by = set(scene.initial) | set(scene.initial_rates) | {n for law in scene.laws for n in law.targets()}
    set_by |= {n for s in m.shafts if s.name in set_by for n, _ in s.coefficients}
    home = {j.name: b for b in m.bodies for j in b.joints}
    related = dict.fromkeys(n for r in m.relations for n, _ in r.coefficients)
    free = [n for n in related if n not in set_by and home[n].name not in parents and home[n].name not in looped]
    return free[-1] if free else None


def plan_gear_ratio(case: Case) -> Plan | str:
    """A gear that turns ever faster than it does."""
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

    axis = Axis("ratio / as given", "", RATIOS, f"{joint} turns this times as fast", 1.0)
    return Plan(
        "gear-ratio", "timestep and gear ratio", axis, problem, usual_methods(case), steps_of(duration),
        remark=_fidelity(case),
    )  # fmt: skip


def plan_light_parts(case: Case) -> Plan | str:
    """A gear ever lighter under the same load: the lag r = (1-d) tc^2 zeta^2 A f of its soft row."""
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
    return Plan(
        "light-parts", "timestep and light loaded parts", Axis("inertia / as given", "", LIGHT, text, 1.0),
        lambda y: case.problem(scale_mass(m, body, y), scene, duration), methods, steps_of(duration), "gap", LAG,
        10.0 * LAG, theory=theory, remark=_fidelity(case),
    )  # fmt: skip


def _load(m: Mechanism, scene: Scene) -> float:
    """The largest reaction of the relations as the scene is, or the weight at a hand's breadth where there is none."""
    from mechlab.experiment.settings import Settings

    loads = [x.load for x in predicted_lags(m, scene, Settings())]
    return max([*loads, 1e-3 * m.total_mass * 9.81])


def _step(m: Mechanism, scene: Scene, body: str, factor: float, way: Method) -> float:
    """The timestep at which the predicted lag of the worst relation is LAG: it goes with h^2."""
    lags = predicted_lags(scale_mass(m, body, factor), scene, way.settings(PROBE))
    return PROBE * (LAG / max([x.lag for x in lags] + [1e-300])) ** 0.5


def _fidelity(case: Case) -> str:
    free = f", {case.remark}" if case.remark else ""
    return f"fidelity {case.scene.fidelity}{free}, where gears are rows; dry friction, if any, is left out"
