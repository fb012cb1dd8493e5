"""The transmission under dry friction as problems for `mechlab.integrate.integrate_hybrid`: with the motor over time, and at
constant input speed over the planet angle. Mode of the output shaft: 1 forward, -1 back, 0 stuck.
"""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.impulse.model import (
    Array,
    Impulse,
    coefficients,
    constant_speed_torque,
    motor_torque_at,
    shape,
)

Modes = tuple[int, ...]


class WithMotor:
    """State (alpha, beta, alpha', beta', Md) over time: order 5, friction M1 on the output shaft."""

    def __init__(self, p: Impulse, static_motor: bool = False) -> None:
        self.p, self.static = p, static_motor
        self.limits, self.rates = _friction(p, 5, 3)

    def _parts(self, y: Array) -> tuple[float, ...]:
        """A1, A2, A3, the right sides without friction, the two rates and the motor torque, as floats."""
        p = self.p
        alpha, beta, u, v, motor = y.tolist()
        A1, A2, A3, A4, A5, A6 = coefficients(p, p.q * (alpha - beta))
        motor = motor_torque_at(p, u) if self.static else motor
        square = (u - v) ** 2
        return A1, A2, A3, motor - A4 * square - A6 * v * v, -p.M0 - A5 * square + A6 * u * u - p.c * beta, u, v, motor

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(5,) dy/dt."""
        A1, A2, A3, one, two, u, v, motor = self._parts(y)
        if modes and modes[0] == 0:
            du, dv = one / A1, 0.0
        else:
            two -= modes[0] * self.p.M1 if modes else 0.0
            det = A1 * A3 - A2 * A2
            du, dv = (A3 * one - A2 * two) / det, (A1 * two - A2 * one) / det
        dm = 0.0 if self.static else (motor_torque_at(self.p, u) - motor) / self.p.tau
        return np.array([u, v, du, dv, dm])

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(1,) friction torque on the output shaft [N m]."""
        if modes[0]:
            return np.array([-modes[0] * self.p.M1])
        A1, A2, _, one, two = self._parts(y)[:5]
        return np.array([A2 * one / A1 - two])

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the output shaft at rest, beta' = 0; all else is unchanged."""
        return _at_rest(y, 3)


class ConstantSpeed:
    """State (beta, beta', t, integral of the motor torque) at constant input speed w, over psi instead of time.

    dpsi/dt = q (w - beta'), so that one cycle is psi + 2 pi exactly and needs no event of its own.
    """

    def __init__(self, p: Impulse, speed: float) -> None:
        self.p, self.speed, self.shape = p, speed, shape(p)
        self.limits, self.rates = _friction(p, 4, 1)

    def _force(self, psi: float, beta: float, v: float) -> float:
        s, w, sin = self.shape, self.speed, math.sin(psi)
        return -self.p.M0 - s.a5 * sin * (w - v) ** 2 + s.a6 * sin * w * w - self.p.c * beta

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(4,) dy/dpsi; NaN where the output shaft has caught up with the input shaft, so that psi stands still."""
        beta, v = y.tolist()[:2]
        inertia = self.shape.B3 + self.shape.b3 * math.cos(t)
        stuck = bool(modes) and modes[0] == 0
        friction = modes[0] * self.p.M1 if modes else 0.0
        accel = 0.0 if stuck else (self._force(t, beta, v) - friction) / inertia
        torque = constant_speed_torque(self.p, self.speed, float(t), v, accel)
        pace = self.p.q * (self.speed - v)
        return np.array([v, accel, 1.0, torque]) / pace if pace > 0.0 else np.full(4, np.nan)

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(1,) friction torque on the output shaft [N m]."""
        return np.array([-modes[0] * self.p.M1 if modes[0] else -self._force(t, float(y[0]), 0.0)])

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the output shaft at rest, beta' = 0; all else is unchanged."""
        return _at_rest(y, 1)


def _friction(p: Impulse, states: int, row: int) -> tuple[Array, Array]:
    """Limit (1,) and rate row (1, states) of the friction on the output shaft, whose rate is state `row`; empty without it."""
    rough = int(p.M1 > 0.0)
    return np.full(rough, p.M1), np.eye(states)[row : row + rough]


def _at_rest(y: Array, row: int) -> Array:
    out = y.copy()
    out[row] = 0.0
    return out
