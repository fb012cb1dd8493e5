"""Planar benchmark problems of one freedom in complex numbers: A01, A02, a four-bar and a slider-crank.

A `Jet` is a value with its first two derivatives by the drive angle; a point of the plane is x + i y. The equation of the
one freedom (Eksergian 1930): J w' + J'/2 w^2 = Q, J = sum m |z'|^2 + I theta'^2, J'/2 = sum m Re(conj z' z'') + I theta' theta''.

`FourbarCrank` evaluates one state in plain floats, thirty times faster than the arrays of `mechlab.analytic.fourbar`,
for integration at tight tolerances.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.physical_pendulum import PhysicalPendulum
from mechlab.errors import NoSolution
from mechlab.lazy_dataclass import dataclass


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
    """Sums of the equation of the one freedom: inertia J, half its derivative, generalized force at zero speed."""

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


@dataclass(frozen=True)
class FourbarCrank:
    """A four-bar of uniform bars.

    Lengths [m]; mode +1: the joint lies left of the vector from crank pin to rocker pivot; gravity [m/s2] along -y.

    moments: of crank, coupler, rocker about their centres [kg m2]; None: slender rods, m L^2 / 12.
    """

    crank: float
    coupler: float
    rocker: float
    ground: float
    mode: int
    mass_per_length: float
    gravity: float
    moments: tuple[float, float, float] | None = None

    def acceleration(self, phi: float, rate: float, torque: float) -> float:
        """Crank acceleration [rad/s2] under a torque [N m]. Raises NoSolution where the loop does not close."""
        drive, pivot = Jet(phi, 1.0), Jet(complex(self.ground))
        pin = arm(drive, self.crank)
        coupler, rocker = dyad(pin, pivot, self.coupler, self.rocker, self.mode, "fourbar: coupler and rocker")
        sums = Balance()
        g = complex(0.0, -self.gravity)
        lengths = (self.crank, self.coupler, self.rocker)
        moments = self.moments or tuple(self.mass_per_length * x**3 / 12.0 for x in lengths)
        bars = zip((Jet(0.0), pin, pivot), (drive, coupler, rocker), lengths, moments, strict=True)
        for start, angle, length, moment in bars:
            sums.body(self.mass_per_length * length, moment, start + arm(angle, 0.5 * length), angle, g)
        return sums.acceleration(rate, torque)


Array = NDArray[np.float64]


@dataclass(frozen=True)
class ParallelogramChain:
    """A02: N parallelograms in a chain, N + 1 equal uniform slender rockers and N couplers, in a vertical plane. The
    couplers translate, so each moves like a point mass at a rocker's tip. With theta clockwise from upright:

        theta'' = (g / L) sin(theta) [(N + 1) m_r / 2 + N m_c] / [(N + 1) m_r / 3 + N m_c]

    The tip of the first rocker stands at L (sin theta, cos theta). SI units.
    """

    count: int
    rocker_length: float
    rocker_mass: float
    coupler_mass: float
    gravity: float

    @property
    def stiffness(self) -> float:
        """theta'' / sin(theta) [1/s2]."""
        rockers, couplers = (self.count + 1) * self.rocker_mass, self.count * self.coupler_mass
        return self.gravity / self.rocker_length * (rockers / 2.0 + couplers) / (rockers / 3.0 + couplers)

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (theta, theta')."""
        return np.array([y[1], self.stiffness * math.sin(y[0])])


