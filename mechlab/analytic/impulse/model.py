"""The inertial-impulse transmission as a model: its parameters, Lagrange's equations and what follows from them.

The equations hold with a motor and at constant input speed. At constant input speed and without a spring there is a
first integral, from which phase portraits follow; with a spring the small oscillations of the output shaft are three
harmonics. Arrays of any shape broadcast.
"""

from __future__ import annotations

import math
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Impulse:
    """An inertial-impulse transmission. Set (4) of the source by default.

    J1, J2 input and output shaft, nJ3 all planets about their geometric centres [kg m2]; nm mass of all planets [kg];
    theta = (a alpha + b beta) / (a + b) is the carrier, a + b the radius of the planet axes; h [m] offset of a planet's
    mass centre; q ratio, a planet turns by psi = q (alpha - beta) on the carrier; load M0 + M1 sign(beta') [N m]; motor
    tau Md' = Mn - Md - (alpha' - nominal_speed) / (slip_per_torque no_load_speed), slip_per_torque [1/(N m)], None: the
    value for which the torque vanishes at the no-load speed; c [N m/rad] spring from the output shaft to the frame.
    Raises MechlabError for values that no mechanism can have.
    """

    J1: float = 14.0
    J2: float = 0.5
    nJ3: float = 0.25
    nm: float = 8.0
    a: float = 0.02
    b: float = 0.08
    h: float = 0.083
    q: float = 4.0 / 3.0
    M0: float = 18.0
    M1: float = 750.0
    Mn: float = 150.0
    no_load_speed: float = 220.0
    nominal_speed: float = 215.0
    tau: float = 0.038
    slip_per_torque: float | None = None
    c: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            x = getattr(self, f.name)
            if x is not None and not math.isfinite(x):
                raise MechlabError(f"impulse: {f.name} must be finite, got {x!r}.")
        if not self.a + self.b > 0:
            raise MechlabError(f"impulse: the radius of the planet axes a + b must be > 0 m, got {self.a + self.b:g}.")
        if self.q == 0:
            raise MechlabError("impulse: the ratio q must not be 0: planets that do not turn give no impulses.")
        least = self.nm * self.h**2
        if self.nJ3 < least * (1.0 - 1e-12):
            raise MechlabError(
                f"impulse: nJ3 = {self.nJ3:g} kg m2 is less than nm h^2 = {least:g}: nJ3 counts about the geometric centre "
                "of the planets and contains the offset of their mass centre. Take a larger nJ3 or a smaller h."
            )
        for name in ("M0", "M1", "nm", "J1", "J2", "tau", "c"):
            if getattr(self, name) < 0:
                raise MechlabError(f"impulse: {name} must be >= 0, got {getattr(self, name):g}.")
        if self.no_load_speed == 0 or self.Mn == 0 or not self.slip > 0:
            raise MechlabError(
                f"impulse: the motor needs a falling characteristic: slip_per_torque = {self.slip_per_torque!r}, "
                f"no_load_speed = {self.no_load_speed:g}, nominal_speed = {self.nominal_speed:g}, Mn = {self.Mn:g} "
                "do not give one. With Mn > 0 the nominal speed lies below the no-load speed."
            )

    @property
    def k(self) -> float:
        """Radius of the planet axes a + b [m]."""
        return self.a + self.b

    @property
    def consistent_slip(self) -> float:
        """The slip per torque [1/(N m)] with which the motor torque vanishes at the no-load speed."""
        if self.Mn == 0 or self.no_load_speed == 0:
            return math.nan
        return (1.0 - self.nominal_speed / self.no_load_speed) / self.Mn

    @property
    def slip(self) -> float:
        """The slip per torque that is used [1/(N m)]."""
        return self.consistent_slip if self.slip_per_torque is None else self.slip_per_torque

    @cached_property
    def speed_per_torque(self) -> float:
        """Loss of speed of the motor per torque in the steady state [rad/(N m s)]."""
        return self.slip * self.no_load_speed

    @cached_property
    def output(self) -> OutputConstants:
        """The constants of the equation of the output shaft."""
        g = self.b / self.k - self.q
        B3, bh = self.J2 + self.nm * self.b**2 + g**2 * self.nJ3, self.nm * self.b * self.h
        return OutputConstants(B3, 2.0 * bh * g, bh * g * self.q, self.nm * self.k * self.h * self.q)

    @cached_property
    def inertias(self) -> tuple[float, ...]:
        """Constants of A1, A2, A3, their factors of cos psi, and the factors of sin psi of A4, A5, A6 [kg m2]."""
        f, g, unbalance = self.a / self.k + self.q, self.b / self.k - self.q, self.nm * self.h
        return (
            self.J1 + self.nm * self.a**2 + f**2 * self.nJ3,
            self.nm * self.a * self.b + f * g * self.nJ3,
            self.J2 + self.nm * self.b**2 + g**2 * self.nJ3,
            2.0 * unbalance * self.a * f,
            unbalance * (2.0 * self.a * self.b / self.k + (self.b - self.a) * self.q),
            2.0 * unbalance * self.b * g,
            -unbalance * self.a * f * self.q,
            unbalance * self.b * g * self.q,
            unbalance * self.k * self.q,
        )


