"""Motions in the plane as complex numbers: a point x + iy, or an angle or slide, each with rate and acceleration.

Angles are counted from +x, counter-clockwise. A quarter turn is a factor i; lengths are |a + ib|. Everything
broadcasts: one number, a cycle, a family of designs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Point:
    """A moving point: position p [m], velocity v [m/s], acceleration a [m/s2], complex, of one shape."""

    p: Complex
    v: Complex
    a: Complex

    def xy(self) -> Real:
        """(..., 3, 2): x and y of position, velocity, acceleration."""
        z = np.stack(np.broadcast_arrays(self.p, self.v, self.a), axis=-1)
        return np.stack([z.real, z.imag], axis=-1)


@dataclass(frozen=True)
class Scalar:
    """A moving angle [rad] or slide [m]: value x, rate v, acceleration a."""

    x: Real
    v: Real
    a: Real


@dataclass(frozen=True)
class Guide:
    """A straight line that may move: through `at`, in the direction of `angle`, `offset` to the left of it [m]."""

    at: Point
    angle: Scalar
    offset: float = 0.0


def fixed(x: ArrayLike = 0.0, y: ArrayLike = 0.0) -> Point:
    """A point of the ground at (x, y) [m]. Raises MechlabError when it is not finite."""
    p = np.asarray(x, dtype=float) + 1j * np.asarray(y, dtype=float)
    if not np.all(np.isfinite(p)):
        raise MechlabError(f"ground point: expected finite coordinates, got x = {x!r}, y = {y!r}.")
    zero = np.zeros((), dtype=complex)
    return Point(p, zero, zero)


def scalar(x: ArrayLike, v: ArrayLike = 0.0, a: ArrayLike = 0.0) -> Scalar:
    """An angle or slide from its value, rate and acceleration."""
    return Scalar(np.asarray(x, dtype=float), np.asarray(v, dtype=float), np.asarray(a, dtype=float))


def fixed_guide(x: float = 0.0, y: float = 0.0, angle: float = 0.0, offset: float = 0.0) -> Guide:
    """A line of the ground through (x, y), in the direction of `angle` [rad]."""
    return Guide(fixed(x, y), scalar(angle), offset)


def dot(a: Complex, b: Complex) -> Real:
    """Scalar product of two plane vectors."""
    return a.real * b.real + a.imag * b.imag


def cross(a: Complex, b: Complex) -> Real:
    """z of the vector product: positive when b points to the left of a."""
    return a.real * b.imag - a.imag * b.real


def unit(angle: ArrayLike) -> Complex:
    """e^(i angle)."""
    angle = np.asarray(angle, dtype=float)
    out = np.empty(angle.shape, dtype=complex)
    out.real = np.cos(angle)
    out.imag = np.sin(angle)
    return out


def length(value: ArrayLike, what: str) -> Real:
    """`value` as lengths > 0 [m]; raises MechlabError that names `what`."""
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)) or np.any(array <= 0.0):
        raise MechlabError(f"{what}: expected a length > 0 m, got {value!r}.")
    return array


def mode_sign(mode: ArrayLike, what: str) -> Real:
    """`mode` as +1 or -1; raises MechlabError that names `what`."""
    sign = np.asarray(mode, dtype=float)
    if np.any(np.abs(sign) != 1.0):
        raise MechlabError(f"{what}: mode must be +1 or -1, got {mode!r}.")
    return sign


def rigid(base: Point, turn: Scalar, distance: ArrayLike, angle: ArrayLike = 0.0) -> Point:
    """Point of a link through `base` that turns by `turn`: base + distance e^(i (turn + angle)).

    v = v_base + i w r, a = a_base + (i eps - w^2) r. The base may move. With a driven `turn` this is the driver, class I.
    """
    r = np.asarray(distance, dtype=float) * unit(turn.x + np.asarray(angle, dtype=float))
    return Point(base.p + r, base.v + 1j * turn.v * r, base.a + (1j * turn.a - turn.v**2) * r)


def driver(pivot: Point, crank: ArrayLike, angle: ArrayLike, rate: ArrayLike = 0.0, accel: ArrayLike = 0.0) -> Point:
    """Class I: the pin of a crank of that length about a pivot that may move."""
    return rigid(pivot, scalar(angle, rate, accel), length(crank, "crank"))
