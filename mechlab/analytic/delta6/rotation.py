"""Orientation of the output link: angles alpha, beta, gamma and the matrix R = Rz(gamma) Ry(beta) Rx(alpha).

Sets of angles are arrays (..., 3) in the order (alpha, beta, gamma), radians. R has the columns e1, e2, e3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import BoolArray, FloatArray, finite, vectors
from mechlab.errors import MechlabError

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
    return np.asarray(-((np.pi - a) % (2.0 * np.pi) - np.pi))


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