@dataclass(frozen=True)
class OutputConstants:
    """A3 = B3 + b3 cos psi, A5 = a5 sin psi, A6 = a6 sin psi; b3 q / 2 = a5."""

    B3: float
    b3: float
    a5: float
    a6: float


def shape(p: Impulse) -> OutputConstants:
    """The constants of the equation of the output shaft."""
    return p.output


def first_integral(p: Impulse, speed: float, psi: ArrayLike, slip: ArrayLike, resisting: ArrayLike) -> Array:
    """E = (q/2) A3(psi) s^2 - R psi - a6 w^2 cos psi [N m], constant while the resisting torque R is.

    slip s = w - beta' (...) [rad/s]; psi (...) [rad], not reduced modulo 2 pi. Holds for c = 0; raises MechlabError else.
    """
    _no_spring(p)
    s = shape(p)
    psi, slip = np.asarray(psi, dtype=float), np.asarray(slip, dtype=float)
    inertia = s.B3 + s.b3 * np.cos(psi)
    return np.asarray(0.5 * p.q * inertia * slip**2 - np.asarray(resisting) * psi - s.a6 * speed**2 * np.cos(psi))


def slip_speed(p: Impulse, speed: float, psi: ArrayLike, energy: ArrayLike, resisting: ArrayLike) -> Array:
    """s = w - beta' >= 0 [rad/s] at psi where the first integral is `energy` [N m]; NaN if no such motion is there."""
    _no_spring(p)
    s = shape(p)
    psi = np.asarray(psi, dtype=float)
    square = 2.0 * (np.asarray(energy) + np.asarray(resisting) * psi + s.a6 * speed**2 * np.cos(psi))
    square = square / (p.q * (s.B3 + s.b3 * np.cos(psi)))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(square))


def _no_spring(p: Impulse) -> None:
    if p.c != 0.0:
        raise MechlabError(f"impulse: the first integral needs c = 0, got {p.c:g} N m/rad; integrate instead.")


def angles(p: Impulse, alpha: ArrayLike, beta: ArrayLike) -> tuple[Array, Array]:
    """Carrier angle theta = (a alpha + b beta) / k and planet angle on the carrier psi = q (alpha - beta) [rad]."""
    alpha, beta = np.asarray(alpha, dtype=float), np.asarray(beta, dtype=float)
    return np.asarray((p.a * alpha + p.b * beta) / p.k), np.asarray(p.q * (alpha - beta))


def coefficients(p: Impulse, psi: ArrayLike) -> tuple[Any, Any, Any, Any, Any, Any]:
    """A1 ... A6 [kg m2] of equations (2) at the planet angle psi (...) [rad]: arrays, or floats for a float.

    T = A1 alpha'^2 / 2 + A2 alpha' beta' + A3 beta'^2 / 2; 2 A4 = dA1/dalpha, 2 A5 = dA3/dbeta.
    """
    # A float, in the loop of an integration, is much faster when it stays one.
    cos, sin = (math.cos(psi), math.sin(psi)) if isinstance(psi, float) else (np.cos(psi), np.sin(psi))
    k1, k2, k3, c1, c2, c3, s4, s5, s6 = p.inertias
    return k1 + c1 * cos, k2 + c2 * cos, k3 + c3 * cos, s4 * sin, s5 * sin, s6 * sin


