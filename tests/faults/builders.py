"""Errors of a builder: one thing of the Mechanism it returns is wrong. Each takes the Mechanism and a generator, and gives
words and a function Mechanism -> Mechanism that works by name, or None where the mechanism has no such thing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from mechlab.mechanism import Inertia, Mechanism, Placement
from mechlab.mechanism.geometry import Array, axis_rotation

Alter = Callable[[Mechanism], Mechanism]
Made = tuple[str, Alter] | None
Rng = np.random.Generator


def one(rng: Rng, items: Any) -> Any:
    """One of the items, or None where there are none."""
    items = list(items)
    return items[int(rng.integers(len(items)))] if items else None


def swap(m: Mechanism, field: str, name: str, change: Callable[[Any], Any]) -> Mechanism:
    """The mechanism with the item of that name in a field changed, or dropped where the change is None."""
    changed = [(change(x) if x.name == name else x) for x in getattr(m, field)]
    changes: dict[str, Any] = {field: tuple(x for x in changed if x is not None)}
    return replace(m, **changes)


def part(
    field: str, rng: Rng, m: Mechanism, words: str, change: Callable[[Any], Any], has: Callable[[Any], bool]
) -> Made:
    """A change of one item of a field that has what is to be changed."""
    found = one(rng, [x for x in getattr(m, field) if has(x)])
    if found is None:
        return None
    return f"{words} of {found.name}", lambda other: swap(other, field, found.name, change)


def joint(rng: Rng, m: Mechanism, words: str, change: Callable[[Any], Any], has: Callable[[Any], bool]) -> Made:
    """A change of one joint."""
    found = one(rng, [j for j in m.joints if has(j)])
    if found is None:
        return None

    def alter(other: Mechanism) -> Mechanism:
        bodies = tuple(
            replace(b, joints=tuple(change(j) if j.name == found.name else j for j in b.joints)) for b in other.bodies
        )
        return replace(other, bodies=bodies)

    return f"{words} of joint {found.name}", alter


def moved(p: Placement, at: Array | None = None, turn: Array | None = None) -> Placement:
    """The placement with another position or rotation."""
    return Placement.of(p.rotation if turn is None else turn, p.translation if at is None else at)


def _flip(p: Placement, k: int) -> Placement:
    at = p.translation.copy()
    at[k] = -at[k]
    return moved(p, at)


def _placed(x: Any) -> bool:
    return bool(np.any(np.abs(x.placement.translation) > 1e-9))


def _turned(x: Any) -> bool:
    return bool(np.max(np.abs(x.placement.rotation - x.placement.rotation.T)) > 1e-9)


def _inertia(x: Inertia, **changes: Any) -> Inertia:
    return replace(x, **changes)


def _heavy(b: Any) -> bool:
    return bool(b.inertia.mass > 0.0)


def _tensor(factors: tuple[float, ...]) -> Callable[[Any], Any]:
    def change(b: Any) -> Any:
        t = tuple(float(x * f) for x, f in zip(b.inertia.tensor, factors, strict=True))
        return replace(b, inertia=_inertia(b.inertia, tensor=t))

    return change


def _permuted(b: Any) -> Any:
    xx, yy, zz, xy, xz, yz = b.inertia.tensor
    return replace(b, inertia=_inertia(b.inertia, tensor=(zz, xx, yy, xz, yz, xy)))


def _terms(coefficients: Any, name: str, change: Callable[[Fraction], Fraction]) -> Any:
    return tuple((n, change(Fraction(c)) if n == name else c) for n, c in coefficients)


def _coefficient(field: str, words: str, change: Callable[[Fraction], Fraction]) -> Callable[[Rng, Mechanism], Made]:
    def make(rng: Rng, m: Mechanism) -> Made:
        found = one(rng, getattr(m, field))
        if found is None:
            return None
        at = str(one(rng, [n for n, _ in found.coefficients]))

        def alter(other: Mechanism) -> Mechanism:
            return swap(other, field, found.name, lambda x: replace(x, coefficients=_terms(x.coefficients, at, change)))

        return f"{words} of {at} in {found.name}", alter

    return make


def _axis(rng: Rng, m: Mechanism) -> Made:
    return joint(
        rng, m, "axis flipped", lambda j: replace(j, axis=tuple(-x for x in j.axis)), lambda j: j.kind != "spherical"
    )


def _axis_swapped(rng: Rng, m: Mechanism) -> Made:
    return joint(
        rng,
        m,
        "axis components permuted",
        lambda j: replace(j, axis=(j.axis[1], j.axis[2], j.axis[0])),
        lambda j: j.kind != "spherical",
    )


def _zero(words: str, factor: float) -> Callable[[Rng, Mechanism], Made]:
    return lambda rng, m: joint(rng, m, words, lambda j: replace(j, zero=factor * j.zero), lambda j: abs(j.zero) > 1e-9)


def _times(field: str, key: str, factor: float, words: str) -> Callable[[Rng, Mechanism], Made]:
    def make(rng: Rng, m: Mechanism) -> Made:
        def change(x: Any) -> Any:
            return replace(x, **{key: factor * getattr(x, key)})

        if field == "joints":
            return joint(rng, m, words, change, lambda x: bool(getattr(x, key)))
        return part(field, rng, m, words, change, lambda x: bool(getattr(x, key)))

    return make


def _gravity(words: str, factor: float) -> Callable[[Rng, Mechanism], Made]:
    def make(rng: Rng, m: Mechanism) -> Made:
        if not any(m.gravity):
            return None
        return words, lambda other: replace(other, gravity=tuple(factor * g for g in other.gravity))

    return make


def _loop(words: str, change: Callable[[Any], Any]) -> Callable[[Rng, Mechanism], Made]:
    return lambda rng, m: part("loops", rng, m, words, change, lambda x: True)


def _drop(field: str) -> Callable[[Rng, Mechanism], Made]:
    return lambda rng, m: part(field, rng, m, f"row dropped ({field})", lambda x: None, lambda x: True)


def _body(words: str, change: Callable[[Any], Any], has: Callable[[Any], bool]) -> Callable[[Rng, Mechanism], Made]:
    return lambda rng, m: part("bodies", rng, m, words, change, has)


def _frame(words: str, change: Callable[[Any], Any], has: Callable[[Any], bool]) -> Callable[[Rng, Mechanism], Made]:
    return lambda rng, m: part("frames", rng, m, words, change, has)


TURN = axis_rotation([0.6, 0.0, 0.8], np.radians(1.0))
SHIFT = np.array([1.0, 0.3, 0.5]) * 1e-3
FAULTS: dict[str, tuple[Callable[[Rng, Mechanism], Made], ...]] = {
    "sign": (
        _axis,
        _zero("zero with the other sign", -1.0),
        _gravity("gravity upwards", -1.0),
        _coefficient("relations", "sign of the coefficient", lambda c: -c),
        _coefficient("shafts", "sign of the coefficient", lambda c: -c),
        _body(
            "centre of mass on the other side",
            lambda b: replace(b, inertia=_inertia(b.inertia, com=tuple(-x for x in b.inertia.com))),
            lambda b: _heavy(b) and any(abs(x) > 1e-9 for x in b.inertia.com),
        ),
        _body(
            "placement on the other side",
            lambda b: replace(b, placement=moved(b.placement, -b.placement.translation)),
            _placed,
        ),
    ),
    "frame": (
        _body(
            "placement turned backwards",
            lambda b: replace(b, placement=moved(b.placement, turn=b.placement.rotation.T)),
            _turned,
        ),
        _body(
            "placement turned by 1 degree",
            lambda b: replace(b, placement=moved(b.placement, turn=b.placement.rotation @ TURN)),
            lambda b: True,
        ),
        _loop("ends exchanged", lambda x: replace(x, placement_a=x.placement_b, placement_b=x.placement_a)),
        _loop(
            "end a millimetre off",
            lambda x: replace(x, placement_b=moved(x.placement_b, x.placement_b.translation + SHIFT)),
        ),
        _frame(
            "point a millimetre off",
            lambda x: replace(x, placement=moved(x.placement, x.placement.translation + SHIFT)),
            lambda x: True,
        ),
        _frame(
            "point on the other side",
            lambda x: replace(x, placement=moved(x.placement, -x.placement.translation)),
            _placed,
        ),
        _axis_swapped,
    ),
    "tooth": (
        _coefficient("relations", "one tooth more", lambda c: Fraction(c.numerator + 1, c.denominator)),
        _coefficient("relations", "ratio upside down", lambda c: 1 / c),
        _coefficient("shafts", "ratio upside down", lambda c: 1 / c),
        _coefficient("shafts", "one tooth more", lambda c: Fraction(c.numerator + 1, c.denominator)),
    ),
    "inertia": (
        _body("mass 10 % more", lambda b: replace(b, inertia=_inertia(b.inertia, mass=1.1 * b.inertia.mass)), _heavy),
        _body("tensor doubled", _tensor((2.0,) * 6), lambda b: any(b.inertia.tensor)),
        _body(
            "products of inertia with the other sign",
            _tensor((1, 1, 1, -1, -1, -1)),
            lambda b: any(abs(x) > 1e-12 for x in b.inertia.tensor[3:]),
        ),
        _body("principal inertias permuted", _permuted, lambda b: any(b.inertia.tensor)),
        _body(
            "centre of mass at the origin",
            lambda b: replace(b, inertia=_inertia(b.inertia, com=(0.0, 0.0, 0.0))),
            lambda b: _heavy(b) and any(abs(x) > 1e-9 for x in b.inertia.com),
        ),
        _times("shafts", "inertia", 1.1, "inertia 10 % more"),
        _times("joints", "armature", 2.0, "armature doubled"),
    ),
    "row": (_drop("loops"), _drop("relations"), _drop("springs")),
    "unit": (
        _zero("zero in degrees", 180.0 / np.pi),
        _gravity("gravity in cm/s^2", 100.0),
        _body(
            "placement in mm",
            lambda b: replace(b, placement=moved(b.placement, 1e3 * b.placement.translation)),
            _placed,
        ),
        _frame(
            "point in mm", lambda x: replace(x, placement=moved(x.placement, 1e3 * x.placement.translation)), _placed
        ),
        _body("mass in g", lambda b: replace(b, inertia=_inertia(b.inertia, mass=1e3 * b.inertia.mass)), _heavy),
        _times("springs", "stiffness", 10.0, "stiffness x 10"),
        _times("springs", "damping", 10.0, "damping x 10"),
        _times("springs", "rest_length", 1.1, "rest length 10 % more"),
        _times("joints", "stiffness", 10.0, "stiffness x 10"),
        _times("joints", "damping", 10.0, "damping x 10"),
    ),
}
"""Kind -> makers."""


def differ(a: dict[str, Array], b: dict[str, Array], tolerance: float = 1e-7) -> bool:
    """Whether two sets of marks are of different mathematical objects."""
    for key, x in a.items():
        y = b[key]
        if x.shape != y.shape:
            return True
        scale = max(1e-12, float(np.max(np.abs(x), initial=0.0)))
        if not np.max(np.abs(x - y), initial=0.0) <= tolerance * scale:
            return True
    return False
