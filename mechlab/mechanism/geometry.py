"""Vectors, rotations and placements as plain numbers, of which a Mechanism consists."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, explained
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
Vector = tuple[float, float, float]


def vector(value: Sequence[float] | Array, what: str) -> Vector:
    """`value` as three finite floats; raises MechlabError that names `what`."""
    try:
        numbers = [float(x) for x in value]
    except (TypeError, ValueError):
        raise MechlabError(f"{what}: expected three numbers, got {value!r}.") from None
    # a sum is finite where all numbers are, but for those beyond 1e307, which are looked at one by one
    if len(numbers) != 3 or not (math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers))):
        raise MechlabError(f"{what}: expected three finite numbers, got {value!r}.")
    return (numbers[0], numbers[1], numbers[2])


def unit(value: Sequence[float] | Array, what: str) -> Vector:
    """`value` normalized; a vector of unit length to within rounding is kept bit for bit."""
    x, y, z = vector(value, what)
    norm = math.sqrt(x * x + y * y + z * z)
    if not 1e-12 <= norm < math.inf:  # the squares leave the range of doubles before the direction does
        largest = max(abs(x), abs(y), abs(z))
        if largest == 0.0:
            raise MechlabError(f"{what}: a direction must not be zero, got {(x, y, z)}.")
        return unit((x / largest, y / largest, z / largest), what)
    if abs(norm - 1.0) < 4e-16:
        return (x, y, z)
    return (x / norm, y / norm, z / norm)


def skew(v: ArrayLike) -> Array:
    """(3, 3) matrix of the cross product: `skew(v) @ w == cross(v, w)`."""
    x, y, z = np.asarray(v, dtype=float)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: ArrayLike, b: ArrayLike) -> Array:
    """Cross product of two (3,) vectors, much faster than numpy's general one."""
    a0, a1, a2 = np.asarray(a, dtype=float).tolist()
    b0, b1, b2 = np.asarray(b, dtype=float).tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def axis_rotation(axis: ArrayLike, angle: float) -> Array:
    """(3, 3) rotation by `angle` [rad] about the unit `axis` (Rodrigues)."""
    x, y, z = np.asarray(axis, dtype=float).tolist()
    c, s = math.cos(angle), math.sin(angle)
    k = 1.0 - c
    return np.array(
        (
            c + k * x * x, k * x * y - s * z, k * x * z + s * y,
            k * x * y + s * z, c + k * y * y, k * y * z - s * x,
            k * x * z - s * y, k * y * z + s * x, c + k * z * z,
        )
    ).reshape(3, 3)  # fmt: skip


def quaternion_to_matrix(wxyz: ArrayLike) -> Array:
    """(3, 3) rotation of a quaternion (w, x, y, z), which is normalized first."""
    w, x, y, z = np.asarray(wxyz, dtype=float).tolist()
    n = w * w + x * x + y * y + z * z
    s = 2.0 / n
    return np.array(
        (
            1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
            s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),
            s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y),
        )
    ).reshape(3, 3)  # fmt: skip


def matrix_to_quaternion(rotation: ArrayLike) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z), w >= 0, of a (3, 3) rotation (Shepperd's method: always well conditioned)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.asarray(rotation, dtype=float).tolist()
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        w, x, y, z = 1 + trace, zy - yz, xz - zx, yx - xy
    elif largest == xx:
        w, x, y, z = zy - yz, 1 + xx - yy - zz, yx + xy, zx + xz
    elif largest == yy:
        w, x, y, z = xz - zx, xy + yx, 1 + yy - zz - xx, zy + yz
    else:
        w, x, y, z = yx - xy, xz + zx, yz + zy, 1 + zz - xx - yy
    q = np.array([w, x, y, z])
    w, x, y, z = (q / math.sqrt(q.dot(q))).tolist()
    return (w, x, y, z) if w >= 0 else (-w, -x, -y, -z)


def rotation_log(rotation: ArrayLike) -> Array:
    """Rotation vector (3,) [rad] of a rotation matrix, |vector| <= pi."""
    w, *xyz = matrix_to_quaternion(rotation)
    v = np.array(xyz)
    n = float(np.linalg.norm(v))
    if n < 1e-12:
        return 2.0 * v
    return v * (2.0 * math.atan2(n, w) / n)


def quaternion_product(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product of two (w, x, y, z) quaternions."""
    aw, ax, ay, az = np.asarray(a, dtype=float).tolist()
    bw, bx, by, bz = np.asarray(b, dtype=float).tolist()
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def quaternion_products(a: Array, b: Array) -> Array:
    """(..., 4) Hamilton products of arrays of quaternions (w, x, y, z)."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack([
        aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw,
    ], axis=-1)  # fmt: skip


def quaternion_exp(rotation_vector: ArrayLike) -> Array:
    """Quaternion (w, x, y, z) of a rotation vector [rad]."""
    v = np.asarray(rotation_vector, dtype=float)
    angle = float(np.linalg.norm(v))
    if angle < 1e-12:
        return np.concatenate([[1.0], 0.5 * v])
    return np.concatenate([[math.cos(angle / 2)], math.sin(angle / 2) / angle * v])


def frame_along(axis: ArrayLike) -> Array:
    """(3, 3) rotation whose third column is the unit `axis`; the choice of the other two is deterministic."""
    z = np.asarray(axis, dtype=float)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, cross(z, x), z])


@explained
@dataclass(frozen=True)
class Placement:
    """A rigid transform: maps coordinates of the placed frame to those of the frame it is placed in.

    `position` in metres, `quaternion` as (w, x, y, z), normalized at construction.
    """

    position: Vector = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector(self.position, "placement position"))
        q = tuple([float(x) for x in self.quaternion])
        norm = math.sqrt(sum([x * x for x in q]))
        if len(q) != 4 or not math.isfinite(norm) or norm < 1e-12:
            raise MechlabError(
                f"placement quaternion: expected four finite numbers (w, x, y, z), got {self.quaternion!r}."
            )
        if abs(norm - 1.0) > 4e-16:
            q = tuple([x / norm for x in q])
        object.__setattr__(self, "quaternion", q)

    @staticmethod
    def of(rotation: ArrayLike, position: ArrayLike) -> Placement:
        """From a (3, 3) rotation matrix and a (3,) position."""
        p = np.asarray(position, dtype=float).tolist()
        return Placement((p[0], p[1], p[2]), matrix_to_quaternion(rotation))

    @property
    def rotation(self) -> Array:
        """(3, 3) rotation matrix."""
        return quaternion_to_matrix(self.quaternion)

    @property
    def translation(self) -> Array:
        """(3,) position."""
        return np.array(self.position)

    def __matmul__(self, other: Placement) -> Placement:
        """The composition: first `other`, then `self`."""
        if other == IDENTITY:
            return self
        if self == IDENTITY:
            return other
        return Placement.of(self.rotation @ other.rotation, self.rotation @ other.translation + self.translation)

    def inverse(self) -> Placement:
        """The placement of the outer frame in the placed one: `p.inverse() @ p` is the identity."""
        rotation = self.rotation.T
        return Placement.of(rotation, -rotation @ self.translation)

    def matrix(self) -> Array:
        """(4, 4) homogeneous matrix."""
        out = np.eye(4)
        out[:3, :3] = self.rotation
        out[:3, 3] = self.position
        return out


IDENTITY = Placement()