@dataclass(frozen=True)
class Pendulum:
    """A01: a point mass on a massless rod, in a vertical plane.

    phi'' = -(g / L) cos phi, phi from the horizontal +x; the mass stands at L (cos phi, sin phi). SI units.
    """

    length: float
    gravity: float

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (phi, phi')."""
        return np.array([y[1], -self.gravity / self.length * math.cos(y[0])])

    def in_closed_form(self, start: float, rate: float, t: Array) -> Array:
        """(n,) phi at times t [s] from `start` [rad] at `rate` [rad/s], by elliptic functions (exact to rounding).

        It is the angle of `PhysicalPendulum.motion` plus that of the lowest position. Raises NoSolution where `motion`
        does.
        """
        if self.gravity == 0.0:
            return start + rate * np.asarray(t)
        lowest = -math.copysign(0.5 * math.pi, self.gravity)
        motion = PhysicalPendulum(math.sqrt(abs(self.gravity) / self.length), start - lowest, rate)
        return motion.motion(t)[0] + lowest


@dataclass(frozen=True)
class SliderCrank:
    """Crank r turns about the origin, rod l, slider on the x axis at r cos(phi) + l cos(psi), l sin(psi) = -r sin(phi).

    Masses in kg, gravity along -y, SI units. Bars are uniform and slender.
    """

    crank: float
    rod: float
    crank_mass: float
    rod_mass: float
    slider_mass: float
    gravity: float

    def rod_angle(self, phi: Jet) -> Jet:
        """Angle of the rod from +x, with derivatives; raises NoSolution when the rod is too short."""
        pin = arm(phi, self.crank)
        sine = -pin.value.imag / self.rod
        if abs(sine) >= 1.0:
            raise NoSolution(f"slider-crank: the rod of {self.rod:g} m cannot follow a crank of {self.crank:g} m.")
        cosine = math.sqrt(1.0 - sine * sine)
        first = -pin.first.imag / (self.rod * cosine)
        second = (-pin.second.imag / self.rod + sine * first * first) / cosine
        return Jet(math.asin(sine), first, second)

    def pose(self, angle: float) -> tuple[Jet, Jet, Jet]:
        """Crank pin, rod angle and slider position (a point) at a crank angle, with derivatives by it."""
        phi = Jet(angle, 1.0, 0.0)
        pin, psi = arm(phi, self.crank), self.rod_angle(phi)
        return pin, psi, pin + arm(psi, self.rod)

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (phi, phi'): J w' + J'/2 w^2 = Q in plain floats, the points of `pose` written out."""
        phi, speed = float(y[0]), float(y[1])
        r, rod, half = self.crank, self.rod, 0.5 * self.rod
        s, c = math.sin(phi), math.cos(phi)
        sine = -r * s / rod
        if abs(sine) >= 1.0:
            raise NoSolution(f"slider-crank: the rod of {rod:g} m cannot follow a crank of {r:g} m.")
        cosine = math.sqrt(1.0 - sine * sine)
        turn = -r * c / (rod * cosine)
        bend = (r * s / rod + sine * turn * turn) / cosine
        # derivatives by phi of e^(i psi), then of the middle of the rod and of the slider
        along, across = -turn * sine, turn * cosine
        along2, across2 = -bend * sine - turn * turn * cosine, bend * cosine - turn * turn * sine
        x, z = -r * s + half * along, r * c + half * across
        x2, z2 = -r * c + half * along2, -r * s + half * across2
        out, out2 = -r * s + rod * along, -r * c + rod * along2
        spin = self.rod_mass * rod * rod / 12.0
        inertia = self.crank_mass * r * r / 3.0 + self.rod_mass * (x * x + z * z) + spin * turn * turn
        inertia += self.slider_mass * out * out
        half_slope = self.rod_mass * (x * x2 + z * z2) + spin * turn * bend + self.slider_mass * out * out2
        force = -self.gravity * (0.5 * self.crank_mass * r * c + self.rod_mass * z)
        return np.array([speed, (force - half_slope * speed * speed) / inertia])

    def states(self, y: Array) -> tuple[Array, Array]:
        """(n, 3) crank angle, rod angle, slider [m], and their rates, along states y (n, 2)."""
        values, rates = [], []
        for angle, speed in y:
            _, psi, slider = self.pose(float(angle))
            values.append([angle, psi.value.real, slider.value.real])
            rates.append([speed, psi.first.real * speed, slider.first.real * speed])
        return np.array(values), np.array(rates)
