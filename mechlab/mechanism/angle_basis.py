"""Dependent angles of a train of gears: the null space of its linear relations, in exact fractions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Coefficients

ZERO = Fraction(0)
Row = tuple[Fraction, ...]


@dataclass(frozen=True)
class AngleBasis:
    """q = K y: every joint as an exact combination of the independent ones. `rows[joint]` is its row of K.

    `joints` are all joints in the order of the coordinates, `independent` the chosen ones (y) in that order too.
    """

    joints: tuple[str, ...]
    independent: tuple[str, ...]
    rows: dict[str, Row]

    @cached_property
    def matrix(self) -> Array:
        """(nv, f) K as floats."""
        return np.array([[float(x) for x in self.rows[n]] for n in self.joints]).reshape(len(self.joints), -1)

    def angles(self, y: ArrayLike) -> Array:
        """(..., nv) coordinates of all joints from those of the independent ones (..., f); also rates and accelerations."""
        return np.asarray(np.asarray(y, dtype=float) @ self.matrix.T)

    def combine(self, coefficients: Coefficients) -> Row:
        """The sum of coefficient x joint, as a row over the independent joints."""
        total = [ZERO] * len(self.independent)
        for name, c in coefficients:
            total = [t + c * x for t, x in zip(total, self.rows[name], strict=True)]
        return tuple(total)


def positive(row: Row) -> Row:
    """The row or its negative, whichever has its first entry other than 0 positive: both carry inertia alike."""
    first = next((x for x in row if x), Fraction(1))
    return row if first > 0 else tuple(-x for x in row)


def dependent_angles(mechanism: Mechanism, independent: Sequence[str] | None = None) -> AngleBasis:
    """The null-space basis of all LinearRelations, by Gauss elimination in fractions.

    `independent`: joints to take as coordinates; default: the last that elimination leaves, in the order of the joints.
    Raises MechlabError for loops, curves or spherical joints (their constraints are not linear), an unknown name, or joints that
    are not independent of each other or too few.
    """
    names = _scalar_joints(mechanism)
    wanted = list(independent or ())
    for name in wanted:
        if name not in names:
            raise unknown(f"{mechanism.name}: joint", name, names)
    order = [n for n in names if n not in wanted] + wanted
    pivots = eliminate(mechanism, order)
    free = [n for n in names if n not in pivots]
    if wanted and set(free) != set(wanted):
        dependent = [n for n in wanted if n in pivots]
        raise MechlabError(
            f"{mechanism.name}: the joints {', '.join(wanted)} are no set of coordinates: "
            + (f"{dependent[0]!r} follows from the others; " if dependent else "")
            + f"the {len(free)} freedoms need {len(free)} independent joints, for example {', '.join(free)}."
        )
    rows: dict[str, Row] = {n: tuple(Fraction(int(n == f)) for f in free) for n in free}
    for name, row in pivots.items():
        rows[name] = tuple(-row.get(f, ZERO) for f in free)
    return AngleBasis(tuple(names), tuple(free), rows)


def eliminate(mechanism: Mechanism, order: Sequence[str]) -> dict[str, dict[str, Fraction]]:
    """Reduced row echelon form of the relations, pivots as early in `order` as they can be: pivot joint -> its row, in
    which the pivot has 1 and all other pivots 0."""
    pivots: dict[str, dict[str, Fraction]] = {}
    for relation in mechanism.relations:
        row = dict(relation.coefficients)
        for pivot, other in pivots.items():
            if pivot in row:
                row = _minus(row, row[pivot], other)
        if not row:
            continue
        pivot = next(n for n in order if n in row)
        row = {n: c / row[pivot] for n, c in row.items()}
        pivots = {p: _minus(r, r[pivot], row) if pivot in r else r for p, r in pivots.items()}
        pivots[pivot] = row
    return _earliest(pivots, order)


def _earliest(pivots: dict[str, dict[str, Fraction]], order: Sequence[str]) -> dict[str, dict[str, Fraction]]:
    """The row space eliminated column by column in `order`, so that pivots do not depend on the order of the
    relations."""
    rows = list(pivots.values())
    out: dict[str, dict[str, Fraction]] = {}
    for name in order:
        found = next((r for r in rows if name in r), None)
        if found is None:
            continue
        rows = [r for r in rows if r is not found]
        found = {n: c / found[name] for n, c in found.items()}
        rows = [_minus(r, r[name], found) if name in r else r for r in rows]
        out = {p: _minus(r, r[name], found) if name in r else r for p, r in out.items()}
        out[name] = found
    return out


def _minus(row: dict[str, Fraction], factor: Fraction, other: dict[str, Fraction]) -> dict[str, Fraction]:
    out = {n: row.get(n, ZERO) - factor * other.get(n, ZERO) for n in {**row, **other}}
    return {n: c for n, c in out.items() if c}


def _scalar_joints(m: Mechanism) -> list[str]:
    if m.loops:
        raise MechlabError(
            f"{m.name}: loop {m.loops[0].name!r} is no linear relation: its angles do not follow by constant ratios. "
            "Reduce the part of the train that has no loops."
        )
    if m.curves:
        raise MechlabError(f"{m.name}: curve {m.curves[0].name!r} is no linear relation: its angles do not follow by constant ratios.")
    for joint in m.joints:
        if joint.kind == "spherical":
            raise MechlabError(f"{m.name}: joint {joint.name!r} is spherical and has no single angle; use revolutes.")
    return [j.name for j in m.joints]
