"""Orientation of the output link: angles alpha, beta, gamma, their rates, and the rotary drives.

R = Rz(gamma) Ry(beta) Rx(alpha) turns body axes into base axes; its columns are e1, e2, e3. Sets of angles are arrays (..., 3)
in the order (alpha, beta, gamma) [rad].

Rates: omega = E (alpha', beta', gamma') in base axes. The columns of E are e1, n = (-sin gamma, cos gamma, 0) and z, and
det E = cos(beta).

Rotary drives: phi = K (alpha, beta, gamma) with a constant matrix,
phi_1,2 = k_spur gamma + k_transfer (k_bevel alpha -+ beta), phi_3 = gamma. When the T-shaped carrier turns by beta and the
output gear is locked on it, the double bevels turn by beta itself: k_bevel multiplies alpha only. Unwrap angles along a path
first: a jump of gamma by 2 pi is a jump of 2 pi k_spur in drives 1 and 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6.geometry import BoolArray, Delta6, FloatArray, apply, demand, finite, vectors
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

SINGULAR_COSINE = 1e-9
"""cos(beta) below which extracted angles are flagged: there noise of 1e-9 in R moves alpha and gamma by a radian."""

ORTHONORMAL_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Angles:
    """Angles taken from a rotation matrix.

    values: (..., 3) alpha, beta, gamma with beta in [-pi/2, pi/2], alpha and gamma in [-pi, pi]; they always
    reproduce R. singular: (...) True where cos(beta) < SINGULAR_COSINE, where only alpha -+ gamma is defined
    by R (beta = +-pi/2) and the split between the two is arbitrary.
    """

    values: FloatArray
    singular: BoolArray


def rotation_matrix(alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> FloatArray:
    """R = Rz(gamma) Ry(beta) Rx(alpha), body to base. Angles (...), broadcast against each other -> (..., 3, 3)."""
    al, be, ga = np.broadcast_arrays(finite("alpha", alpha), finite("beta", beta), finite("gamma", gamma))
    ca, sa, cb, sb, cg, sg = np.cos(al), np.sin(al), np.cos(be), np.sin(be), np.cos(ga), np.sin(ga)
    r = np.empty(al.shape + (3, 3))
    r[..., 0, 0], r[..., 0, 1], r[..., 0, 2] = cg * cb, cg * sb * sa - sg * ca, cg * sb * ca + sg * sa
    r[..., 1, 0], r[..., 1, 1], r[..., 1, 2] = sg * cb, sg * sb * sa + cg * ca, sg * sb * ca - cg * sa
    r[..., 2, 0], r[..., 2, 1], r[..., 2, 2] = -sb, cb * sa, cb * ca
    return r


def rotation_from_axes(e1: ArrayLike, e2: ArrayLike) -> FloatArray:
    """R = [e1, e2, e1 x e2] from the output link's X' and Y' axes, (..., 3) each.

    Raises MechlabError unless |e1| = |e2| = 1 and e1 . e2 = 0 to ORTHONORMAL_TOLERANCE.
    """
    x, y = np.broadcast_arrays(vectors("e1", e1), vectors("e2", e2))
    for name, value, wanted in (
        ("|e1|", np.linalg.norm(x, axis=-1), 1.0),
        ("|e2|", np.linalg.norm(y, axis=-1), 1.0),
        ("e1 . e2", np.sum(x * y, axis=-1), 0.0),
    ):
        worst = np.max(np.abs(value - wanted), initial=0.0)
        if worst > ORTHONORMAL_TOLERANCE:
            raise MechlabError(f"{name} differs from {wanted:g} by {worst:.3g}; expected perpendicular unit vectors")
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def extract_angles(rotation: ArrayLike) -> Angles:
    """Angles of R, right in every quadrant and at cos(beta) = 0.

    gamma = atan2(e1y, e1x); beta = atan2(-e1z, hypot(e1x, e1y)); e2 turned back by gamma has the components
    x = cg e2x + sg e2y, y = -sg e2x + cg e2y, and alpha = atan2(sin(beta) x + cos(beta) e2z, y).
    rotation: (..., 3, 3). Raises MechlabError if it is not a rotation to ORTHONORMAL_TOLERANCE.
    """
    r = _rotation("rotation", rotation)
    e1, e2 = r[..., :, 0], r[..., :, 1]
    level = np.hypot(e1[..., 0], e1[..., 1])
    gamma = np.arctan2(e1[..., 1], e1[..., 0])
    beta = np.arctan2(-e1[..., 2], level)
    x = np.cos(gamma) * e2[..., 0] + np.sin(gamma) * e2[..., 1]
    y = np.cos(gamma) * e2[..., 1] - np.sin(gamma) * e2[..., 0]
    alpha = np.arctan2(np.sin(beta) * x + np.cos(beta) * e2[..., 2], y)
    return Angles(np.stack([alpha, beta, gamma], axis=-1), np.asarray(level < SINGULAR_COSINE))


def other_angles(angles: ArrayLike) -> FloatArray:
    """The second set with the same R, (alpha + pi, pi - beta, gamma + pi), in (-pi, pi]. (..., 3) -> (..., 3)."""
    a = vectors("angles", angles)
    return wrap(np.stack([a[..., 0] + np.pi, np.pi - a[..., 1], a[..., 2] + np.pi], axis=-1))


def wrap(angles: ArrayLike) -> FloatArray:
    """Each angle moved by whole turns into (-pi, pi]."""
    a = finite("angles", angles)
    near = np.arctan2(np.sin(a), np.cos(a))
    return np.where(near == -np.pi, np.pi, near)


def printed_turn_back(e1: ArrayLike) -> FloatArray:
    """The angle g = arctan(-e1y / e1x) as the source prints it: the turn back, g = -gamma, without a quadrant.

    e1: (..., 3) -> (...). Kept to test the printed formula; for work use `extract_angles`. Where e1x = 0 the limit
    -+pi/2 is returned; raises MechlabError where e1x = e1y = 0.
    """
    e = vectors("e1", e1)
    x, y = e[..., 0], e[..., 1]
    if np.any((x == 0.0) & (y == 0.0)):
        raise MechlabError("e1 is parallel to Z in at least one pose: arctan(-e1y / e1x) is undefined there")
    return np.asarray(np.arctan2(-y * np.where(x < 0.0, -1.0, 1.0), np.abs(x)))


def _rotation(name: str, value: ArrayLike) -> FloatArray:
    r = finite(name, value)
    if r.shape[-2:] != (3, 3):
        raise MechlabError(f"{name} has shape {r.shape}; expected (..., 3, 3)")
    worst = np.max(np.abs(np.swapaxes(r, -1, -2) @ r - np.eye(3)), initial=0.0)
    if worst > ORTHONORMAL_TOLERANCE:
        raise MechlabError(f"{name} is not orthonormal: R'R differs from the identity by {worst:.3g}")
    if np.any(np.linalg.det(r) < 0.0):
        raise MechlabError(f"{name} holds a reflection (determinant -1); expected right-handed axes")
    return r


# -- rates and accelerations of the angles ---------------------------------------------------------------------------------


def _beta_gamma(angles: FloatArray) -> tuple[FloatArray, ...]:
    """cos(beta), sin(beta), cos(gamma), sin(gamma), each (...)."""
    beta, gamma = angles[..., 1], angles[..., 2]
    return np.cos(beta), np.sin(beta), np.cos(gamma), np.sin(gamma)


def rate_matrix(angles: ArrayLike) -> FloatArray:
    """E of omega = E (alpha', beta', gamma')', base axes. angles (..., 3) -> (..., 3, 3)."""
    a = vectors("angles", angles)
    cb, sb, cg, sg = _beta_gamma(a)
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
    cb, sb, cg, sg = _beta_gamma(a)
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
    cb, sb, cg, sg = _beta_gamma(a)
    al, be, ga = r[..., 0], r[..., 1], r[..., 2]
    x = al * (-be * cg * sb - ga * sg * cb) - be * ga * cg
    y = al * (-be * sg * sb + ga * cg * cb) - be * ga * sg
    z = -al * be * cb
    return np.stack([x, y, z], axis=-1)


# -- rotary drives ---------------------------------------------------------------------------------------------------------


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
