"""Positions of the sliders and of O: inverse and forward.

Leg i: G_i = O_xy + g_i, h_i = sqrt(L^2 - |G_i|^2), slider q_i = O_z + platform_height + h_i + slider_height.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import BoolArray, FloatArray, demand, vectors
from mechlab.analytic.delta6.geometry import Delta6


@dataclass(frozen=True)
class InversePosition:
    """Slider positions for given O.

    drives: (..., 3) metres, NaN exactly where `reachable` is False. h2: (..., 3) the signed radicand
    L^2 - |G_i|^2 in m^2, always finite; negative means that rod i is too short. reachable: (...) all h2 >= 0.
    """

    drives: FloatArray
    h2: FloatArray
    reachable: BoolArray

    def require(self) -> FloatArray:
        """The drives, or NoSolution if any pose is out of reach."""
        smallest = np.min(self.h2, initial=np.inf)
        demand(
            self.reachable,
            f"out of reach, smallest radicand L^2 - |G|^2 = {smallest:.6g} m^2",
            "Move O towards the centre or lengthen the rods",
        )
        return self.drives


@dataclass(frozen=True)
class ForwardPosition:
    """O for given slider positions.

    position: (..., 3) metres, NaN exactly where `assembles` is False. heights: (..., 3) h_i, NaN there too.
    discriminant: (...) L^2 minus the squared circumradius of the sphere centres, m^2, signed, always finite.
    assembles: (...) discriminant >= 0. on_branch: (...) every h_i > 0, which is what `inverse_position` gives
    back; False with a finite position means that a rod points upwards.
    """

    position: FloatArray
    heights: FloatArray
    discriminant: FloatArray
    assembles: BoolArray
    on_branch: BoolArray

    def require(self) -> FloatArray:
        """O, or NoSolution if a pose does not assemble or is not on the branch with all h_i > 0."""
        smallest = np.min(self.discriminant, initial=np.inf)
        demand(
            self.assembles,
            f"no assembly, smallest discriminant {smallest:.6g} m^2",
            "Bring the slider positions closer together",
        )
        demand(
            self.on_branch,
            "assembles only with a rod that points upwards (some h_i <= 0)",
            "Bring the slider positions closer together",
        )
        return self.position


def leg_vectors(geom: Delta6, position: ArrayLike) -> FloatArray:
    """G_i = O_xy + g_i, horizontal way from upper to lower cross centre. position (..., 3) -> (..., 3, 2)."""
    xy = vectors("position", position)[..., None, :2]
    return np.asarray(xy + geom.leg_offsets)


def squared_heights(geom: Delta6, position: ArrayLike) -> FloatArray:
    """Signed radicands h_i^2 = L^2 - |G_i|^2 in m^2. position (..., 3) -> (..., 3)."""
    p = vectors("position", position)
    return _squared_heights(geom, p)


def _squared_heights(geom: Delta6, p: FloatArray) -> FloatArray:
    g = geom.leg_offsets
    x, y = p[..., 0], p[..., 1]
    h2 = np.empty(p.shape)
    for i in range(3):
        gx, gy = x + g[i, 0], y + g[i, 1]
        h2[..., i] = geom.rod_length**2 - (gx * gx + gy * gy)
    return h2


def inverse_position(geom: Delta6, position: ArrayLike) -> InversePosition:
    """Slider positions q_i = O_z + platform_height + h_i + slider_height, the higher of the two roots.

    position: O, shape (..., 3). Out of reach is a flag and a negative radicand; `.require()` raises.
    """
    p = vectors("position", position)
    h2 = _squared_heights(geom, p)
    reachable = np.asarray(h2.min(axis=-1) >= 0.0)
    drives = np.sqrt(np.maximum(h2, 0.0))
    drives += (p[..., 2] + (geom.platform_height + geom.slider_height))[..., None]
    if not reachable.all():
        drives[~reachable] = np.nan
    return InversePosition(drives, h2, reachable)


def forward_position(geom: Delta6, sliders: ArrayLike) -> ForwardPosition:
    """O as the lower intersection of three spheres of radius L.

    sliders: q, shape (..., 3). Centres c_i = (-g_i, q_i - slider_height - platform_height). With
    e = c_2 - c_1, f = c_3 - c_1, n = e x f: the circumcentre is
    c_1 + (|f|^2 n x e + |e|^2 f x n) / (2 |n|^2) and O lies sqrt(L^2 - R^2) below it along n.
    n_z is a constant of the geometry, never zero, so "below" is always defined.
    """
    q = vectors("sliders", sliders)
    top = q - (geom.slider_height + geom.platform_height)
    centres = np.empty(q.shape + (3,))
    centres[..., :2] = -geom.leg_offsets
    centres[..., 2] = top
    e = centres[..., 1, :] - centres[..., 0, :]
    f = centres[..., 2, :] - centres[..., 0, :]
    n = np.cross(e, f)
    n2 = np.sum(n * n, axis=-1, keepdims=True)
    arm = (
        np.sum(f * f, axis=-1, keepdims=True) * np.cross(n, e) + np.sum(e * e, axis=-1, keepdims=True) * np.cross(f, n)
    ) / (2.0 * n2)
    discriminant = np.asarray(geom.rod_length**2 - np.sum(arm * arm, axis=-1))
    assembles = np.asarray(discriminant >= 0.0)
    drop = np.sqrt(np.maximum(discriminant, 0.0))[..., None] * np.sign(n[..., 2:]) / np.sqrt(n2)
    position = centres[..., 0, :] + arm - drop * n
    heights = top - position[..., 2:]
    on_branch = np.asarray(assembles & (heights.min(axis=-1) > 0.0))
    position[~assembles] = np.nan
    heights[~assembles] = np.nan
    return ForwardPosition(position, heights, discriminant, assembles, on_branch)
