"""Rotary drives against alpha, beta, gamma: a constant matrix.

phi_1 = k_spur gamma + k_transfer (k_bevel alpha - beta), phi_2 = k_spur gamma + k_transfer (k_bevel alpha + beta),
phi_3 = gamma. Turning the T-shaped carrier by beta with the output gear locked on it turns the double bevels by
beta itself, so k_bevel multiplies alpha only. Unwrap angles along a path first: a jump of gamma by 2 pi is a jump
of 2 pi k_spur in drives 1 and 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import FloatArray, apply, finite, vectors
from mechlab.analytic.delta6.geometry import Delta6
from mechlab.analytic.delta6.rotation_rates import inverse_rate_matrix


def drive_matrix(geom: Delta6) -> FloatArray:
    """K of phi = K (alpha, beta, gamma)', shape (3, 3), rows times `rotary_signs`."""
    return _signed(geom, geom.k_product, geom.k_transfer)


def printed_drive_matrix(geom: Delta6) -> FloatArray:
    """K as the source prints it, k_transfer * k_bevel for alpha and beta; equal to `drive_matrix` if k_bevel = 1."""
    return _signed(geom, geom.k_product, geom.k_product)


def drives_from_angles(geom: Delta6, angles: ArrayLike) -> FloatArray:
    """phi = K angles; the same law holds for rates and accelerations. (..., 3) -> (..., 3)."""
    return apply(drive_matrix(geom), vectors("angles", angles))


def angles_from_drives(geom: Delta6, drives: ArrayLike) -> FloatArray:
    """(alpha, beta, gamma) = K^-1 phi; the same law holds for rates and accelerations. (..., 3) -> (..., 3)."""
    phi = vectors("drives", drives) * np.asarray(geom.rotary_signs, dtype=np.float64)
    gamma = phi[..., 2]
    common = 0.5 * (phi[..., 0] + phi[..., 1]) - geom.k_spur * gamma
    beta = 0.5 * (phi[..., 1] - phi[..., 0]) / geom.k_transfer
    return np.stack([common / geom.k_product, beta, gamma], axis=-1)


def drive_rate_gain(geom: Delta6, beta: ArrayLike) -> FloatArray:
    """Largest 2-norm of the three drive rates for |omega| = 1: the top singular value of K E^-1. (...) -> (...).

    Independent of alpha and gamma; grows as 1 / cos(beta). Raises NoSolution at cos(beta) = 0.
    """
    return np.asarray(np.linalg.svd(_omega_to_drives(geom, beta), compute_uv=False)[..., 0])


def single_drive_rate_gain(geom: Delta6, beta: ArrayLike) -> FloatArray:
    """Largest rate of each drive for |omega| = 1, the row norms of K E^-1. (...) -> (..., 3).

    Raises NoSolution at cos(beta) = 0.
    """
    return np.asarray(np.linalg.norm(_omega_to_drives(geom, beta), axis=-1))


def _omega_to_drives(geom: Delta6, beta: ArrayLike) -> FloatArray:
    be = finite("beta", beta)
    angles = np.stack([np.zeros_like(be), be, np.zeros_like(be)], axis=-1)
    return np.asarray(drive_matrix(geom) @ inverse_rate_matrix(angles))


def _signed(geom: Delta6, k_alpha: float, k_beta: float) -> FloatArray:
    rows = np.array([[k_alpha, -k_beta, geom.k_spur], [k_alpha, k_beta, geom.k_spur], [0.0, 0.0, 1.0]])
    return np.asarray(rows * np.asarray(geom.rotary_signs, dtype=np.float64)[:, None])