def load(p: Impulse, rate: ArrayLike) -> Array:
    """Mc = M0 + M1 sign(beta') [N m]; at standstill M0, the middle of its interval."""
    return np.asarray(p.M0 + p.M1 * np.sign(rate))


def accelerations(
    p: Impulse,
    alpha: ArrayLike,
    beta: ArrayLike,
    alpha_rate: ArrayLike,
    beta_rate: ArrayLike,
    motor: ArrayLike,
    resisting: ArrayLike,
) -> tuple[Array, Array]:
    """alpha'' and beta'' [rad/s2] under a motor torque and a resisting torque on the output shaft [N m] (Lagrange).

    A1 alpha'' + A2 beta'' + A4 (alpha' - beta')^2 + A6 beta'^2 = motor
    A2 alpha'' + A3 beta'' + A5 (alpha' - beta')^2 - A6 alpha'^2 + c beta = -resisting
    """
    first, second = _accelerations(p, *(_plain(x) for x in (alpha, beta, alpha_rate, beta_rate, motor, resisting)))
    return np.asarray(first), np.asarray(second)


def _accelerations(p: Impulse, alpha: Any, beta: Any, u: Any, v: Any, motor: Any, resisting: Any) -> tuple[Any, Any]:
    """`accelerations` of arrays, or of floats, which stay floats."""
    A1, A2, A3, A4, A5, A6 = coefficients(p, p.q * (alpha - beta))
    square = (u - v) ** 2
    one = motor - A4 * square - A6 * v * v
    two = -resisting - A5 * square + A6 * u * u - p.c * beta
    det = A1 * A3 - A2 * A2
    return (A3 * one - A2 * two) / det, (A1 * two - A2 * one) / det


def motor_rate(p: Impulse, alpha_rate: ArrayLike, motor: ArrayLike) -> Array:
    """dMd/dt [N m/s] of the motor; with tau = 0 the torque has no rate: use `motor_torque_at`."""
    return np.asarray((motor_torque_at(p, alpha_rate) - _plain(motor)) / p.tau)


def motor_torque_at(p: Impulse, alpha_rate: ArrayLike) -> Any:
    """Torque [N m] of the static characteristic at a speed [rad/s]: an array, or a float for a float."""
    return p.Mn - (_plain(alpha_rate) - p.nominal_speed) / p.speed_per_torque


def slope(p: Impulse, state: ArrayLike, width: float = 0.0) -> Array:
    """(..., 5) time derivative of (alpha, beta, alpha', beta', Md).

    width [rad/s]: dry friction is M1 tanh(beta' / width); 0: M1 sign(beta'), which a solver without events cannot follow
    through sticking.
    """
    y = np.asarray(state, dtype=float)
    if y.ndim == 1:  # one state, in the loop of an integration
        alpha, beta, u, v, motor = y.tolist()
        sign = math.tanh(v / width) if width else math.copysign(1.0, v) if v else 0.0
        found = _accelerations(p, alpha, beta, u, v, motor, p.M0 + p.M1 * sign)
        return np.array([u, v, *found, (motor_torque_at(p, u) - motor) / p.tau])
    alpha, beta, u, v, motor = (y[..., k] for k in range(5))
    resisting = load(p, v) if width == 0.0 else p.M0 + p.M1 * np.tanh(v / width)
    out = np.empty_like(y)  # in the order of y in memory
    out[..., 0], out[..., 1] = u, v
    out[..., 2], out[..., 3] = accelerations(p, alpha, beta, u, v, motor, resisting)
    out[..., 4] = motor_rate(p, u, motor)
    return out


def constant_speed_acceleration(
    p: Impulse, speed: float, psi: ArrayLike, beta_rate: ArrayLike, resisting: ArrayLike, beta: ArrayLike = 0.0
) -> Array:
    """beta'' [rad/s2] at constant input speed [rad/s]: A3 beta'' = -resisting - A5 (w - beta')^2 + A6 w^2 - c beta."""
    return np.asarray(even_acceleration(p, speed, *(_plain(x) for x in (psi, beta_rate, resisting, beta))))


