"""The equations of `mechlab.mechanism.batch_tree.BatchRows`, with those of given joints and shafts, at one pose in few numpy calls.

A call of numpy on a small array costs more than its arithmetic: so it is looked up once where all numbers stand, and the workspace is
kept. Rows, between the bodies a and b, and joints are lines or couples in world axes:

    r' = (u, h x u) . (V_b - V_a)       offset row along u at the point h;  (0, h x u): angle row between u of a and h of b
    V = sum of rate (o x u, u)          joint about u through the point o;  (u, 0): slide along u

V: velocity of the point of a body that is at the world's origin, angular velocity.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism.batch_tree import BatchRows, fixed_frames
from mechlab.mechanism.geometry import Array

_COLUMN = np.array([0, 4, 8])
_ZERO, _ONE = np.array([12, 13, 14]), np.array([15, 15, 15])
"""Places of a column, of zeros and of ones in a homogeneous matrix."""
_U, _HELD, _START, _U1, _U2, _HELD1, _HELD2 = range(7)
"""Vectors that are looked up for each row and joint: u, h, the point or zero from which h is measured, and u and h with their
coordinates shifted by one and by two places, for h x u."""


class OnePose:
    """Workspace for one pose at a time, of one thread: rows of a mechanism without curves, then `given` (k, nv), those of quantities."""

    def __init__(self, rows: BatchRows, given: Array) -> None:
        tree, n = rows.tree, rows.tree.ground
        # frame of a joint = basis[0] + basis[1] sin q (or q of a slide) + basis[2] cos q
        self._basis = np.stack([tree.basis[:, 0] + tree.basis[:, 2], tree.basis[:, 1], -tree.basis[:, 2]], axis=1)
        self._weights = np.ones((n, 1, 3))
        self._sines, self._cosines = self._weights[:, 0, 1], self._weights[:, 0, 2]
        self._slides = np.flatnonzero(~tree.revolute)
        self._turned, frames = np.empty((n, 1, 16)), np.empty((n + 1, 4, 4))
        frames[n] = np.eye(4)
        self._frames, self._steps, parents = frames, self._turned.reshape(n, 4, 4), tree.parents[:n]
        self._first = np.flatnonzero(parents == n)
        self._chain = [(frames[p], self._steps[k], frames[k]) for k, p in enumerate(parents.tolist()) if p != n]

        rods = len(rows.lengths)
        eyes = np.broadcast_to(np.eye(3), (rods, 1, 3, 3))
        sides = ((rows.a, rows.turn_a), (rows.rod_a, eyes), (rows.b, rows.turn_b), (rows.rod_b, eyes))
        joints = np.zeros((n, 4, 4))
        joints[:, :3, 0], joints[:, 3, 3] = tree.axes[:, 0, :3, 0], 1.0
        ends = [fixed_frames(turns, places)[:, 0] for (_, places), turns in sides]
        self._links = np.concatenate([*(links for (links, _), _ in sides), np.arange(n)])
        self._ends = np.concatenate([*ends, joints])
        self._loops = np.concatenate([rows.offsets[0], rows.angles[0], len(rows.a[0]) + np.arange(rods)]).astype(int)
        self._places = self._looked_up(rows)
        self._found: Array = np.empty(self._ends.shape)
        self._parts: Array = np.empty(self._places.shape)
        count = self._count = len(self._loops)
        self._rods, self._lengths = slice(count - rods, count), rows.lengths
        self._lines, self._moves = np.empty((count + n, 9)), np.ones((count + n, 1))
        self._moves[len(rows.offsets[0]) : count - rods] = 0.0
        self._linear = np.concatenate([rows.relations, given])
        between = np.concatenate([rows.between, rows.rod_between])[self._loops, 0, 0]
        self._between, self._rows = between, np.concatenate([between, self._linear])

    def _looked_up(self, rows: BatchRows) -> NDArray[np.intp]:
        """(7, rows + joints, 3) places in the homogeneous matrices of all ends, then of all joints."""
        n, loops = rows.tree.ground, len(rows.a[0]) + len(rows.rod_a[0])
        a, b = 16 * self._loops[:, None], 16 * (loops + self._loops)[:, None]
        offsets, angles = rows.offsets.shape[1], rows.angles.shape[1]
        u, w = np.zeros((2, len(a), 1), dtype=int)
        angle = np.zeros((len(a), 1), dtype=bool)
        angle[offsets : offsets + angles] = True
        u[:offsets, 0] = rows.offsets[1]
        u[angle], w[angle] = rows.angles[1:]
        out = np.empty((7, len(a) + n, 3), dtype=np.intp)
        at, j = out[:, : len(a)], 16 * (2 * loops + np.arange(n))[:, None]
        at[_U], at[_HELD] = a + u + _COLUMN, b + np.where(angle, w, 3) + _COLUMN
        at[_START] = a + np.where(angle, _ZERO, 3 + _COLUMN)
        joints = out[:, len(a) :]
        joints[_U], joints[_HELD], joints[_START] = j + _COLUMN, j + 3 + _COLUMN, j + _ZERO
        for k, (source, shift) in enumerate(((_U, 1), (_U, 2), (_HELD, 1), (_HELD, 2)), _U1):
            out[k] = np.roll(out[source], -shift, axis=1)
        slides = j[self._slides]  # (u, 0): ones and zeros take the place of o
        for k, place in ((_U, _ZERO), (_U1, _ZERO), (_U2, _COLUMN), (_HELD1, _ONE), (_HELD2, _ZERO)):
            joints[k, self._slides] = slides + place
        return out

    def residual(self, q: Array, off: Array) -> Array:
        """(m,) residual at q (nv,); off (k,): zero less target of the given quantities."""
        np.sin(q, out=self._sines)
        np.cos(q, out=self._cosines)
        if len(self._slides):
            self._sines[self._slides] = q[self._slides]
        np.matmul(self._weights, self._basis, out=self._turned)
        self._frames[self._first] = self._steps[self._first]
        for parent, step, frame in self._chain:
            parent.dot(step, frame)
        np.matmul(self._frames.take(self._links, 0), self._ends, out=self._found)
        parts, count = self._found.take(self._places, out=self._parts, mode="clip"), self._count
        out = np.empty(len(self._rows))
        apart = parts[_HELD, :count] - parts[_START, :count]
        if len(self._lengths):
            along = parts[_U, self._rods] = apart[self._rods] / self._lengths[:, None]
            parts[_U1, self._rods], parts[_U2, self._rods] = np.roll(along, -1, axis=1), np.roll(along, -2, axis=1)
        np.add.reduce(parts[_U, :count] * apart, axis=1, out=out[:count])
        if len(self._lengths):
            out[self._rods] = 0.5 * (out[self._rods] - self._lengths)
        if len(self._linear):
            self._linear.dot(q, out[count:])
            out[len(out) - len(off) :] += off
        return out

    def evaluate(self, q: Array, off: Array) -> tuple[Array, Array]:
        """(m,) residual and (m, nv) Jacobian."""
        residual = self.residual(q, off)
        parts, lines, count = self._parts, self._lines, self._count
        np.multiply(parts[_U], self._moves, out=lines[:, :3])
        np.subtract(parts[_HELD1] * parts[_U2], parts[_HELD2] * parts[_U1], out=lines[:, 3:6])
        lines[count:, 6:] = parts[_U, count:]
        rows = self._rows.copy()
        np.multiply(lines[:count, :6].dot(lines[count:, 3:].T), self._between, out=rows[:count])
        return residual, rows
