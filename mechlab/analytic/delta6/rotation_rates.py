"""Angular velocity and acceleration of the output link against the rates of alpha, beta, gamma.

omega = E rates with the columns e1, n = (-sin gamma, cos gamma, 0), z, and det E = cos(beta).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import FloatArray, apply, demand, finite, vectors
from mechlab.analytic.delta6.rotation import SINGULAR_COSINE


def rate_matrix(angles: ArrayLike) -> FloatArray:
    """E of omega = E (alpha', beta', gamma')', base axes. angles (..., 3) -> (..., 3, 3)."""
    a = vectors("angles", angles)
    cb, sb, cg, sg = np.cos(a[..., 1]), np.sin(a[..., 1]), np.cos(a[..., 2]), np.sin(a[..., 2])
    e = np.zeros(a.shape + (3,))
    e[..., 0, 0], e[..., 1, 0], e[..., 2, 0] = cg * cb, sg * cb, -sb
    e[..., 0, 1], e[..., 1, 1] = -sg, cg
    e[..., 2, 2] = 1.0
    return e


def inverse_rate_matrix(angles: ArrayLike) -> FloatArray:
    """E^-1 in closed form. angles (..., 3) -> (..., 3, 3).

    alpha' = w / cos(beta), beta' = cg wy - sg wx, gamma' = wz + w tan(beta), with w = cg wx + sg wy.
    Raises NoSolution where |cos(beta)| < SINGULAR_COSINE: the axes of alpha and gamma coincide there.
    """
    a = vectors("angles", angles)
    cb, sb, cg, sg = np.cos(a[..., 1]), np.sin(a[..., 1]), np.cos(a[..., 2]), np.sin(a[..., 2])
    demand(
        np.asarray(np.abs(cb) >= SINGULAR_COSINE),
        "beta = +-90 deg, one angular velocity cannot be produced",
        "Keep |beta| below 90 deg or give rates of alpha, beta, gamma instead of omega",
    )
    inverse = np.zeros(a.shape + (3,))
    inverse[..., 0, 0], inverse[..., 0, 1] = cg / cb, sg / cb
    inverse[..., 1, 0], inverse[..., 1, 1] = -sg, cg
    inverse[..., 2, 0], inverse[..., 2, 1], inverse[..., 2, 2] = cg * sb / cb, sg * sb / cb, 1.0
    return inverse


def angular_velocity(angles: ArrayLike, rates: ArrayLike) -> FloatArray:
    """omega in base axes from angles and their rates, all (..., 3), rad/s."""
    return apply(rate_matrix(angles), vectors("rates", rates))


def angle_rates(angles: ArrayLike, omega: ArrayLike) -> FloatArray:
    """Rates of alpha, beta, gamma from omega in base axes, all (..., 3). Raises at cos(beta) = 0."""
    return apply(inverse_rate_matrix(angles), vectors("omega", omega))


def angular_acceleration(angles: ArrayLike, rates: ArrayLike, accelerations: ArrayLike) -> FloatArray:
    """d omega / dt in base axes = E accelerations + E' rates, all (..., 3), rad/s^2."""
    return apply(rate_matrix(angles), vectors("accelerations", accelerations)) + _rate_terms(angles, rates)


def angle_accelerations(angles: ArrayLike, rates: ArrayLike, omega_rate: ArrayLike) -> FloatArray:
    """Second derivatives of alpha, beta, gamma from angles, rates, d omega / dt, all (..., 3).

    Raises NoSolution at cos(beta) = 0.
    """
    rest = vectors("omega_rate", omega_rate) - _rate_terms(angles, rates)
    return apply(inverse_rate_matrix(angles), rest)


def orientation_determinant(beta: ArrayLike) -> FloatArray:
    """det E = cos(beta): 0 where the axes of alpha and gamma coincide. (...) -> (...)."""
    return np.asarray(np.cos(finite("beta", beta)))


def _rate_terms(angles: ArrayLike, rates: ArrayLike) -> FloatArray:
    """E' rates: alpha' d(e1)/dt + beta' d(n)/dt."""
    a, r = vectors("angles", angles), vectors("rates", rates)
    cb, sb, cg, sg = np.cos(a[..., 1]), np.sin(a[..., 1]), np.cos(a[..., 2]), np.sin(a[..., 2])
    al, be, ga = r[..., 0], r[..., 1], r[..., 2]
    x = al * (-be * cg * sb - ga * sg * cb) - be * ga * cg
    y = al * (-be * sg * sb + ga * cg * cb) - be * ga * sg
    z = -al * be * cb
    return np.stack([x, y, z], axis=-1)
