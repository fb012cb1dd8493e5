"""The sign of the assembly mode where rows repeat others: followed from pose to pose.

Without repetitions the sign is that of det [J; T], J the closure's rows and T those of the held joints (`mode_sign`). Where more rows
than needed close a loop, as in Bennett's, which of them are independent changes on the way, and the sign of any fixed choice with it.
The motions N (nv, k) that J leaves free need no choice: det (T N) vanishes where the held joints have a dead point. The sign of N is
free; it is carried on from the pose before, so that det (N_before^T N) > 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import NOTHING

SURE = 1e-7
"""Smallest singular value of the independent rows, of unit length, at which the free motions are known."""
REPEATED = 1e-2
"""Largest share of that value that the rows which repeat them may add: loops in an engine are closed to a gap only."""
NEAR = 0.3
"""Least det (N_before^T N), a cosine, of two poses near enough to carry the sign from one to the other."""
DEAD = 1e-10
"""Size of det (T N), T of unit length, below which its sign is rounding."""


def followed_signs(rows: Array, fixed: Array) -> Array:
    """(..., p) signs of the mode along p poses, rows (..., p, m, nv) of the closure there and `fixed` rows (..., p, k, nv) or (k, nv);
    two of them compare only within one sequence. 0 where the sign cannot tell: the closure has not nv - k independent rows, or the
    fixed ones have a dead point. Where two poses are too far apart, the sign stays."""
    motions, sure = _free_motions(rows, fixed.shape[-2])
    sizes = np.linalg.norm(fixed, axis=-1, keepdims=True)
    size = np.linalg.det(fixed / np.where(sizes > 0.0, sizes, 1.0) @ motions)
    signs = np.where(sure & (np.abs(size) > DEAD), np.sign(size), 0.0)
    count = signs.shape[-1]
    told = np.where(sure, np.arange(count), -1)
    before = np.concatenate([np.full((*told.shape[:-1], 1), -1), np.maximum.accumulate(told, axis=-1)[..., :-1]], axis=-1)
    last = np.take_along_axis(motions, np.maximum(before, 0)[..., None, None], axis=-3)
    along = np.linalg.det(np.swapaxes(last, -1, -2) @ motions)
    turned = np.where(sure & (before >= 0), np.sign(along), 1.0)
    far = sure & (before >= 0) & (np.abs(along) < NEAR)
    if far.any():  # nothing was seen between: the mode counts as kept
        there = np.take_along_axis(signs, np.maximum(before, 0), axis=-1) * signs
        turned = np.where(far, np.where(there < 0.0, -1.0, 1.0), turned)
    return np.asarray(signs * np.cumprod(turned, axis=-1))


def same_sign(before: Array, after: Array, fixed: Array) -> bool:
    """Whether two near poses are in one mode, given all closure rows (m, nv) at both and fixed ones (k, nv); True when it cannot tell."""
    signs = followed_signs(np.stack([before, after]), fixed)
    return bool(signs[0] * signs[1] >= 0.0)


def _free_motions(rows: Array, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """(..., nv, count) orthonormal motions that rows (..., m, nv) leave free, and where there are exactly as many."""
    m, nv = rows.shape[-2:]
    rank = nv - count
    sizes = np.linalg.norm(rows, axis=-1, keepdims=True)
    finite = np.isfinite(sizes[..., 0]).all(axis=-1)
    there = finite[..., None, None] & (sizes > NOTHING)  # what is smaller is rounding
    unit = np.where(there, rows / np.where(there, sizes, 1.0), 0.0)
    if rank < 0 or m < rank:
        return np.zeros((*rows.shape[:-2], nv, count)), np.zeros(rows.shape[:-2], dtype=bool)
    _, values, right = np.linalg.svd(unit, full_matrices=m < nv)
    sure = finite if not rank else finite & (values[..., rank - 1] > SURE)
    if rank < values.shape[-1]:
        sure = sure & (values[..., rank] < REPEATED * (values[..., rank - 1] if rank else 1.0))
    return np.swapaxes(right[..., rank:, :], -1, -2), np.asarray(sure)
