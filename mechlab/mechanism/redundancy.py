"""Rows of a Jacobian that repeat others, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

TERMS = 3
"""Largest number of rows that a sentence on redundancy names."""


@dataclass(frozen=True)
class Redundancy:
    """A constraint row that repeats others: row = sum of coefficient x other row (empty: the row is void)."""

    row: str
    combination: tuple[tuple[str, float], ...]

    @property
    def sentence(self) -> str:
        """The statement in words."""
        if not self.combination:
            return f"{self.row} is void: no motion can violate it"
        if len(self.combination) <= TERMS:
            return f"{self.row} = {' '.join(f'{c:+.6g} {n}' for n, c in self.combination)}"
        largest = sorted(self.combination, key=lambda term: -float(f"{abs(term[1]):.6g}"))[:TERMS]  # ties in order of the rows
        rest = len(self.combination) - TERMS
        return f"{self.row} repeats what {', '.join(n for n, _ in largest)} and {rest} more row{'s' * (rest > 1)} say together"


def repetitions(jacobian: Array, independent: Sequence[int], names: Sequence[str]) -> tuple[Redundancy, ...]:
    """The rows of a Jacobian that are not independent, each as the combination of earlier independent ones.

    With J_i^T = Q R of the independent rows, row = c J_i gives R c^T = Q^T row^T.
    """
    others = np.flatnonzero(~np.isin(np.arange(len(jacobian)), independent))
    if not len(independent) or not np.any(jacobian[others]):
        return tuple(Redundancy(names[i], ()) for i in others.tolist())
    q, r = np.linalg.qr(jacobian[list(independent)].T)
    earlier = np.array(independent) < others[:, None]
    shares = np.linalg.solve(r, (jacobian[others] @ q * earlier).T).T  # its LU of a triangle is the triangle; saves importing scipy
    out = []
    for i, row in zip(others.tolist(), np.where(np.abs(shares) > 1e-9, shares, 0.0), strict=True):
        out.append(Redundancy(names[i], tuple((names[independent[k]], float(row[k])) for k in np.flatnonzero(row).tolist())))
    return tuple(out)
