"""Constrained dynamics as linear algebra: M a + h = tau + J^T r, J a + b = 0, with redundant rows.

    D r = -b - J M^-1 (tau - h),   D = J M^-1 J^T

Full rank is the fast path: two Cholesky factors. Rows that repeat others make D singular: then the reactions are
those of the smallest norm among all that are possible (Udwadia & Kalaba 1992), and the accelerations are unique
anyhow. In the middle of a step the loops are a little open, and rows that repeat each other where they are closed do so nearly
only: whoever knows their rank says it, so that the small difference is not divided by.
"""

from __future__ import annotations

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.small_systems import lapack

PIVOT = 1e-5
SMALL = 0.03
"""Rows that repeat others may be small, and point anywhere where loops are a little open: smaller ones than this, relative to the largest,
are not scaled up to it."""
RANK = 1e-10


@dataclass(frozen=True)
class Factors:
    """Factors of one state: solve as often as needed with `accelerations` and `correction`.

    root (nv, nv) L^-1 of M = L L^T (explicit: at these sizes many times faster than solving); y = L^-1 J^T; small: the
    Cholesky factor of D, with 1 for `void` rows, which are zero; `rank` of the constraint rows; pseudo (rows, rows): inverse of D
    where the fast path was not possible; null (rows, k): combinations of reactions that do nothing.
    """

    root: Array
    y: Array
    void: Array | None
    small: Array | None
    pseudo: Array | None
    null: Array | None
    rank: int

    def reactions(self, right: Array) -> Array:
        """(rows,) r of D r = right, the smallest one when rows are redundant."""
        if not len(right):
            return np.zeros(0)
        if self.small is not None:
            if self.void is not None:
                right = np.where(self.void, 0.0, right)
            out: Array = lapack().dpotrs(self.small, right, lower=1)[0]
            return out
        assert self.pseudo is not None and self.null is not None
        out = self.pseudo @ right
        return np.asarray(out - self.null @ (self.null.T @ out))

    def accelerations(self, force: Array, bias: Array) -> tuple[Array, Array]:
        """(nv,) accelerations and (rows,) reactions from force = tau - h (nv,) and bias b (rows,)."""
        half = self.root.dot(force)
        r = self.reactions(-bias - self.y.T.dot(half))
        return self.root.T.dot(half + self.y.dot(r)), r

    def correction(self, residual: Array) -> Array:
        """(nv,) smallest change dv, measured by the kinetic energy, with J dv = -residual."""
        return np.asarray(self.root.T @ (self.y @ self.reactions(-residual)))


def factor(mass: Array, jacobian: Array, most: int | None = None) -> Factors | None:
    """Factors of M (nv, nv), J (rows, nv); None when M itself is singular (then use `dense`). most: the rank of J where the loops are
    closed, if rows repeat others there; more combinations of rows are not believed."""
    chol, info = lapack().dpotrf(mass, lower=1, clean=1)
    pivots = chol.diagonal().tolist()
    if info != 0 or not min(pivots) > 1e-9 * max(pivots):
        return None
    root = lapack().dtrtri(chol, lower=1)[0]
    rows = len(jacobian)
    if not rows:
        return Factors(root, np.zeros((len(mass), 0)), None, None, None, None, 0)
    y = root.dot(jacobian.T)
    delassus = y.T.dot(y)
    size = np.sqrt(delassus.diagonal())
    sizes = size.tolist()
    least = 1e-12 * max(sizes)
    void = size <= least if min(sizes) <= least else None
    if void is not None:
        delassus[void], delassus[:, void] = 0.0, 0.0
    if most is None:
        if void is not None:
            delassus[void, void] = 1.0
        small, info = lapack().dpotrf(delassus, lower=1)
        # the pivots of rows of size 1
        if info == 0 and all(p > PIVOT * s for p, s in zip(small.diagonal().tolist(), sizes, strict=True)):
            return Factors(root, y, void, small, None, None, rows if void is None else rows - int(void.sum()))
    scale = size if most is None else np.maximum(size, SMALL * size.max())
    if void is not None:
        scale, delassus[void, void] = np.where(void, 1.0, scale), 0.0
    scaled = delassus / (scale[:, None] * scale)
    values, vectors = np.linalg.eigh(scaled)
    keep = values > RANK * max(values[-1], 1e-300)
    if most is not None:
        keep[: max(0, rows - most)] = False
    pseudo = (vectors[:, keep] / values[keep]) @ vectors[:, keep].T / np.outer(scale, scale)
    null = np.linalg.qr(vectors[:, ~keep] / scale[:, None])[0]
    return Factors(root, y, void, None, pseudo, null, int(np.count_nonzero(keep)))


def dense(mass: Array, jacobian: Array, force: Array, bias: Array) -> tuple[Array, Array, float]:
    """Accelerations, reactions and the largest violation of J a + b = 0 from the whole KKT matrix by least squares.

    For a mass matrix that is singular by itself (a massless link that only the loops hold); slower by ten times.
    """
    nv, rows = len(mass), len(jacobian)
    matrix = np.zeros((nv + rows, nv + rows))
    matrix[:nv, :nv], matrix[nv:, :nv], matrix[:nv, nv:] = mass, jacobian, -jacobian.T
    solution = np.linalg.lstsq(matrix, np.concatenate([force, -bias]), rcond=1e-13)[0]
    a, r = solution[:nv], solution[nv:]
    gap = float(np.max(np.abs(matrix @ solution - np.concatenate([force, -bias])), initial=0.0))
    return a, r, gap
