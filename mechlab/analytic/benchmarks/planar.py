"""Planar linkages of one freedom in complex numbers: positions with first and second derivatives by the drive angle.

A `Jet` is a value with its first two derivatives by the drive angle; a point of the plane is x + i y. The equation of the
one freedom (Eksergian 1930): J w' + J'/2 w^2 = Q, J = sum m |z'|^2 + I theta'^2, J'/2 = sum m Re(conj z' z'') + I theta' theta''.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

from mechlab.errors import NoSolution


@dataclass(frozen=True)
class Jet:
    """value, first and second derivative by the drive angle; complex for points, real for angles."""

    value: complex
    first: complex = 0.0
    second: complex = 0.0

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, self.first + other.first, self.second + other.second)

    def __sub__(self, other: Jet) -> Jet:
        return Jet(self.value - other.value, self.first - other.first, self.second - other.second)


def arm(angle: Jet, offset: complex) -> Jet:
    """offset e^(i angle): a point fixed in a body that turns by `angle`, from the body's origin."""
    z = offset * cmath.exp(1j * angle.value)
    return Jet(z, 1j * angle.first * z, (1j * angle.second - angle.first**2) * z)


def dyad(start: Jet, end: Jet, first: float, second: float, side: int, name: str) -> tuple[Jet, Jet]:
    """Angles of two bars of lengths `first` (from `start`) and `second` (from `end`) that meet in a pin, on the `side`
    (+1 left, -1 right) of the vector from start to end. Raises NoSolution, naming the dyad, when they cannot meet."""
    d = end - start
    distance = abs(d.value)
    cosine = (first**2 + distance**2 - second**2) / (2.0 * first * distance) if distance else 2.0
    if abs(cosine) > 1.0:
        raise NoSolution(
            f"{name}: bars of {first:g} m and {second:g} m do not meet over {distance:g} m; change the lengths."
        )
    one = cmath.phase(d.value) + side * math.acos(cosine)
    u = cmath.exp(1j * one)
    other = first * u - d.value
    two = cmath.phase(other)
    w = other / second
    # start + first u = end + second w; derivative: i first u a' - i second w b' = d'
    a1, b1 = _solve(1j * first * u, -1j * second * w, d.first, name)
    right = d.second + first * u * a1**2 - second * w * b1**2
    a2, b2 = _solve(1j * first * u, -1j * second * w, right, name)
    return Jet(one, a1, a2), Jet(two, b1, b2)


def _solve(p: complex, q: complex, right: complex, name: str) -> tuple[float, float]:
    """Real a, b of a p + b q = right."""
    det = p.real * q.imag - p.imag * q.real
    if abs(det) < 1e-14 * abs(p) * abs(q):
        raise NoSolution(
            f"{name}: both bars lie in one line (dead centre); the drive angle does not determine the motion."
        )
    a = (right.real * q.imag - right.imag * q.real) / det
    b = (p.real * right.imag - p.imag * right.real) / det
    return a, b


@dataclass
class Balance:
    """Sums of the equation of the one freedom: inertia J, half its derivative, generalised force at zero speed."""

    inertia: float = 0.0
    half_derivative: float = 0.0
    force: float = 0.0

    def body(self, mass: float, spin: float, centre: Jet, angle: Jet, gravity: complex = 0.0) -> None:
        """A body of mass [kg] and `spin` moment of inertia about its centre [kg m2]; gravity as a vector of the plane."""
        turn, bend = angle.first.real, angle.second.real
        self.inertia += mass * abs(centre.first) ** 2 + spin * turn * turn
        self.half_derivative += mass * (centre.first.conjugate() * centre.second).real + spin * turn * bend
        self.force += mass * (gravity.conjugate() * centre.first).real

    def acceleration(self, speed: float, torque: float = 0.0) -> float:
        """Angular acceleration of the drive under its torque [N m]."""
        return (torque + self.force - self.half_derivative * speed * speed) / self.inertia
