"""A rest-to-rest motion with bounded speed, acceleration and jerk: seven phases of constant jerk."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from mechlab.analytic.bspline.curve import FloatArray
from mechlab.errors import MechlabError

SIGNS = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


@dataclass(frozen=True)
class Ramp:
    """The fastest motion from rest to rest over `length` with |s'| <= speed, |s''| <= acceleration, |s'''| <= jerk.

    A way too short for the full speed or acceleration reaches less of them. Raises MechlabError unless all four are
    positive and finite.
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
        """Length of speeding up and slowing down, which are mirror images."""
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
