"""The smallest solution of linear equations that may repeat each other: dense for small ones, sparse for large mechanisms."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.geometry import Array

LARGE = 300
"""Rows and columns from which the sparse solution is faster; below it numbers do not change by a bit."""
DAMPING = 1e-12
"""Damping of the multipliers, which repeated rows leave open; iterations take its effect out again."""
CLOSED = 1e-7
"""Relative change of the sparse solution in its last iteration; the dense solution is taken where it does not come down to that."""
ITERATIONS = 12


def least_norm(matrix: Array, wanted: Array) -> Array:
    """(n,) the smallest x that solves matrix (m, n) x = wanted (m,) in the sense of least squares.

    Where m and n are `LARGE`, x = A^T y from [[1, A^T], [A, -d]] [x, -y] = [0, wanted] with rows A of unit length, factorized sparsely
    and iterated (a proximal point method in y) until x stands still; equations that are nearly singular are solved densely, by
    singular values. What contradicts each other in the equations moves y alone.
    """
    if min(matrix.shape) >= LARGE and (found := _sparse(matrix, wanted)) is not None:
        return found
    return np.asarray(np.linalg.lstsq(matrix, wanted, rcond=1e-11)[0], dtype=np.float64)


def _sparse(matrix: Array, wanted: Array) -> Array | None:
    from scipy.sparse import bmat, csc_array, eye_array
    from scipy.sparse.linalg import splu

    norms = np.linalg.norm(matrix, axis=1)
    kept = norms > 1e-14 * max(1.0, float(np.max(norms)))
    rows = csc_array(matrix[kept] / norms[kept, None])
    right = wanted[kept] / norms[kept]
    m, n = rows.shape
    try:
        factors = splu(csc_array(bmat([[eye_array(n), rows.T], [rows, -DAMPING * eye_array(m)]])))
    except RuntimeError:  # exactly singular in floating point
        return None
    x, y = np.zeros(n), np.zeros(m)
    for _ in range(ITERATIONS):
        step = factors.solve(np.concatenate([-x - rows.T @ y, right - rows @ x]))
        x, y = x + step[:n], y + step[n:]
        if np.max(np.abs(step[:n])) <= CLOSED * np.max(np.abs(x)):
            return np.asarray(x)
    return None
