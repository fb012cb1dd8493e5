"""One step: least squares with priorities under bounds, solved level by level in what the levels before leave.

For levels (A_k, b_k), k = 0, 1, ..., over z (f,), with rows C and bounds:

    level k:   min |A_k z - b_k|^2 + mu_k |z - z_k-1|^2    subject to   A_j z = A_j z_j (j < k),   lower <= C z <= upper

(Kanoun, Lamiraux, Wieber 2011; Escande, Mansard, Wieber 2014). The equalities are eliminated: z = z_k-1 + Z w, Z a basis of
the common null space of the levels before. Where no bound is met, the answer is that of the singular value decomposition;
elsewhere that of DAQP, a dual active-set method (Arnström, Bemporad, Axehill 2022), exact to rounding.

mu_k = |A_k z - b_k| of the undamped answer: what a level cannot meet turns with the pose, and this is how much it can (the
second derivative that least squares leave out, for levers of the size of the mechanism). It is 0 where a level is met.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.errors import EngineMissing
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

RANK = 1e-9
"""Singular values below this count as 0; rows and unknowns are of order 1."""
MET = 1e-9
"""A level is met when this or less of its right side is left over."""
TOUCH = 1e-12
"""Bounds hold to this; the smallest that rounding leaves meaning."""


@dataclass(frozen=True)
class QpStep:
    """z (f,), multipliers of the bounds (rows,), positive at the upper one, of the level that meets each first, and the
    number of directions that the levels leave free."""

    z: Array
    multipliers: Array
    free: int


def lexicographic(
    levels: Sequence[tuple[Array, Array]], rows: Array, lower: Array, upper: Array, careful: bool = False
) -> QpStep:
    """The step for levels (A (k, f), b (k,)) in the order of their priority, rows (c, f) with bounds (c,).

    careful: mu_k = |b_k|, for a pose where less is gained than the rows promise (Levenberg, Marquardt).
    Bounds that contradict each other here are widened until z = 0 is allowed.
    """
    f = rows.shape[1]
    z, basis, multipliers = np.zeros(f), np.eye(f), np.zeros(len(rows))
    for a, b in levels:
        if not basis.shape[1]:
            break
        left, values, right = np.linalg.svd(a @ basis)
        rank = int(np.sum(values > RANK * max(1.0, values[0] if len(values) else 0.0)))
        side, bounded = b - a @ z, rows @ basis
        low, high = lower - rows @ z, upper - rows @ z
        parts = left[:, :rank], values[:rank], right[:rank]
        w, dual = _level(a @ basis, side, parts, bounded, low, high, careful)
        z = z + basis @ w
        multipliers = np.where(multipliers == 0.0, dual, multipliers)
        basis = basis @ right[rank:].T
    return QpStep(z, multipliers, basis.shape[1])


def _level(
    a: Array, b: Array, parts: tuple[Array, Array, Array], rows: Array, low: Array, high: Array, careful: bool
) -> tuple[Array, Array]:
    """w and multipliers of one level; parts: the singular value decomposition of a at its rank."""
    if careful:
        return _damped(a, b, parts, rows, low, high, float(np.linalg.norm(b)))
    w, dual = _damped(a, b, parts, rows, low, high, 0.0)
    unmet = float(np.linalg.norm(b - a @ w))
    return (w, dual) if unmet <= MET else _damped(a, b, parts, rows, low, high, unmet)


def _damped(
    a: Array, b: Array, parts: tuple[Array, Array, Array], rows: Array, low: Array, high: Array, damping: float
) -> tuple[Array, Array]:
    left, values, right = parts
    w = right.T @ (values / (values**2 + damping) * (left.T @ b))
    there = rows @ w
    if np.all(there >= low - TOUCH) and np.all(there <= high + TOUCH):
        return w, np.zeros(len(rows))
    return _bounded(a, b, rows, low, high, damping)


def _bounded(a: Array, b: Array, rows: Array, low: Array, high: Array, damping: float) -> tuple[Array, Array]:
    try:
        import daqp
    except ModuleNotFoundError:
        raise EngineMissing(
            "daqp, which solves for motions at their limits, is not installed; pip install daqp."
        ) from None
    # a small share of the identity makes the answer one; what it takes from a step the next step gives back
    square = a.T @ a + max(damping, 1e-10) * np.eye(a.shape[1])
    side, sense = -(a.T @ b), np.zeros(len(rows), dtype=np.intc)
    for lower, upper in ((low, high), (np.minimum(low, 0.0), np.maximum(high, 0.0))):
        x, _, flag, info = daqp.solve(square, side, np.ascontiguousarray(rows), upper, lower, sense, primal_tol=TOUCH)
        if flag > 0:
            return np.asarray(x), np.asarray(info["lam"])
    return np.zeros(a.shape[1]), np.zeros(len(rows))
