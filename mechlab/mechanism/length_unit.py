"""A mechanism in another unit of length, and which of its values are lengths.

Positions are solved in the unit `Mechanism.length_scale`, in which the mechanism has a size of order 1, so that one set
of tolerances fits a mechanism of a micrometre and one of a million kilometres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import numpy as np

from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array, Placement, Vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Body, Coefficients, Joint


def is_length(m: Mechanism, name: str) -> bool:
    """True for a slide, a shaft over slides alone, and a coordinate FRAME_x, _y, _z: values in metres."""
    for shaft in m.shafts:
        if shaft.name == name:
            return {n for n, _ in shaft.coefficients} <= m.slides
    return name in m.slides or (
        name not in m.scalar_names and any(name == f"{f.name}_{a}" for f in m.frames for a in "xyz")
    )


def row_units(m: Mechanism, constraints: ConstraintSet) -> Array:
    """(rows,) the unit of each residual: `length_scale` for the offsets of loops and curves of slides, 1 for angles and relations."""
    out = np.ones(len(constraints))
    loops = {x.name for x in m.loops}
    for item in constraints.items:
        rows = constraints.slices[item.name]
        if item.name in loops:
            out[rows] = [1.0 if "_" in r.removeprefix(item.name) else m.length_scale for r in constraints.rows[rows]]
    for curve in m.curves:
        if curve.output in m.slides:
            out[constraints.slices[curve.name]] = m.length_scale
    return out


def coordinate_units(m: Mechanism, unit: float) -> Array:
    """(nq,) `unit` for slides, 1 for angles and quaternions."""
    return np.array([unit if j.kind == "prismatic" else 1.0 for j in m.joints for _ in range(j.nq)])


@lru_cache(maxsize=16)
def in_unit_of_length(m: Mechanism, unit: float) -> Mechanism:
    """The same mechanism with all lengths in `unit` [m], without shapes; masses stay, moments of inertia follow. For
    questions of position and motion: forces, stiffnesses and gravity are left as they are."""

    def short(x: Vector) -> Vector:
        return (x[0] / unit, x[1] / unit, x[2] / unit)

    def place(p: Placement) -> Placement:
        return replace(p, position=short(p.position))

    def terms(given: Coefficients) -> Coefficients:
        if {n for n, _ in given} <= m.slides:
            return given
        return tuple((n, c * Fraction(unit) if n in m.slides else c) for n, c in given)

    return replace(
        m,
        bodies=tuple(_body(b, unit, place, short) for b in m.bodies),
        loops=tuple(
            replace(x, placement_a=place(x.placement_a), placement_b=place(x.placement_b), length=x.length / unit)
            for x in m.loops
        ),
        relations=tuple(replace(r, coefficients=terms(r.coefficients)) for r in m.relations),
        curves=tuple(x.in_unit_of_length(m.slides, unit) for x in m.curves),
        shafts=tuple(
            replace(s, coefficients=terms(s.coefficients), placement=place(s.placement), shapes=(),
                    zero=s.zero / unit if is_length(m, s.name) else s.zero, range=None)
            for s in m.shafts
        ),
        springs=tuple(
            replace(s, point_a=short(s.point_a), point_b=short(s.point_b), rest_length=s.rest_length / unit, range=None)
            for s in m.springs
        ),
        frames=tuple(replace(f, placement=place(f.placement)) for f in m.frames),
        ground_shapes=(),
    )  # fmt: skip


def _body(b: Body, unit: float, place: Callable[[Placement], Placement], short: Callable[[Vector], Vector]) -> Body:
    inertia = b.inertia
    if inertia.mass:
        t = tuple(x / unit**2 for x in inertia.tensor)
        inertia = Inertia(inertia.mass, short(inertia.com), (t[0], t[1], t[2], t[3], t[4], t[5]))
    return replace(
        b, placement=place(b.placement), joints=tuple(_joint(j, unit) for j in b.joints), inertia=inertia, shapes=()
    )


def _joint(j: Joint, unit: float) -> Joint:
    if j.kind != "prismatic":
        return j
    limits = None if j.range is None else (j.range[0] / unit, j.range[1] / unit)
    return replace(j, zero=j.zero / unit, range=limits, spring_rest=j.spring_rest / unit)
