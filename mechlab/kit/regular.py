"""At which of many poses everything is as usual: nothing that is asked is left open, and no singular position is near.

The usual case is certified by a lower bound of the smallest singular value, from the inverse of a Gram matrix:

    sigma_min(A)^2 >= 1 / trace((A A^T)^-1)

of the rows that are independent at a generic pose; more rows only make it larger. What is not certified is not said to be singular: the
judgement of one pose (`mechlab.kit.determined`, `mechlab.mechanism.singularity`) says what it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechlab.kit.determined import SINGULAR
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kept import LastKept
from mechlab.mechanism.many_motion import rows_of
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.many_rows import independent, inverted
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.named_rows import LETTERS
from mechlab.mechanism.structure import generic, idle_directions, null_space, structure

CERTAIN = 1e-5
"""Least bound that the Gram matrix can certify: its rounding is 1e-16, that is 1e-8 of singular values."""
Mask = NDArray[np.bool_]


class Regularity:
    """A mechanism at the poses of the last `set(q)`, q (n, nq)."""

    def __init__(self, mechanism: Mechanism) -> None:
        m = self.mechanism = mechanism
        self.poses = ManyPoses(m)
        usual = np.linalg.norm(generic(m)[1], axis=1)
        self._usual = np.where(usual > 1e-14, usual, 1.0)[:, None]
        self._drives = np.array([m.row(d.on) for d in m.drives]).reshape(-1, m.nv)
        self._structure = structure(m)
        there = generic(m)[1] / self._usual
        self._kept = independent(there)
        sizes = np.linalg.norm(self._drives, axis=1)[:, None]
        self._scaled_drives = self._drives / np.where(sizes > 1e-14, sizes, 1.0)
        self._held = independent(np.concatenate([there, self._scaled_drives]))

    def set(self, q: Array) -> Regularity:
        """Move to the poses."""
        self.poses.set(q)
        self.closure = self.poses.residual_and_jacobian()[1]
        return self

    def rows(self, names: Sequence[str]) -> Array:
        """(n, k, nv) rows of joints, shafts and coordinates of frames."""
        return rows_of(self.poses, names)

    def fixed(self, names: Sequence[str]) -> Mask:
        """(n,) where closure and the rows of the names, local freedoms aside, surely leave no motion open."""
        m = self.mechanism
        rows = np.concatenate([self.closure, self.rows(names)], axis=1)
        if self._structure.idle:
            given = rows[:, self.closure.shape[1] :]
            rows = np.concatenate([rows, self._idle(given)], axis=1)
        if rows.shape[1] < m.nv:
            return np.zeros(len(rows), dtype=bool)
        norms = np.linalg.norm(rows, axis=2, keepdims=True)
        void = 1e-14 * np.maximum(1.0, norms.max(axis=1, keepdims=True))
        scaled = rows / np.where(norms > void, norms, 1.0)
        least = max(CERTAIN, 2.0 * SINGULAR * max(rows.shape[1:]))
        return _surely(np.swapaxes(scaled, 1, 2), least)

    def _idle(self, given: Array) -> Array:
        """(n, k, nv) directions of the local freedoms that are not given, zeros where there are fewer."""
        out = np.zeros((len(given), len(self._structure.idle) + 1, self.mechanism.nv))
        for k, (jacobian, rows) in enumerate(zip(self.closure, given, strict=True)):
            free = idle_directions(self.mechanism, jacobian)
            left = (free @ null_space(rows @ free)).T if len(rows) else free.T
            out[k, : len(left)] = left[: out.shape[1]]
        return out

    def singular(self, output: str | None) -> Mask:
        """(n,) where a singular position is not surely far: of the constraints, of the drives, of the frame `output`."""
        scaled = self.closure / self._usual
        best = self._structure
        near = ~_surely(scaled[:, self._kept], CERTAIN) | (len(self._kept) < best.rank)
        if len(self._drives):
            both = np.concatenate([scaled, np.broadcast_to(self._scaled_drives, (len(scaled), *self._scaled_drives.shape))], axis=1)
            near |= ~_surely(both[:, self._held], CERTAIN) | (len(self._held) < best.rank + best.driven)
        if output is not None and best.freedoms:
            twist = self.rows([f"{output}_{a}" for a in LETTERS])
            kept = scaled[:, self._kept]
            across = np.swapaxes(kept, 1, 2)
            with np.errstate(all="ignore"):
                shadow = twist - twist @ across @ inverted(kept @ across) @ kept if kept.shape[1] else twist
            fine = np.all(np.isfinite(shadow), axis=(1, 2))
            values = np.linalg.svd(np.where(fine[:, None, None], shadow, 0.0), compute_uv=False)
            wanted = min(6, best.mobility)
            if wanted:
                near |= ~fine | (values[:, wanted - 1] < CERTAIN * np.maximum(1.0, values[:, 0]))
        return near


_KEPT = LastKept()


def kept_regularity(mechanism: Mechanism) -> Regularity:
    """A Regularity; the last few of each thread are kept."""
    return _KEPT.get(Regularity, mechanism)


def _surely(rows: Array, least: float) -> Mask:
    """(n,) where the smallest singular value of rows (n, k, m), k <= m, is surely larger than `least`."""
    if not rows.shape[1]:
        return np.ones(len(rows), dtype=bool)
    with np.errstate(all="ignore"):
        trace = np.trace(inverted(rows @ np.swapaxes(rows, 1, 2)), axis1=1, axis2=2)
        return np.asarray((trace > 0.0) & (trace * least**2 < 1.0))
