"""The path of a point as one thin tube of few pieces: what a picture of it needs, however long and often it was recorded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.viewer.story import Array

Indices = NDArray[np.int64]

SIDES = 6
"""Corners of the section of a tube."""


def thinned(points: Array, tolerance: float) -> Indices:
    """Increasing indices, first and last among them, of points (n, 3) whose polyline no other point leaves by more than
    `tolerance` (Douglas and Peucker 1973)."""
    kept = {0, len(points) - 1}
    pieces = [(0, len(points) - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        off = distances(points[first + 1 : last], points[first : first + 1], points[last : last + 1])[:, 0]
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = first + 1 + worst
            kept.add(middle)
            pieces += [(first, middle), (middle, last)]
    return np.array(sorted(kept), dtype=np.int64)


def distances(points: Array, starts: Array, ends: Array) -> Array:
    """(n, k) distances of points (n, 3) from straight pieces with starts and ends (k, 3)."""
    along = ends - starts
    square = np.maximum(np.einsum("kj,kj->k", along, along), 1e-300)
    reach = points[:, None, :] - starts
    share = np.clip(np.einsum("nkj,kj->nk", reach, along) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(reach - share[:, :, None] * along, axis=2))


class Trail:
    """The recorded path of a point, `points` (n, 3), as one thin tube with straight pieces that leave it by at most
    `tolerance`. What runs along a piece drawn before, nearer than twice that, is left out: a motion that repeats itself is
    drawn once.

    vertices: (m, 3) of the whole tube, SIDES at each corner; normals: (m, 3); faces: (k, 3), none for a point that rests.
    """

    def __init__(self, points: Array, radius: float, tolerance: float) -> None:
        self.points = points
        self._corners = thinned(points, tolerance)
        at = points[self._corners]
        new = _unseen(at, 2.0 * tolerance)
        around = _frames(at)
        self.normals = around.reshape(-1, 3)
        self._offsets = radius * around
        self.vertices = (at[:, None] + self._offsets).reshape(-1, 3)
        side = np.arange(SIDES)
        a = SIDES * np.flatnonzero(new)[:, None] + side
        b = SIDES * np.flatnonzero(new)[:, None] + (side + 1) % SIDES
        quads = np.stack([a, b, b + SIDES, a, b + SIDES, a + SIDES], axis=-1)
        self.faces: Indices = quads.reshape(-1, 3)

    def grown(self, frame: int) -> Array:
        """The vertices (m, 3) of the tube up to a recorded frame: all that comes later is drawn together at its end."""
        whole = int(np.searchsorted(self._corners, frame, side="right"))
        vertices = self.vertices.copy()
        if whole < len(self._corners):
            end = self.points[frame] + self._offsets[whole]
            vertices[SIDES * whole :] = np.tile(end, (len(self._corners) - whole, 1))
        return vertices


def _unseen(corners: Array, near: float) -> NDArray[np.bool_]:
    """Whether each piece between corners (n, 3) shows anything that the pieces before it do not."""
    starts, ends = corners[:-1], corners[1:]
    new = np.asarray(np.linalg.norm(ends - starts, axis=1) > 0.0)
    for k in range(2, len(starts)):
        before = np.flatnonzero(new[: k - 1])
        if new[k] and len(before):
            probes = np.array([starts[k], (starts[k] + ends[k]) / 2.0, ends[k]])
            off = distances(probes, starts[before], ends[before])
            new[k] = bool((off.min(axis=1) > near).any())
    return new


def _frames(corners: Array) -> Array:
    """(n, SIDES, 3) unit vectors around a polyline, square to its mean direction at each corner, turned as little as can be
    from one corner to the next."""
    steps = np.diff(corners, axis=0)
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    steps = np.divide(steps, lengths, out=np.zeros_like(steps), where=lengths > 0.0)
    along = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    first = np.eye(3)[int(np.argmin(np.abs(along[0])))]
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = []
    for direction in along:
        size = np.linalg.norm(direction)
        if size > 1e-12:  # where a path turns back the direction before serves as well
            axis = direction / size
            square = first - (first @ axis) * axis
            first = square / max(float(np.linalg.norm(square)), 1e-12)
            second = np.cross(axis, first)
            around.append(np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second))
        else:
            around.append(around[-1] if around else np.zeros((SIDES, 3)))
    return np.array(around)
