"""Maps over a range that the user gives: a parameter of the mechanism, or mass, stiffness or friction of a named part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.laws import Servo
from mechlab.experiment.parameters import describe
from mechlab.lab.design import design as make_design
from mechlab.lab.methods import Problem
from mechlab.studies.stability.data import Axis
from mechlab.studies.stability.gears import stiff_parts
from mechlab.studies.stability.plan import LONGEST, OUTPUTS, Case, Plan, steps_of, usual_methods
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
"""A range that spans more than this is spaced evenly in its logarithm."""


def spaced(key: str, given: Range) -> tuple[float, ...]:
    """The values of a range, ends included, ascending: in the logarithm where it spans more than two decades.

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


def plan_range(case: Case, key: str, given: Range) -> Plan:
    """The map of a range. Raises MechlabError for a key that names nothing, listing what can be varied."""
    infos = {i.name: i for i in describe(case.design.entry.parameters)}
    values = spaced(key, given)
    duration = min(case.scene.duration, LONGEST)
    if key in infos and infos[key].kind in ("number", "ratio", "integer"):
        info = infos[key]
        in_unit(key, given, info.unit)

        def problem(y: float) -> Problem:
            given_values = {k: v for k, v in case.design.given.items() if k in infos}
            made = make_design(case.design.entry, {**_kept(case), **given_values, key: y})
            scene = made.scene(case.scene.name, case.scene.fidelity, duration)
            open_ended = without_ranges(made.mechanism(scene.fidelity))
            return Problem(with_mechanism(made, open_ended), scene, OUTPUTS)

        nominal = getattr(case.design.parameters, key)
        axis = Axis(key, info.unit, values, info.text, None if nominal is None else float(nominal))
    else:
        parts = _parts(case, duration)
        if key not in parts:
            raise unknown(
                f"{case.design.name}: quantity to vary",
                key,
                [*(n for n, i in infos.items() if i.kind in ("number", "ratio", "integer")), *parts],
            )
        start, unit, text, scaled = parts[key]
        in_unit(key, given, *unit.split(" or "))
        axis = Axis(key, unit, values, text, start)

        def problem(y: float) -> Problem:
            return scaled(y / start)

    return Plan(key, f"timestep and {key}", axis, problem, usual_methods(case), steps_of(duration))


def _kept(case: Case) -> dict[str, object]:
    """The parameters as the scene has them."""
    return {i.name: getattr(case.design.parameters, i.name) for i in describe(case.design.entry.parameters)}


Part = tuple[float, str, str, Callable[[float], Problem]]


def _parts(case: Case, duration: float) -> dict[str, Part]:
    """BODY_mass, X_stiffness, friction: what it is now, its unit, in words, and the problem with it times a factor."""
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
