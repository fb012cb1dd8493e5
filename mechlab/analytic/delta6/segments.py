"""Distances between straight segments, vectorised (C. Ericson, Real-Time Collision Detection, 2005, 5.1.9)."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.delta6._inputs import FloatArray


def point_segment_distance(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Distance of a point from the segment start..end; (..., n) each, broadcast -> (...)."""
    along = end - start
    share = _dot(point - start, along) / np.maximum(_dot(along, along), np.finfo(float).tiny)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.linalg.norm(point - nearest, axis=-1))


def segment_distance(start: FloatArray, end: FloatArray, other_start: FloatArray, other_end: FloatArray) -> FloatArray:
    """Smallest distance of two segments; (..., n) each, broadcast -> (...).

    The nearest pair is that of the two lines when it lies inside both segments, else one end belongs to it.
    """
    ends = np.minimum.reduce([
        point_segment_distance(start, other_start, other_end), point_segment_distance(end, other_start, other_end),
        point_segment_distance(other_start, start, end), point_segment_distance(other_end, start, end),
    ])  # fmt: skip
    u, v, w = end - start, other_end - other_start, start - other_start
    a, b, c, d, e = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    det = a * c - b * b
    crossing = det > 1e-14 * a * c
    safe = np.where(crossing, det, 1.0)
    s, t = (b * e - c * d) / safe, (a * e - b * d) / safe
    between = crossing & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    line = np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
    return np.where(between, np.minimum(line, ends), ends)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.sum(a * b, axis=-1))
