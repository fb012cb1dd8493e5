"""What the data determine: singular values of the scaled Jacobian, and the combinations of unknowns along which nothing changes."""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd
from typing import Any

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.fit.solve import RANK
from mechlab.studies.fit.unknowns import FitUnknown

WEAK = 1.0
"""Standard error along a direction, in units of the scales of the unknowns, from which the data do not fix it."""
PART = 0.03
"""Shares of a direction below this are left out of its name."""
MOST = 4
"""Largest power in a product that is named."""
NEAR = 0.03
"""Largest distance of a ratio of shares from a simple fraction."""


@dataclass(frozen=True)
class Identifiability:
    """singular: (p,) values of the scaled Jacobian, largest first; free: (k, p) directions of unknowns over their scales that the data
    do not fix; sentences: one each; open: the unknowns that are not fixed; covariance (p, p) of the unknowns over their scales on the
    fixed directions, in units of the noise."""

    singular: Array
    free: Array
    sentences: tuple[str, ...]
    open: tuple[str, ...]
    covariance: Array

    @property
    def condition(self) -> float:
        """Largest over smallest singular value."""
        least = float(self.singular[-1])
        return float(self.singular[0]) / least if least > 0.0 else float("inf")

    @property
    def all_fixed(self) -> bool:
        """Whether the data fix every unknown."""
        return not len(self.free)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "identifiable": self.all_fixed, "singular_values": self.singular.tolist(), "condition": self.condition,
            "not_determined": list(self.open), "sentences": list(self.sentences),
        }  # fmt: skip


def identifiability(jacobian: Array, unknowns: Sequence[FitUnknown], factor: float) -> Identifiability:
    """The directions that a Jacobian (n, p) in units of the noise fixes. factor: variance of the residuals in units of the noise."""
    _, s, v = np.linalg.svd(jacobian, full_matrices=False)
    largest = s[0] if s[0] > 0.0 else 1.0
    error = np.sqrt(factor) / np.where(s > 0.0, s, np.finfo(float).tiny)
    empty = s <= RANK * largest
    weak = ~empty & (error > WEAK)
    fixed = ~(empty | weak)
    covariance = (v[fixed].T / s[fixed] ** 2) @ v[fixed]
    simple = _simple(v[empty])
    sentences = [_sentence(row, unknowns) for row in simple]
    sentences += [_weakly(row, unknowns, float(e)) for row, e in zip(v[weak], error[weak], strict=True)]
    free = np.vstack([simple, v[weak]])
    moved = [u.name for k, u in enumerate(unknowns) if len(free) and np.max(np.abs(free[:, k])) > PART]
    return Identifiability(s, free, tuple(sentences), tuple(moved), covariance)


def _simple(rows: Array) -> Array:
    """The same directions with as many zeros as elimination with column pivots makes."""
    rows = rows.copy()
    for k in range(len(rows)):
        rest = np.abs(rows[k:])
        i, j = divmod(int(np.argmax(rest)), rest.shape[1])
        rows[[k, k + i]] = rows[[k + i, k]]
        rows[k] /= rows[k, j]
        for other in range(len(rows)):
            if other != k:
                rows[other] -= rows[other, j] * rows[k]
    return np.array([row / np.linalg.norm(row) for row in rows]).reshape(rows.shape)


def _parts(row: Array, unknowns: Sequence[FitUnknown]) -> list[tuple[FitUnknown, float]]:
    largest = float(np.max(np.abs(row)))
    found = [(u, float(x)) for u, x in zip(unknowns, row, strict=True) if abs(x) > PART * largest]
    sign = 1.0 if found[0][1] > 0.0 else -1.0
    return [(u, sign * x) for u, x in found]


def _sentence(row: Array, unknowns: Sequence[FitUnknown]) -> str:
    """Which combination alone the data fix, where all else moves along the direction."""
    parts = _parts(row, unknowns)
    names = [u.name for u, _ in parts]
    if len(parts) == 1:
        return f"the data do not depend on {names[0]}"
    relative = all(u.relative and u.scale == abs(u.start) for u, _ in parts)
    if relative and len(parts) == 2:
        if (powers := _powers(parts[0][1], parts[1][1])) is not None:
            return f"the data fix {_and(names)} only by their {powers_text(names, powers)}"
    first = parts[0][1]
    if len(parts) > 2 and relative and all(abs(x - first) <= NEAR * abs(first) for _, x in parts):
        return f"the data fix {_and(names)} only by their ratios"
    if len(parts) == 2 and not relative and abs(abs(parts[1][1]) - abs(first)) <= NEAR * abs(first) and _same_scale(parts):
        return f"the data fix {_and(names)} only by their {'sum' if parts[1][1] < 0.0 else 'difference'}"
    moved = ", ".join(f"{u.name} by {x * u.scale:+.3g} {u.unit}".rstrip() for u, x in parts)
    return f"the data do not change when these change together: {moved}"


def powers_text(names: Sequence[str], powers: tuple[int, int]) -> str:
    """ "product a b", "ratio a / b", "product a^2 b"."""
    a, b = (n if abs(p) == 1 else f"{n}^{abs(p)}" for n, p in zip(names, powers, strict=True))
    return f"product {a} {b}" if powers[1] > 0 else f"ratio {a} / {b}"


def _powers(x: float, y: float) -> tuple[int, int] | None:
    """Whole numbers (m, n) with m x + n y = 0, so that a^m b^n stays as a and b change by x and y relatively."""
    for m in range(1, MOST + 1):
        for n in (*range(1, MOST + 1), *range(-1, -MOST - 1, -1)):
            if gcd(m, abs(n)) == 1 and abs(m * x + n * y) <= NEAR * max(abs(m * x), abs(n * y)):
                return m, n
    return None


def _same_scale(parts: Sequence[tuple[FitUnknown, float]]) -> bool:
    return len({u.scale for u, _ in parts}) == 1 and len({u.unit for u, _ in parts}) == 1


def _weakly(row: Array, unknowns: Sequence[FitUnknown], error: float) -> str:
    parts = _parts(row, unknowns)
    moved = ", ".join(f"{u.name} {x * u.scale * error:+.3g} {u.unit}".rstrip() for u, x in parts)
    return f"the data hardly depend on {_and([u.name for u, _ in parts])}: within a standard error lies {moved}"


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
