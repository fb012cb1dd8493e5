"""Which maps a mechanism gets, and making them within a budget of counted work."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.acting import what_acts
from mechlab.integrate import work_done
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.methods import METHODS
from mechlab.lab.run import versions
from mechlab.studies.stability.data import Axis, Map, Stability
from mechlab.studies.stability.gears import plan_gear_ratio, plan_light_parts, plan_sticking, plan_stiffness
from mechlab.studies.stability.loops import plan_mass_ratio, plan_redundancy, plan_singular, plan_softness
from mechlab.studies.stability.measure import panels
from mechlab.studies.stability.plan import Case, Plan
from mechlab.studies.stability.ranges import plan_range
from mechlab.studies.stability.report import sentences
from mechlab.values import Range

KINDS: dict[str, Callable[[Case], Plan | str]] = {
    "stiffness": plan_stiffness,
    "mass-ratio": plan_mass_ratio,
    "singularity": plan_singular,
    "redundancy": plan_redundancy,
    "softness": plan_softness,
    "gear-ratio": plan_gear_ratio,
    "light-parts": plan_light_parts,
    "sticking": plan_sticking,
}
"""Maps that the structure of a mechanism calls for. Adding a kind is adding a row."""
BUDGET = 26.0
"""Counted work of a study [s] (`mechlab.integrate.work`), unless it is asked for more."""
WEIGHTS = {"stiffness": 2.0, "softness": 0.6, "redundancy": 0.6}
"""Shares of the budget, where they are not 1: stiff references are slow."""


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
    """Stability maps of a scene of a design: timestep against what may make a method fail.

    kinds: of KINDS (default: all that fit; with `ranges`, those alone). methods: names, or parts of names, of
    `mechlab.lab.methods`. ranges: parameter, BODY_mass, X_stiffness or friction -> Range. budget [s]: of counted work, about seconds
    of CPU, but the same map comes out on every machine.
    Raises MechlabError for unknown names, and for a kind that does not fit the mechanism, saying why.
    """
    if not budget > 0:
        raise MechlabError(f"budget: expected seconds of work > 0, got {budget!r}.")
    lived = design.for_scene(scene)
    made = chosen_scene(lived, scene, fidelity)
    lived.mechanism(made.fidelity)
    case = Case(lived, made, chosen_methods(methods))
    for kind in kinds:
        if kind not in KINDS:
            raise unknown("map", kind, KINDS)
    began, first = time.process_time(), work_done()
    plans: list[Plan] = [plan_range(case, key, given) for key, given in (ranges or {}).items()]
    without: dict[str, str] = {}
    for kind in kinds or (() if plans else tuple(KINDS)):
        progress(f"{kind}: which")
        found = KINDS[kind](case)
        if isinstance(found, Plan):
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


def make_map(plan: Plan, seconds: float, progress: Callable[[str], None] = lambda line: None) -> Map:
    """Run a plan within `seconds` of work."""
    shown, skipped = panels(plan, seconds, progress)
    able = tuple(m for m in plan.methods if m.name in {p.method for p in shown})
    theory = plan.theory(able)
    x = Axis("timestep", "s", plan.steps)
    first = plan.problem(plan.y.nominal if plan.y.nominal in plan.y.values else plan.y.values[-1])
    names = {
        "error": "error / how far it moves",
        "energy": "energy astray / energy turned over",
        "gap": "open rows, rad or m",
    }
    made = Map(
        plan.kind, plan.title, x, plan.y, shown, theory, names[plan.measure], plan.right, plan.wrong,
        first.scene.fidelity, first.scene.duration, (), skipped,
    )  # fmt: skip
    return replace(made, sentences=sentences(made, plan.remark))


def chosen_methods(names: Sequence[str]) -> tuple[str, ...]:
    """Names of the methods meant: a full name, or a part that several may share. Raises MechlabError that lists them."""
    out: list[str] = []
    for name in names:
        every = [m.name for m in METHODS if m.control == "step"]
        meant = [n for n in every if n == name] or [n for n in every if name.lower() in n.lower()]
        if not meant:
            raise unknown("method with a timestep", name, every)
        out += [n for n in meant if n not in out]
    return tuple(out)
