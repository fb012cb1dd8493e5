"""Translation of the head centre O against the three sliders: positions forward and inverse, velocities, accelerations.

Leg i: G_i = O_xy + g_i is the horizontal vector from guide to platform anchor, h_i = sqrt(L^2 - |G_i|^2) the height of the rod;
slider q_i = O_z + platform_height + h_i + slider_height [m].

Rates: qdot_i = v_z - (G_i . v_xy) / h_i and
qddot_i = a_z - (|v_xy|^2 + (G_i . v_xy)^2 / h_i^2 + G_i . a_xy) / h_i.
They do not exist where a rod is horizontal (h_i = 0, singularity of type I) or a pose is out of reach; the functions of rates
raise NoSolution there. Mask bulk data with `inverse_position(...).h2 > 0` first.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.blocks import pieces
from mechlab.analytic.delta6.geometry import BoolArray, Delta6, FloatArray, apply, demand, vectors
from mechlab.errors import NoSolution
from mechlab.lazy_dataclass import dataclass


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
    """G_i = O_xy + g_i, horizontal vector from upper to lower cross centre. position (..., 3) -> (..., 3, 2)."""
    xy = vectors("position", position)[..., None, :2]
    return np.asarray(xy + geom.leg_offsets)


def squared_heights(geom: Delta6, position: ArrayLike) -> FloatArray:
    """Signed radicands h_i^2 = L^2 - |G_i|^2 in m^2. position (..., 3) -> (..., 3)."""
    p = vectors("position", position)
    return _squared_heights(geom, p)


def squared_offsets(geom: Delta6, x: FloatArray, y: FloatArray) -> tuple[FloatArray, ...]:
    """|G_i|^2 of the three legs in m^2, each in the broadcast shape of x and y [m]."""
    g = geom.leg_offsets
    return tuple((x + g[i, 0]) ** 2 + (y + g[i, 1]) ** 2 for i in range(3))


def _squared_heights(geom: Delta6, p: FloatArray) -> FloatArray:
    h2 = np.empty(p.shape)
    for i, square in enumerate(squared_offsets(geom, p[..., 0], p[..., 1])):
        h2[..., i] = geom.rod_length**2 - square
    return h2


def inverse_position(geom: Delta6, position: ArrayLike) -> InversePosition:
    """Slider positions q_i = O_z + platform_height + h_i + slider_height, the higher of the two roots.

    position: O, shape (..., 3). A pose out of reach has `reachable` False and a negative radicand; `.require()` raises.
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
    shape, count = q.shape[:-1], math.prod(q.shape[:-1])
    tops = q.reshape(count, 3) - (geom.slider_height + geom.platform_height)
    position, heights, discriminant = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    for part in pieces(count):
        _lower_point(geom, tops[part], position[part], discriminant[part])
        np.subtract(tops[part], position[part, 2:], out=heights[part])
    assembles = discriminant >= 0.0
    on_branch = assembles & (heights.min(axis=-1) > 0.0)
    if not assembles.all():
        position[~assembles] = heights[~assembles] = np.nan
    return ForwardPosition(
        position.reshape(q.shape),
        heights.reshape(q.shape),
        discriminant.reshape(shape),
        assembles.reshape(shape),
        on_branch.reshape(shape),
    )


def _lower_point(geom: Delta6, top: FloatArray, position: FloatArray, discriminant: FloatArray) -> None:
    """Writes O (n, 3) and the discriminant (n,) for the heights (n, 3) of the spheres' centres."""
    first, second, third = -geom.leg_offsets
    (ex, ey), (fx, fy) = (second - first).tolist(), (third - first).tolist()
    z = np.ascontiguousarray(top.T)
    ez, fz = z[1] - z[0], z[2] - z[0]
    n = (ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx)
    n2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    half = 0.5 / n2
    by_e, by_f = (fx * fx + fy * fy + fz * fz) * half, (ex * ex + ey * ey + ez * ez) * half
    arm = (
        by_e * (n[1] * ez - n[2] * ey) + by_f * (fy * n[2] - fz * n[1]),
        by_e * (n[2] * ex - n[0] * ez) + by_f * (fz * n[0] - fx * n[2]),
        by_e * (n[0] * ey - n[1] * ex) + by_f * (fx * n[1] - fy * n[0]),
    )
    discriminant[:] = geom.rod_length**2 - (arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2])
    drop = np.sqrt(np.maximum(discriminant, 0.0) / n2) * math.copysign(1.0, n[2])
    for k, start in enumerate((first[0], first[1], z[0])):
        position[:, k] = start + arm[k] - drop * n[k]


