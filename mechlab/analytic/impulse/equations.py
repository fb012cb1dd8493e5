"""Lagrange's equations of the transmission, with a motor and at constant input speed, and the small oscillations of the output
shaft on its spring as three harmonics. Arrays of any shape broadcast.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.impulse.model import Impulse, shape
from mechlab.errors import unknown

Array = NDArray[np.float64]


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
    f, g, unbalance = p.a / p.k + p.q, p.b / p.k - p.q, p.nm * p.h
    A1 = p.J1 + p.nm * p.a**2 + f**2 * p.nJ3 + 2.0 * unbalance * p.a * f * cos
    A2 = p.nm * p.a * p.b + f * g * p.nJ3 + unbalance * (2.0 * p.a * p.b / p.k + (p.b - p.a) * p.q) * cos
    A3 = p.J2 + p.nm * p.b**2 + g**2 * p.nJ3 + 2.0 * unbalance * p.b * g * cos
    A4 = -unbalance * p.a * f * p.q * sin
    A5 = unbalance * p.b * g * p.q * sin
    A6 = unbalance * p.k * p.q * sin
    return A1, A2, A3, A4, A5, A6


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
    u, v = np.asarray(alpha_rate, dtype=float), np.asarray(beta_rate, dtype=float)
    A1, A2, A3, A4, A5, A6 = coefficients(p, angles(p, alpha, beta)[1])
    square = (u - v) ** 2
    one = motor - A4 * square - A6 * v * v
    two = -np.asarray(resisting) - A5 * square + A6 * u * u - p.c * np.asarray(beta)
    det = A1 * A3 - A2 * A2
    return np.asarray((A3 * one - A2 * two) / det), np.asarray((A1 * two - A2 * one) / det)


def motor_rate(p: Impulse, alpha_rate: ArrayLike, motor: ArrayLike) -> Array:
    """dMd/dt [N m/s] of the motor; with tau = 0 the torque has no rate: use `motor_torque_at`."""
    return np.asarray((motor_torque_at(p, alpha_rate) - np.asarray(motor)) / p.tau)


def motor_torque_at(p: Impulse, alpha_rate: ArrayLike) -> Any:
    """Torque [N m] of the static characteristic at a speed [rad/s]: an array, or a float for a float."""
    return p.Mn - (_plain(alpha_rate) - p.nominal_speed) / p.speed_per_torque


def slope(p: Impulse, state: ArrayLike, width: float = 0.0) -> Array:
    """(..., 5) time derivative of (alpha, beta, alpha', beta', Md).

    width [rad/s]: dry friction is M1 tanh(beta' / width); 0: M1 sign(beta'), which a solver without events cannot follow
    through sticking.
    """
    y = np.asarray(state, dtype=float)
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
    s = shape(p)
    v, sin = np.asarray(beta_rate, dtype=float), np.sin(psi)
    force = -np.asarray(resisting) - s.a5 * sin * (speed - v) ** 2 + s.a6 * sin * speed**2 - p.c * np.asarray(beta)
    return np.asarray(force / (s.B3 + s.b3 * np.cos(psi)))


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