def even_acceleration(p: Impulse, speed: float, psi: Any, v: Any, resisting: Any, beta: Any) -> Any:
    """`constant_speed_acceleration` of arrays, or of floats, which stay floats."""
    s = p.output
    cos, sin = (math.cos(psi), math.sin(psi)) if isinstance(psi, float) else (np.cos(psi), np.sin(psi))
    force = -resisting - s.a5 * sin * (speed - v) ** 2 + s.a6 * sin * speed**2 - p.c * beta
    return force / (s.B3 + s.b3 * cos)


def constant_speed_torque(p: Impulse, speed: float, psi: ArrayLike, beta_rate: ArrayLike, beta_accel: ArrayLike) -> Any:
    """Torque [N m] that keeps the input speed constant: A2 beta'' + A4 (w - beta')^2 + A6 beta'^2; an array, or a float
    for floats."""
    _, A2, _, A4, _, A6 = coefficients(p, psi)
    v = _plain(beta_rate)
    return A2 * _plain(beta_accel) + A4 * (speed - v) ** 2 + A6 * v * v


def _plain(x: ArrayLike) -> Any:
    """`x` itself if it is a float, else an array."""
    return x if isinstance(x, float) else np.asarray(x, dtype=float)


KINDS = ("printed", "consistent")


def harmonic_amplitudes(p: Impulse, speed: float, kind: str = "consistent") -> tuple[float, float, float]:
    """Amplitudes [rad] of sin qwt, sin 2qwt, sin 3qwt of beta for M0 = M1 = 0, c > 0.

    "consistent" keeps every term of the third order; "printed" is the source's D1 and D3, which keep A5 beta'^2 only.
    Raises MechlabError for another kind. Not valid where b3 and a5 are comparable to B3, and near `resonances`.
    """
    if kind not in KINDS:
        raise unknown("kind of harmonics", kind, KINDS)
    s, w, q = shape(p), speed, p.q
    stiff = [p.c - m * m * s.B3 * q**2 * w**2 for m in (1, 2, 3)]
    D0 = (s.a6 - s.a5) * w**2 / stiff[0]
    D2 = 0.5 * q * w**2 * D0 * (3.0 * s.a5 - s.a6 + q * s.b3) / stiff[1]
    if kind == "printed":
        force = 0.25 * s.a5 * D0**2 * q**2 * w**2
        return D0 - force / stiff[0], D2, -force / stiff[2]
    square, cross, beat = D0**2 * w**2 * q**2, D2 * q * w**2, 0.5 * (s.a5 - s.a6)
    F1 = 0.375 * square * (2.0 * s.b3 * q - s.a5 - s.a6) + cross * (2.0 * s.b3 * q - 2.0 * s.a5 + beat)
    F3 = -0.125 * square * (7.0 * s.a5 - s.a6 + 2.0 * s.b3 * q) + cross * (2.0 * s.b3 * q + 2.0 * s.a5 + beat)
    return D0 + F1 / stiff[0], D2, F3 / stiff[2]


def harmonic_motion(p: Impulse, speed: float, t: ArrayLike, kind: str = "consistent") -> tuple[Array, Array]:
    """beta and beta' (...) at times t (...) [s] of the three harmonics; psi = 0 at t = 0."""
    amplitudes = harmonic_amplitudes(p, speed, kind)
    phase = p.q * speed * np.asarray(t, dtype=float)
    beta = sum(d * np.sin((m + 1) * phase) for m, d in enumerate(amplitudes))
    rate = sum((m + 1) * p.q * speed * d * np.cos((m + 1) * phase) for m, d in enumerate(amplitudes))
    return np.asarray(beta), np.asarray(rate)


def resonances(p: Impulse, speed: float) -> tuple[float, float, float]:
    """c / (m^2 B3 q^2 w^2) for m = 1, 2, 3: near 1 the m-th harmonic is in resonance."""
    base = shape(p).B3 * p.q**2 * speed**2
    return p.c / base, p.c / (4.0 * base), p.c / (9.0 * base)
