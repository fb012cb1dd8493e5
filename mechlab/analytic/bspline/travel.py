"""Travel along a curve: the fastest time law from rest to rest with bounded speed, acceleration and jerk (seven phases of
constant jerk), the parameter at an arc length, and where braking begins.
"""

from __future__ import annotations

from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.bspline.curve import BSpline, FloatArray
from mechlab.analytic.bspline.length import fine_pieces, integrals
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

SIGNS = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


@dataclass(frozen=True)
class SpeedRamp:
    """The fastest motion from rest to rest over `length` with |s'| <= speed, |s''| <= acceleration, |s'''| <= jerk.

    Where `length` is too short for full speed or acceleration, the motion stays below them. Raises MechlabError unless
    all four are positive and finite.
    """

    length: float
    speed: float
    acceleration: float
    jerk: float

    def __post_init__(self) -> None:
        for name in ("length", "speed", "acceleration", "jerk"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise MechlabError(f"ramp: {name} = {value!r}; expected a positive finite number.")

    def _rise(self, speed: float) -> tuple[float, float]:
        """Time at full jerk and at full acceleration from rest to a speed."""
        if speed * self.jerk < self.acceleration**2:
            return sqrt(speed / self.jerk), 0.0
        return self.acceleration / self.jerk, speed / self.acceleration - self.acceleration / self.jerk

    def _way(self, speed: float) -> float:
        """Length of speeding up to `speed` and slowing down again, which are mirror images."""
        bend, steady = self._rise(speed)
        return speed * (2.0 * bend + steady)

    @cached_property
    def top_speed(self) -> float:
        """The largest speed that is reached."""
        if self._way(self.speed) <= self.length:
            return self.speed
        return float(brentq(lambda v: self._way(v) - self.length, 0.0, self.speed, xtol=1e-15 * self.speed, rtol=1e-14))

    @cached_property
    def _phases(self) -> tuple[FloatArray, FloatArray]:
        """Times at which the phases begin and end (8,), and s, s', s'' there (8, 3)."""
        bend, steady = self._rise(self.top_speed)
        cruise = max(0.0, (self.length - self._way(self.top_speed)) / self.top_speed)
        times = np.concatenate([[0.0], np.cumsum([bend, steady, bend, cruise, bend, steady, bend])])
        states = np.zeros((8, 3))
        for k, j in enumerate(SIGNS * self.jerk):
            states[k + 1] = _advance(states[k], j, times[k + 1] - times[k])
        return times, states

    @property
    def duration(self) -> float:
        """Time from rest to rest."""
        return float(self._phases[0][-1])

    def at(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """s (order 0), s', s'' or s''' (order 3) at times t, any shape; at rest before and after."""
        times, states = self._phases
        v = np.clip(np.asarray(t, dtype=np.float64), 0.0, times[-1])
        k = np.clip(np.searchsorted(times, v, side="right") - 1, 0, 6)
        jerk = SIGNS[k] * self.jerk
        if order == 3:
            return np.asarray(jerk)
        moved = _advance(np.moveaxis(states[k], -1, 0), jerk, v - times[k])
        return np.asarray(moved[order])


def _advance(state: FloatArray, jerk: ArrayLike, h: ArrayLike) -> FloatArray:
    """s, s', s'' after h at a constant jerk."""
    s, v, a = state
    j, x = np.asarray(jerk), np.asarray(h)
    return np.array([s + x * (v + x * (a / 2 + x * j / 6)), v + x * (a + x * j / 2), a + x * j])


ITERATIONS = 60


@dataclass(frozen=True)
class Travel:
    """Arc length s and parameter u of a curve, one from the other. The table has one entry for each smooth piece."""

    curve: BSpline

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray]:
        pieces = fine_pieces(self.curve)
        lengths = integrals(self.curve, pieces)
        return pieces, np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def length(self) -> float:
        """Length of the curve."""
        return float(self._table[1][-1])

    def length_at(self, u: ArrayLike) -> FloatArray:
        """s(u), any shape; u is clipped to the curve."""
        pieces, sums = self._table
        v = np.clip(np.asarray(u, dtype=np.float64), self.curve.start, self.curve.end)
        k = np.clip(np.searchsorted(pieces[:, 2], v.ravel()), 0, len(pieces) - 1)
        part = pieces[k].copy()
        part[:, 2] = v.ravel()
        return np.asarray((sums[k] + integrals(self.curve, part)).reshape(v.shape))

    def parameter_at(self, s: ArrayLike) -> FloatArray:
        """u(s), any shape: Newton from the secant of its piece, kept inside a bracket that bisection shrinks, so that a
        cusp, where du/ds is unbounded, does no harm. Raises MechlabError for s outside the curve."""
        pieces, sums = self._table
        wanted = np.asarray(s, dtype=np.float64)
        if np.any(wanted < -1e-9 * sums[-1]) or np.any(wanted > (1 + 1e-9) * sums[-1]):
            raise MechlabError(
                f"s: expected 0 to {sums[-1]:.10g}, got {float(wanted.min()):.10g} to {float(wanted.max()):.10g}."
            )
        flat = np.clip(wanted.ravel(), 0.0, sums[-1])
        k = np.clip(np.searchsorted(sums, flat, side="right") - 1, 0, len(pieces) - 1)
        low, high = pieces[k, 1].copy(), pieces[k, 2].copy()
        rise = sums[k + 1] - sums[k]
        u = low + (high - low) * np.divide(flat - sums[k], rise, out=np.zeros(len(flat)), where=rise > 0)
        u = np.where(flat >= sums[k + 1], high, u)  # an end of a piece is met to the last bit
        for _ in range(ITERATIONS):
            part = pieces[k].copy()
            part[:, 2] = u
            miss = sums[k] + integrals(self.curve, part) - flat
            low, high = np.where(miss < 0, u, low), np.where(miss > 0, u, high)
            speed = self.curve.speed(u)
            newton = u - np.divide(miss, speed, out=np.full(len(u), np.inf), where=speed > 0)
            inside = (newton > low) & (newton < high)
            following = np.where(miss == 0.0, u, np.where(inside, newton, 0.5 * (low + high)))
            done = np.abs(following - u) <= 4 * np.finfo(float).eps * np.maximum(1.0, np.abs(u))
            u = following
            if done.all():
                break
        return np.asarray(u.reshape(wanted.shape))


@dataclass(frozen=True)
class Braking:
    """Where braking begins: distance before the end, arc length and parameter there, the point."""

    distance: float
    length: float
    parameter: float
    point: FloatArray


def braking_distance(speed: float, exit_speed: float, deceleration: float) -> float:
    """(v^2 - ve^2) / (2 a). Raises MechlabError unless v >= ve >= 0 and a > 0."""
    for name, value, good in (
        ("exit_speed", exit_speed, exit_speed >= 0.0), ("speed", speed, speed >= exit_speed),
        ("deceleration", deceleration, deceleration > 0.0),
    ):  # fmt: skip
        if not good or not np.isfinite(value):
            wanted = {
                "exit_speed": "at least 0",
                "speed": f"at least exit_speed = {exit_speed:g}",
                "deceleration": "more than 0",
            }
            raise MechlabError(f"{name} = {value:g}; expected a finite number, {wanted[name]}.")
    return (speed**2 - exit_speed**2) / (2.0 * deceleration)


def braking(
    curve: BSpline, speed: float, exit_speed: float, deceleration: float, travel: Travel | None = None
) -> Braking:
    """Where to begin to brake from `speed` to reach the end with `exit_speed`: s = L - (v^2 - ve^2) / (2 a).

    Raises NoSolution when the curve is shorter than that, MechlabError as `braking_distance`.
    """
    run = travel or Travel(curve)
    distance = braking_distance(speed, exit_speed, deceleration)
    if distance > run.length:
        fastest = np.sqrt(exit_speed**2 + 2.0 * deceleration * run.length)
        raise NoSolution(
            f"braking from {speed:g} to {exit_speed:g} takes {distance:.6g}, the curve is only {run.length:.6g} long; "
            f"the fastest start on it is {fastest:.6g}. Slow down, or brake harder."
        )
    s = run.length - distance
    u = float(run.parameter_at(s))
    return Braking(distance, s, u, curve.at(u))
