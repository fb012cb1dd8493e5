"""A speed law along a length: speed up, travel, brake, so that the end is reached exactly with the wanted speed.

    s(t) = v0 t + a t^2 / 2,  then the top speed v,  then s(t) = L - (ve tau + d tau^2 / 2), tau = T - t

Braking is written from the end, so that s(T) = L to the last bit. An interpolator that gives positions only at multiples of a
period meets the end where T is a multiple of it: `on_ticks` lowers the accelerations until it is.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.bspline.curve import FloatArray
from mechlab.analytic.bspline.travel import braking_distance
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class SpeedLaw:
    """Travel over `length` [m] from start_speed to exit_speed, at most at `speed` [m/s], slowing down with `deceleration` [m/s2].

    start_speed None: the travel begins at `speed`; else `acceleration` [m/s2] leads from one to the other. Where the length is
    too short for `speed`, the top speed is lower. Raises MechlabError for values out of their limits; NoSolution where the length
    is too short to get from start_speed to exit_speed.
    """

    length: float
    speed: float
    deceleration: float
    exit_speed: float = 0.0
    start_speed: float | None = None
    acceleration: float | None = None

    def __post_init__(self) -> None:
        braking_distance(self.speed, self.exit_speed, self.deceleration)
        for name in ("length", "speed"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise MechlabError(f"{name} = {getattr(self, name)!r}; expected a positive finite number.")
        if self.start_speed is not None:
            if not 0.0 <= self.start_speed <= self.speed:
                raise MechlabError(f"start_speed = {self.start_speed:g}; expected 0 to speed = {self.speed:g}.")
            if self.acceleration is None and self.start_speed < self.speed:
                raise MechlabError("acceleration is missing; it leads from start_speed to speed.")
        if self.acceleration is not None and not 0.0 < self.acceleration < np.inf:
            raise MechlabError(f"acceleration = {self.acceleration!r}; expected a positive finite number.")
        if self.top_speed < max(self._first, self.exit_speed):
            far = abs(self._first**2 - self.exit_speed**2)
            rate = self.deceleration if self._first > self.exit_speed else float(self.acceleration or 0.0)
            raise NoSolution(
                f"from {self._first:g} to {self.exit_speed:g} m/s takes {far / (2.0 * rate):.6g} m, the way is only {self.length:.6g} m. "
                "Start slower, or brake harder."
            )

    @property
    def _first(self) -> float:
        """Speed at the start."""
        return self.speed if self.start_speed is None else self.start_speed

    @cached_property
    def top_speed(self) -> float:
        """The largest speed that is reached; below start_speed or exit_speed where the length is too short for any law."""
        if self.start_speed is None or self.acceleration is None:
            fits = braking_distance(self.speed, self.exit_speed, self.deceleration) <= self.length
            return self.speed if fits else 0.0
        a, d = self.acceleration, self.deceleration
        crest = (2.0 * self.length + self._first**2 / a + self.exit_speed**2 / d) / (1.0 / a + 1.0 / d)
        return min(self.speed, math.sqrt(crest))

    @cached_property
    def _times(self) -> tuple[float, float, float]:
        """Durations of speeding up, steady travel and braking [s]."""
        v = self.top_speed
        up = (v - self._first) / self.acceleration if self.acceleration and v > self._first else 0.0
        down = (v - self.exit_speed) / self.deceleration
        left = self.length - 0.5 * up * (v + self._first) - 0.5 * down * (v + self.exit_speed)
        return up, max(0.0, left / v), down

    @property
    def duration(self) -> float:
        """Time T of the arrival [s]."""
        return float(sum(self._times))

    @property
    def braking_time(self) -> float:
        """Time at which braking begins [s]."""
        return self._times[0] + self._times[1]

    @property
    def braking_length(self) -> float:
        """s at which braking begins [m]."""
        return self.length - 0.5 * self._times[2] * (self.top_speed + self.exit_speed)

    def at(self, t: ArrayLike) -> FloatArray:
        """s(t) [m], any shape; 0 before the start and the length after the end."""
        up, _, down = self._times
        now = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        rise = np.minimum(now, up)
        s = self._first * rise + 0.5 * (self.acceleration or 0.0) * rise**2 + self.top_speed * (now - rise)
        left = self.duration - now
        braking = self.length - (self.exit_speed * left + 0.5 * self.deceleration * left**2)
        return np.asarray(np.where(left < down, braking, np.minimum(s, self.length)))

    def rate(self, t: ArrayLike) -> FloatArray:
        """s'(t) [m/s], any shape; at the ends of the travel the speeds there."""
        up, _, down = self._times
        now = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        left = self.duration - now
        slow = np.minimum(self.top_speed, self.exit_speed + self.deceleration * left)
        rising = np.minimum(self.top_speed, self._first + (self.acceleration or 0.0) * now)
        return np.asarray(np.where(left < down, slow, np.where(now < up, rising, self.top_speed)))

    def on_ticks(self, period: float) -> SpeedLaw:
        """The law with both accelerations lowered by one factor, so that the arrival is at the next multiple of `period` [s].

        Raises MechlabError unless the period is positive; NoSolution where lower accelerations do not reach that time, as the speeds
        at the ends are given and the length is short.
        """
        if not 0.0 < period < np.inf:
            raise MechlabError(f"period = {period!r}; expected a positive finite number.")
        ticks = math.ceil(self.duration / period * (1.0 - 1e-12))
        late = ticks * period
        if abs(self.duration - late) <= 1e-12 * late:
            return self

        def softer(share: float) -> SpeedLaw:
            push = None if self.acceleration is None else share * self.acceleration
            return replace(self, deceleration=share * self.deceleration, acceleration=push)

        def early(share: float) -> float:
            return softer(share).duration - late

        least = self._least_share()
        if early(least) < 0.0:
            raise NoSolution(
                f"period = {period:g} s: no law of this kind arrives at a multiple of it; the next, {late:.6g} s, is later than with the "
                f"softest braking, {softer(least).duration:.6g} s. Lower the speed, or take a shorter period."
            )
        return softer(brentq(early, least, 1.0, xtol=1e-16, rtol=1e-15))

    def _least_share(self) -> float:
        """The smallest factor of the accelerations with which the length is enough."""
        if self.start_speed is None or self.acceleration is None:
            low = braking_distance(self.speed, self.exit_speed, self.deceleration) / self.length
        else:
            change = self._first**2 - self.exit_speed**2
            low = abs(change) / (2.0 * self.length * (self.deceleration if change > 0 else self.acceleration))
        return min(1.0, max(low * (1.0 + 1e-12), 1e-9))
