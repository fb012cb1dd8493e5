"""Stability maps of a mechanism: outcome over the timestep and a varied quantity, within a budget of counted work.

`KINDS` are the maps that follow from the structure of a mechanism; a range of a parameter, mass, stiffness or friction
adds a map.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.acting import what_acts
from mechlab.experiment.laws import Servo
from mechlab.integrate import work_done
from mechlab.lab.design import Design
from mechlab.lab.design import design as make_design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.methods import METHODS, Problem
from mechlab.lab.single_run import versions
from mechlab.studies.named.number import SINGLE_NUMBERS, parameter_infos, parameter_values
from mechlab.studies.stability.data import Stability, StabilityAxis, StabilityMap
from mechlab.studies.stability.gears import plan_gear_ratio, plan_light_parts, plan_sticking
from mechlab.studies.stability.loops import plan_mass_ratio, plan_redundancy, plan_singular, plan_softness
from mechlab.studies.stability.measure import panels
from mechlab.studies.stability.plan import LONGEST, OUTPUTS, StabilityCase, StabilityPlan, steps_of, usual_methods
from mechlab.studies.stability.report import VALUE_NAMES, sentences
from mechlab.studies.stability.springs import plan_stiffness, stiff_parts
from mechlab.studies.stability.vary import (
    rough_parts,
    scale_friction,
    scale_mass,
    scale_servos,
    scale_springs,
    with_mechanism,
    without_ranges,
)
from mechlab.values import Range, in_unit

FEWEST, MOST, USUAL = 2, 40, 7
LOG_FROM = 100.0
"""Ratio high / low above which a range is spaced evenly in its logarithm."""


def spaced(key: str, given: Range) -> tuple[float, ...]:
    """The values of a range, ends included, ascending; evenly spaced, or logarithmically above two decades.

    Raises MechlabError for an empty range or too many values.
    """
    count = USUAL if given.count is None else given.count
    if not FEWEST <= count <= MOST:
        raise MechlabError(f"{key}={given}: expected {FEWEST} to {MOST} values, got {count}.")
    low, high = sorted((float(given.low), float(given.high)))
    if low == high:
        raise MechlabError(f"{key}={given}: the range is empty; write {key}=low:high or {key}=low:high:count.")
    if low > 0 and high > LOG_FROM * low:
        inner = np.geomspace(low, high, count)
        return (low, *(float(x) for x in inner[1:-1]), high)
    return (low, *(float(x) for x in np.linspace(low, high, count)[1:-1]), high)


def plan_range(case: StabilityCase, key: str, given: Range) -> StabilityPlan:
    """The plan of a map over a range. Raises MechlabError for an unknown key, listing what can be varied."""
    infos = parameter_infos(case.design)
    values = spaced(key, given)
    duration = min(case.scene.duration, LONGEST)
    if key in infos and infos[key].kind in SINGLE_NUMBERS:
        info = infos[key]
        in_unit(key, given, info.unit)

        def problem(y: float) -> Problem:
            given_values = {k: v for k, v in case.design.given.items() if k in infos}
            made = make_design(case.design.entry, {**parameter_values(case.design), **given_values, key: y})
            scene = made.scene(case.scene.name, case.scene.fidelity, duration)
            open_ended = without_ranges(made.mechanism(scene.fidelity))
            return Problem(with_mechanism(made, open_ended), scene, OUTPUTS)

        nominal = getattr(case.design.parameters, key)
        axis = StabilityAxis(key, info.unit, values, info.text, None if nominal is None else float(nominal))
    else:
        parts = _parts(case, duration)
        if key not in parts:
            raise unknown(
                f"{case.design.name}: quantity to vary",
                key,
                [*(n for n, i in infos.items() if i.kind in SINGLE_NUMBERS), *parts],
            )
        start, unit, text, scaled = parts[key]
        in_unit(key, given, *unit.split(" or "))
        axis = StabilityAxis(key, unit, values, text, start)

        def problem(y: float) -> Problem:
            return scaled(y / start)

    return StabilityPlan(key, f"timestep and {key}", axis, problem, usual_methods(case), steps_of(duration))


Part = tuple[float, str, str, Callable[[float], Problem]]


def _parts(case: StabilityCase, duration: float) -> dict[str, Part]:
    """BODY_mass, X_stiffness, friction -> present value, unit, text, and a function that gives the problem with the
    value times a factor."""
    m, scene = case.mechanism, case.scene

    def mass(name: str, factor: float) -> Problem:
        return case.problem(scale_mass(m, name, factor), None, duration)

    def spring(name: str, factor: float) -> Problem:
        return case.problem(scale_springs(m, factor, (name,)), None, duration)

    def servo(law: Servo, factor: float) -> Problem:
        scaled = scale_servos(replace(scene, laws=(law,)), factor).laws
        others = tuple(w for w in scene.laws if w is not law)
        return case.problem(m, replace(scene, laws=(*others, *scaled)), duration)

    def friction(factor: float) -> Problem:
        return case.problem(scale_friction(m, factor), None, duration)

    out: dict[str, Part] = {}
    for body in m.bodies:
        if body.inertia.mass > 0:
            text = f"mass of {body.name}, moments in proportion"
            out[f"{body.name}_mass"] = (body.inertia.mass, "kg", text, partial(mass, body.name))
    for name, (k, unit) in stiff_parts(m).items():
        out[f"{name}_stiffness"] = (k, unit, f"stiffness of {name}, damping by its root", partial(spring, name))
    for law in scene.laws:
        if isinstance(law, Servo) and law.stiffness:
            text = f"gain of the servo of {law.on}, damping by its root"
            out[f"{law.on}_stiffness"] = (law.stiffness, "N m/rad or N/m", text, partial(servo, law))
    if rough_parts(m):
        out["friction"] = (1.0, "", "dry friction of all, times this", friction)
    return out


KINDS: dict[str, Callable[[StabilityCase], StabilityPlan | str]] = {
    "stiffness": plan_stiffness,
    "mass-ratio": plan_mass_ratio,
    "singularity": plan_singular,
    "redundancy": plan_redundancy,
    "softness": plan_softness,
    "gear-ratio": plan_gear_ratio,
    "light-parts": plan_light_parts,
    "sticking": plan_sticking,
}
"""Kind of map -> function that plans it or says why it does not fit."""
BUDGET = 26.0
"""Default for the counted work of a study [s] (`mechlab.integrate.work`)."""
WEIGHTS = {"stiffness": 2.0, "softness": 0.6, "redundancy": 0.6}
"""Weights in the budget other than 1: stiff reference runs are slow."""


def study(
    design: Design,
    scene: str | None = None,
    *,
    kinds: Sequence[str] = (),
    methods: Sequence[str] = (),
    ranges: Mapping[str, Range] | None = None,
    fidelity: str | None = None,
    budget: float = BUDGET,
    progress: Callable[[str], None] = lambda line: None,
) -> Stability:
    """Stability maps of a scene of a design: outcome over the timestep and a varied quantity.

    kinds: keys of KINDS (default: all that fit; with `ranges`, none). methods: names, or parts of names, of
    `mechlab.lab.methods`. ranges: parameter, BODY_mass, X_stiffness or friction -> Range. budget [s]: counted work,
    about seconds of CPU; every machine makes the same map. Raises MechlabError for unknown names, and for a kind that
    does not fit the mechanism, saying why.
    """
    if not budget > 0:
        raise MechlabError(f"budget: expected seconds of work > 0, got {budget!r}.")
    chosen = design.for_scene(scene)
    made = chosen_scene(chosen, scene, fidelity)
    chosen.mechanism(made.fidelity)
    case = StabilityCase(chosen, made, chosen_methods(methods))
    for kind in kinds:
        if kind not in KINDS:
            raise unknown("map", kind, KINDS)
    began, first = time.process_time(), work_done()
    plans: list[StabilityPlan] = [plan_range(case, key, given) for key, given in (ranges or {}).items()]
    without: dict[str, str] = {}
    for kind in kinds or (() if plans else tuple(KINDS)):
        progress(f"{kind}: which")
        found = KINDS[kind](case)
        if isinstance(found, StabilityPlan):
            plans.append(found)
        elif kind in kinds:
            raise MechlabError(f"{design.name}: no map {kind!r}: {found}.")
        else:
            without[kind] = found
    maps = []
    for k, plan in enumerate(plans):
        waiting = sum(WEIGHTS.get(p.kind, 1.0) for p in plans[k:])
        left = (budget - (work_done() - first)) * WEIGHTS.get(plan.kind, 1.0) / waiting
        maps.append(make_map(plan, max(1.0, left), progress))
    return Stability(
        design.name, design.entry.title, made.name, tuple(maps), without, versions(), time.process_time() - began,
        design.warnings, what_acts(case.mechanism, made),
    )  # fmt: skip


def make_map(plan: StabilityPlan, seconds: float, progress: Callable[[str], None] = lambda line: None) -> StabilityMap:
    """Run a plan within `seconds` of counted work."""
    shown, skipped = panels(plan, seconds, progress)
    able = tuple(m for m in plan.methods if m.name in {p.method for p in shown})
    theory = plan.theory(able)
    x = StabilityAxis("timestep", "s", plan.steps)
    first = plan.problem(plan.y.nominal if plan.y.nominal in plan.y.values else plan.y.values[-1])
    made = StabilityMap(
        plan.kind, plan.title, x, plan.y, shown, theory, VALUE_NAMES[plan.measure], plan.right, plan.wrong,
        first.scene.fidelity, first.scene.duration, (), skipped,
    )  # fmt: skip
    return replace(made, sentences=sentences(made, plan.remark))


def chosen_methods(names: Sequence[str]) -> tuple[str, ...]:
    """Names of all methods that match: a full name, or a part of names. Raises MechlabError, listing the methods."""
    out: list[str] = []
    for name in names:
        every = [m.name for m in METHODS if m.control == "step"]
        meant = [n for n in every if n == name] or [n for n in every if name.lower() in n.lower()]
        if not meant:
            raise unknown("method with a timestep", name, every)
        out += [n for n in meant if n not in out]
    return tuple(out)
