"""Small linear systems: LAPACK's own functions for one, and many at once with positive definite matrices.

A library call for each matrix costs more than the arithmetic of a small one: up to SMALL unknowns the elimination runs over all
systems together, the system as the last index. Symmetric positive definite matrices need no pivots.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType

import numpy as np

from mechlab.mechanism.geometry import Array

SMALL = 5
"""Most unknowns of systems that are eliminated together."""
TOGETHER = 512
"""Systems that are eliminated together at most: their numbers stay in the processor's cache."""


@cache
def lapack() -> ModuleType:
    """LAPACK's own functions, loaded when the first matrix is factored: scipy takes .1 s to load, and poses need none."""
    import scipy.linalg.lapack

    return scipy.linalg.lapack


def solve_positive(a: Array, b: Array) -> Array:
    """(P, n, k) x of a x = b, a (P, n, n) symmetric positive definite, b (P, n, k). Numbers that are not finite, or LinAlgError, where
    a matrix is singular."""
    count, n, k = b.shape
    if n > SMALL:
        return np.asarray(np.linalg.solve(a, b))
    out = np.empty_like(b)
    with np.errstate(all="ignore"):
        for start in range(0, count, TOGETHER):
            s = slice(start, start + TOGETHER)
            out[s] = _eliminated(a[s], b[s], n, k)
    return out


def _eliminated(a: Array, b: Array, n: int, k: int) -> Array:
    both = np.empty((n, n + k, len(a)))
    both[:, :n], both[:, n:] = a.transpose(1, 2, 0), b.transpose(1, 2, 0)
    for i in range(n):
        both[i, i + 1 :] /= both[i, i]
        # of the rows below only what stands on and right of the diagonal is read again
        if i + 1 < n:
            both[i + 1 :, i + 1 :] -= both[i + 1 :, i, None] * both[i, i + 1 :]
    x = both[:, n:]
    for i in range(n - 2, -1, -1):
        x[i] -= (both[i, i + 1 : n, None] * x[i + 1 :]).sum(axis=0)
    return x.transpose(2, 0, 1)