# -- velocities and accelerations ------------------------------------------------------------------------------------------


def leg_heights(geom: Delta6, position: ArrayLike) -> FloatArray:
    """h_i = sqrt(L^2 - |G_i|^2) > 0. position O (..., 3) -> (..., 3). Raises where h_i is zero or not real."""
    h2 = squared_heights(geom, position)
    smallest = h2.min(initial=np.inf)
    demand(
        np.asarray(h2.min(axis=-1) > 0.0),
        f"on or beyond the reach limit, smallest h^2 = {smallest:.6g} m^2, where slider rates are unbounded",
        "Use poses with inverse_position(...).h2 > 0",
    )
    return np.asarray(np.sqrt(h2))


def translation_jacobian(geom: Delta6, position: ArrayLike) -> FloatArray:
    """J with qdot = J v_O, rows (-G_ix/h_i, -G_iy/h_i, 1). position O (..., 3) -> (..., 3, 3), dimensionless."""
    p = vectors("position", position)
    inverse = -1.0 / leg_heights(geom, p)
    jacobian = np.ones(p.shape + (3,))
    for i, offset in enumerate(geom.leg_offsets):
        for k in (0, 1):
            np.multiply(p[..., k] + offset[k], inverse[..., i], out=jacobian[..., i, k])
    return jacobian


def implicit_matrices(geom: Delta6, position: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """A and B of A v_O = -B qdot, derivatives of |G_i|^2 + h_i^2 - L^2 (Gosselin & Angeles 1990).

    A has rows 2 (G_ix, G_iy, -h_i), B = 2 diag(h_i), both (..., 3, 3) in metres.
    """
    h = leg_heights(geom, position)
    a = np.empty(h.shape + (3,))
    a[..., :2] = 2.0 * leg_vectors(geom, position)
    a[..., 2] = -2.0 * h
    return a, np.asarray(2.0 * h[..., None] * np.eye(3))


def slider_rates(geom: Delta6, position: ArrayLike, velocity: ArrayLike) -> FloatArray:
    """qdot from O and v_O, all (..., 3), m/s."""
    return apply(translation_jacobian(geom, position), vectors("velocity", velocity))


def platform_velocity(geom: Delta6, position: ArrayLike, rates: ArrayLike) -> FloatArray:
    """v_O from O and qdot, all (..., 3), m/s. Raises where the rods' triple is singular (type II)."""
    return _solve(translation_jacobian(geom, position), vectors("rates", rates))


def slider_accelerations(geom: Delta6, position: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike) -> FloatArray:
    """qddot from O, v_O and a_O, all (..., 3), m/s^2."""
    linear = apply(translation_jacobian(geom, position), vectors("acceleration", acceleration))
    return np.asarray(linear + _velocity_terms(geom, position, velocity))


def platform_acceleration(
    geom: Delta6, position: ArrayLike, velocity: ArrayLike, accelerations: ArrayLike
) -> FloatArray:
    """a_O from O, v_O and qddot, all (..., 3), m/s^2. Raises where the rods' triple is singular (type II)."""
    rest = vectors("accelerations", accelerations) - _velocity_terms(geom, position, velocity)
    return _solve(translation_jacobian(geom, position), rest)


def _velocity_terms(geom: Delta6, position: ArrayLike, velocity: ArrayLike) -> FloatArray:
    v = vectors("velocity", velocity)[..., :2]
    h = leg_heights(geom, position)
    along = apply(leg_vectors(geom, position), v)
    speed2 = np.sum(v * v, axis=-1, keepdims=True)
    return np.asarray(-(speed2 + (along / h) ** 2) / h)


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    try:
        return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])
    except np.linalg.LinAlgError as error:
        raise NoSolution(
            "the three rods are linearly dependent in at least one pose (type II singularity): the "
            "sliders do not determine the platform's motion there"
        ) from error
