"""The closed-form equations as problems of dry friction, for `mechlab.integrate.integrate_hybrid`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mechlab.analytic.impulse import Impulse, coefficients, constant_speed_torque, motor_torque_at, shape
from mechlab.integrate import Event, integrate_hybrid
from mechlab.mechanism.geometry import Array

Modes = tuple[int, ...]


class WithMotor:
    """State (alpha, beta, alpha', beta', Md): order 5, friction M1 on the output shaft."""

    def __init__(self, p: Impulse, static_motor: bool = False) -> None:
        self.p, self.static = p, static_motor
        rough = p.M1 > 0.0
        self.limits = np.array([p.M1] if rough else [])
        self.rates = np.array([[0.0, 0.0, 0.0, 1.0, 0.0]] if rough else []).reshape(-1, 5)

    def _parts(self, y: Array) -> tuple[float, ...]:
        p = self.p
        A1, A2, A3, A4, A5, A6 = coefficients(p, p.q * float(y[0] - y[1]))
        u, v = float(y[2]), float(y[3])
        motor = motor_torque_at(p, u) if self.static else float(y[4])
        square = (u - v) ** 2
        return A1, A2, A3, motor - A4 * square - A6 * v * v, -p.M0 - A5 * square + A6 * u * u - p.c * float(y[1])

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(5,) dy/dt."""
        A1, A2, A3, one, two = self._parts(y)
        if modes and modes[0] == 0:
            du, dv = one / A1, 0.0
        else:
            two -= modes[0] * self.p.M1 if modes else 0.0
            det = A1 * A3 - A2 * A2
            du, dv = (A3 * one - A2 * two) / det, (A1 * two - A2 * one) / det
        dm = 0.0 if self.static else (motor_torque_at(self.p, float(y[2])) - y[4]) / self.p.tau
        return np.array([y[2], y[3], du, dv, dm])

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(1,) friction torque on the output shaft."""
        if modes[0]:
            return np.array([-modes[0] * self.p.M1])
        A1, A2, _, one, two = self._parts(y)
        return np.array([A2 * one / A1 - two])

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the output shaft at rest, beta' = 0; all else is unchanged."""
        out = y.copy()
        out[3] = 0.0
        return out


class ConstantSpeed:
    """At constant input speed, over psi instead of time: state (beta, beta', t, integral of the motor torque).

    dpsi/dt = q (w - beta'), so that one cycle is psi + 2 pi exactly and needs no event of its own.
    """

    def __init__(self, p: Impulse, speed: float) -> None:
        self.p, self.speed, self.shape = p, speed, shape(p)
        rough = p.M1 > 0.0
        self.limits = np.array([p.M1] if rough else [])
        self.rates = np.array([[0.0, 1.0, 0.0, 0.0]] if rough else []).reshape(-1, 4)

    def _force(self, psi: float, beta: float, v: float) -> float:
        s, w, sin = self.shape, self.speed, math.sin(psi)
        return -self.p.M0 - s.a5 * sin * (w - v) ** 2 + s.a6 * sin * w * w - self.p.c * beta

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(4,) dy/dpsi."""
        v = float(y[1])
        inertia = self.shape.B3 + self.shape.b3 * math.cos(t)
        stuck = bool(modes) and modes[0] == 0
        friction = modes[0] * self.p.M1 if modes else 0.0
        accel = 0.0 if stuck else (self._force(t, float(y[0]), v) - friction) / inertia
        torque = constant_speed_torque(self.p, self.speed, float(t), v, accel)
        pace = self.p.q * (self.speed - v)
        if not pace > 0.0:
            return np.full(4, np.nan)  # the output shaft has caught up with the input shaft: psi stands still
        return np.array([v, accel, 1.0, torque]) / pace

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(1,) friction torque on the output shaft."""
        return np.array([-modes[0] * self.p.M1 if modes[0] else -self._force(t, float(y[0]), 0.0)])

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state at rest."""
        out = y.copy()
        out[1] = 0.0
        return out


@dataclass(frozen=True)
class Cycle:
    """`turns` cycles of the planets: output speed before and after, times, angle and events over all of them."""

    start: float
    end: float
    time: float
    angle: float
    torque_integral: float
    forward_time: float
    return_time: float
    stuck_psi: float
    evaluations: int
    complete: bool
    events: tuple[Event, ...] = field(default=(), repr=False)


def cycle(p: Impulse, speed: float, start: float, turns: int = 1, section: float = 0.0, rtol: float = 1e-12) -> Cycle:
    """Follow psi from `section` through whole turns from the output speed `start` [rad/s], through all sticking."""
    problem = ConstantSpeed(p, speed)
    done = integrate_hybrid(
        problem, [0.0, start, 0.0, 0.0], [section, section + 2.0 * math.pi * turns], rtol=rtol, atol=1e-14,
    )  # fmt: skip
    beta, v, t, impulse = (float(x) for x in done.last_y)
    spent = {1: 0.0, 0: 0.0, -1: 0.0}
    mode, at = (int(done.modes[0][0]) if problem.limits.size else int(np.sign(start))), 0.0
    for event in done.events:
        spent[mode] += float(event.y[2]) - at
        mode, at = event.after, float(event.y[2])
    spent[mode] += t - at
    return Cycle(
        start, v, t, beta, impulse, spent[1], spent[-1], float(done.stuck_time.sum()), done.evaluations, done.complete,
        done.events,
    )  # fmt: skip
