"""The same linkage by rolling alone: point velocities from two circles and two pitch points, no transfer formula.

An independent model to hold the closed form against: the positions come from an intersection of circles in vectors, the
joint C has the velocity that keeps both rods rigid, and at each pitch point the two gears have the same velocity along
the common tangent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.gear_linkage.linkage import FloatArray, GearLinkage


def rolling_rates(g: GearLinkage, crank_angle: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Rates of idler and output gear for a crank rate of 1 rad/s. (...) -> (...), (...)."""
    phi = np.asarray(crank_angle, dtype=float)
    b = g.crank * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    d = np.zeros_like(b) + [g.frame, 0.0]
    c = _joint(g, b, d)
    vb = _turned(b)
    vc = _rigid(c, b, d, vb)
    ra, rc, _ = g.radii
    first = b + ra / g.coupler * (c - b)
    tangent = _turned(c - b)
    # Gear a turns with the crank: rate 1 about B.
    surface = _dot(vb + _turned(first - b) - vc, tangent)
    idler = surface / _dot(_turned(first - c), tangent)
    second = c + rc / g.rocker * (d - c)
    tangent = _turned(d - c)
    surface = _dot(vc + idler[..., None] * _turned(second - c), tangent)
    return idler, surface / _dot(_turned(second - d), tangent)


def _joint(g: GearLinkage, b: FloatArray, d: FloatArray) -> FloatArray:
    """C on both circles, on the side of the mode."""
    way = d - b
    square = _dot(way, way)
    along = 0.5 * (1.0 + (g.coupler**2 - g.rocker**2) / square)
    across = np.sqrt(np.maximum(g.coupler**2 / square - along**2, 0.0))
    return np.asarray(b + along[..., None] * way + g.mode * across[..., None] * _turned(way))


def _rigid(c: FloatArray, b: FloatArray, d: FloatArray, vb: FloatArray) -> FloatArray:
    """Velocity of C: (v - v_B) . BC = 0 and v . DC = 0."""
    matrix = np.stack([c - b, c - d], axis=-2)
    right = np.stack([_dot(vb, c - b), np.zeros(c.shape[:-1])], axis=-1)
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])


def _turned(x: FloatArray) -> FloatArray:
    return np.stack([-x[..., 1], x[..., 0]], axis=-1)


def _dot(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(np.sum(x * y, axis=-1))
