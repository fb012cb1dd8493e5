"""The constant matrices of links: generators of joints, placements, pseudo-inertias; and the motion of a joint.

Planar matrices are 3 x 3, spatial ones 4 x 4; the number of entries of an axis or point says which.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError

FloatArray = NDArray[np.float64]


def revolute(axis: ArrayLike | None = None) -> FloatArray:
    """Generator of a turn: planar (3, 3) counter-clockwise without an axis, spatial (4, 4) about a unit axis (3,)."""
    out = np.zeros((3, 3)) if axis is None else np.zeros((4, 4))
    if axis is None:
        out[0, 1], out[1, 0] = -1.0, 1.0
        return out
    x, y, z = _unit(axis, (3,))
    out[:3, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    return out


def prismatic(axis: ArrayLike) -> FloatArray:
    """Generator of a slide along a unit axis: (2,) gives the planar (3, 3), (3,) the spatial (4, 4); its square is 0."""
    a = _unit(axis, (2,), (3,))
    out = np.zeros((len(a) + 1, len(a) + 1))
    out[:-1, -1] = a
    return out


def placement(position: ArrayLike, rotation: ArrayLike | float = 0.0) -> FloatArray:
    """Constant place of a joint in its parent: planar from (x, y) and an angle, spatial from (x, y, z) and (3, 3)."""
    p = _finite("position", position)
    if p.shape not in ((2,), (3,)):
        raise MechlabError(f"position has shape {p.shape}; expected (2,) in the plane or (3,) in space")
    out = np.eye(len(p) + 1)
    out[:-1, -1] = p
    r = _finite("rotation", rotation)
    if len(p) == 2:
        if r.shape != ():
            raise MechlabError(f"rotation has shape {r.shape}; a planar placement takes an angle [rad]")
        c, s = np.cos(r), np.sin(r)
        out[:2, :2] = [[c, -s], [s, c]]
    elif r.shape == (3, 3):
        if not np.allclose(r @ r.T, np.eye(3), rtol=0.0, atol=1e-9) or np.linalg.det(r) < 0.0:
            raise MechlabError("rotation is no rotation matrix: its rows are not orthonormal and right-handed")
        out[:3, :3] = r
    elif r.shape != () or r != 0.0:
        raise MechlabError(f"rotation has shape {r.shape}; a spatial placement takes a matrix (3, 3)")
    return out


def planar_inertia(mass: float, com: ArrayLike, inertia: float) -> FloatArray:
    """(3, 3) pseudo-inertia H = integral of r r^T dm, r = (x, y, 1), from the mass [kg], the centre of mass (2,) [m]
    and the moment of inertia [kg m2] about it.

    H11 and H22 share the central moment in halves: in the plane only their sum has a meaning.
    """
    _masses(mass, inertia)
    half = 0.5 * inertia * np.eye(2)
    return _pseudo(mass, com, half, (2,))


def spatial_inertia(mass: float, com: ArrayLike, tensor: ArrayLike) -> FloatArray:
    """(4, 4) pseudo-inertia H = integral of r r^T dm, r = (x, y, z, 1), from the mass [kg], the centre of mass (3,) [m]
    and the inertia tensor (3, 3) [kg m2] about it: its upper block is tr(I)/2 E - I + m c c^T."""
    i = _finite("tensor", tensor)
    if i.shape != (3, 3) or not np.allclose(i, i.T):
        raise MechlabError(f"tensor: expected a symmetric matrix (3, 3), got shape {i.shape}")
    _masses(mass, *np.diag(i))
    return _pseudo(mass, com, 0.5 * np.trace(i) * np.eye(3) - i, (3,))


def joint_motion(generator: FloatArray, q: ArrayLike) -> FloatArray:
    """exp(q Om) (..., d, d) of coordinates q (...): E + sin q Om + (1 - cos q) Om^2 for a turn, E + q Om for a slide.

    In the plane the first is [[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]].
    """
    angle = _finite("q", q)[..., None, None]
    unit = np.eye(len(generator))
    if not np.any(generator[:-1, :-1]):
        return np.asarray(unit + angle * generator)
    return np.asarray(unit + np.sin(angle) * generator + (1.0 - np.cos(angle)) * (generator @ generator))


def _pseudo(mass: float, com: ArrayLike, central: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    c = _finite("com", com)
    if c.shape != shape:
        raise MechlabError(f"com has shape {c.shape}; expected {shape}")
    r = np.append(c, 1.0)
    out = mass * np.outer(r, r)
    out[:-1, :-1] += central
    return out


def _masses(mass: float, *moments: float) -> None:
    if not np.isfinite(mass) or mass < 0.0 or any(not np.isfinite(x) or x < 0.0 for x in moments):
        raise MechlabError(f"mass {mass!r}, moments of inertia {moments!r}: expected finite numbers, zero or more")


def _unit(axis: ArrayLike, *shapes: tuple[int, ...]) -> FloatArray:
    a = _finite("axis", axis)
    size = float(np.linalg.norm(a))
    if a.shape not in shapes or size == 0.0:
        raise MechlabError(f"axis {a.tolist()}: expected a vector of shape {' or '.join(map(str, shapes))}, not zero")
    return np.asarray(a / size)


def _finite(name: str, value: ArrayLike) -> FloatArray:
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise MechlabError(f"{name} has values that are not finite")
    return array
