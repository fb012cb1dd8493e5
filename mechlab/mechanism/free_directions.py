"""What constraint rows leave free, at many states at once: with m independent rows J and unit rows E of the other coordinates the matrix
S = [J; E] is square, and

    S x = [needed; 0],    S N = [0; I]       so that J x = needed, J N = 0

Which rows and unit rows are taken is decided at one state; at those where they do not serve, or where rows that were left out do not
agree, nothing is told.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

RANK, CLEAR = 1e-9, 1e-4
"""Pivots below the first share of the largest are taken for zero; rows of constraints are of size 1 or of a length in m. Those below the
second may come from rows that repeat each other in closed poses and not quite in those at hand."""
AGREE = 1e-10
"""Relative residual up to which rows that were left out agree with those that were taken: rounding is 1e-13."""
CONDITION = 1e8
"""A state whose matrix loses more digits than this is none of those that are served."""


def pivoted(rows: Array) -> tuple[Array, NDArray[np.intp]]:
    """R (m, n) of the QR decomposition of rows (m, n) with pivots, largest first, and the order (n,) of their columns."""
    from scipy.linalg import qr  # takes longer to import than many a run, which does without

    triangle, order = qr(rows, mode="r", pivoting=True)
    return triangle, order


def independent(rows: Array, most: int | None = None) -> tuple[NDArray[np.intp], bool]:
    """Numbers of as many independent rows (m, n) as there are, or of the `most` independent ones, by pivoted QR, and whether their number
    is beyond doubt."""
    if not len(rows):
        return np.zeros(0, dtype=np.intp), True
    triangle, order = pivoted(rows.T)
    size = np.abs(triangle.diagonal()) / max(np.abs(triangle).max(), 1e-300)
    rank = int(np.sum(size > RANK))
    return np.sort(order[: rank if most is None else min(rank, most)]), bool(np.sum(size > CLEAR) == rank)


@dataclass(frozen=True)
class FreeDirections:
    """particular (P, n, k), free (P, n, f): x and N; served (P,): where they hold."""

    particular: Array
    free: Array
    served: NDArray[np.bool_]

    def shortest(self) -> Array:
        """(P, n, k) the solutions of least size: the particular ones without what lies in the free directions."""
        across = np.swapaxes(self.free, 1, 2)
        return self.particular - self.free @ np.linalg.solve(across @ self.free, across @ self.particular)


def free_directions(rows: Array, needed: Array) -> FreeDirections | None:
    """Of rows (P, m, n) with right sides (P, m, k); None where the state in the middle does not tell clearly which, or S is singular."""
    count, _, n = rows.shape
    middle = rows[count // 2] if count else rows.reshape(0, n)
    if not np.isfinite(middle).all():
        return None
    taken, clear = independent(middle)
    if not clear:
        return None
    m, k = len(taken), needed.shape[2]
    order = pivoted(middle[taken])[1] if m else np.arange(n)
    matrix, right = np.zeros((count, n, n)), np.zeros((count, n, k + n - m))
    matrix[:, :m], matrix[:, np.arange(m, n), np.sort(order[m:])] = rows[:, taken], 1.0
    right[:, :m, :k], right[:, m:, k:] = needed[:, taken], np.eye(n - m)
    try:
        solution: Array = np.asarray(np.linalg.solve(matrix, right), dtype=float)
    except np.linalg.LinAlgError:
        return None
    size = np.abs(solution).max(axis=1)
    served = np.abs(matrix).max(axis=(1, 2)) * size.max(axis=1) < CONDITION
    left = np.setdiff1d(np.arange(rows.shape[1]), taken)
    if len(left):
        gap = rows[:, left] @ solution
        gap[..., :k] -= needed[:, left]
        served &= (np.abs(gap).max(axis=1) <= AGREE * (1.0 + size)).all(axis=1)
    return FreeDirections(solution[..., :k], solution[..., k:], served)
