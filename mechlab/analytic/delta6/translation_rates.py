"""Velocities and accelerations between the sliders and O.

With G_i, h_i of `translation`: qdot_i = v_z - (G_i . v_xy) / h_i and
qddot_i = a_z - (|v_xy|^2 + (G_i . v_xy)^2 / h_i^2 + G_i . a_xy) / h_i.
Rates do not exist where a rod is horizontal (h_i = 0, type I) or a pose is out of reach; every function here
raises NoSolution there. Mask bulk data with `inverse_position(...).h2 > 0` first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import FloatArray, apply, demand, vectors
from mechlab.analytic.delta6.geometry import Delta6
from mechlab.analytic.delta6.translation import leg_vectors, squared_heights
from mechlab.errors import NoSolution


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
    h = leg_heights(geom, position)
    jacobian = np.ones(h.shape + (3,))
    jacobian[..., :2] = -leg_vectors(geom, position) / h[..., None]
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
