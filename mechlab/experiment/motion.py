"""Prescribed motions as data, for servos and computed-torque laws. Each gives value, rate and acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from mechlab.errors import MechlabError


class PrescribedMotion(Protocol):
    """A twice differentiable function of time."""

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and acceleration at time t [s]."""
        ...


@dataclass(frozen=True)
class Hold:
    """Stands still at `value`."""

    value: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, 0, 0."""
        return self.value, 0.0, 0.0


@dataclass(frozen=True)
class Ramp:
    """Moves from `value` at constant `rate`."""

    value: float = 0.0
    rate: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate, 0."""
        return self.value + self.rate * t, self.rate, 0.0


@dataclass(frozen=True)
class Sine:
    """offset + amplitude sin(frequency t + phase); `frequency` in rad/s."""

    amplitude: float
    frequency: float
    phase: float = 0.0
    offset: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and acceleration at time t [s]."""
        w = self.frequency
        s, c = math.sin(w * t + self.phase), math.cos(w * t + self.phase)
        return self.offset + self.amplitude * s, self.amplitude * w * c, -self.amplitude * w * w * s


@dataclass(frozen=True)
class Spline:
    """A twice differentiable spline through `values` at `times` [s]: quintic from six points on, else cubic."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.values) or len(self.times) < 3:
            raise MechlabError(
                f"motion table: expected at least 3 times and as many values, got {len(self.times)} and {len(self.values)}."
            )
        if not np.all(np.diff(self.times) > 0):
            raise MechlabError("motion table: times must increase.")

    @cached_property
    def _spline(self) -> tuple[object, object, object]:
        from scipy.interpolate import make_interp_spline

        spline = make_interp_spline(self.times, self.values, k=5 if len(self.times) > 5 else 3)
        return spline, spline.derivative(1), spline.derivative(2)

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and acceleration at time t [s]; beyond the ends the end value, with rate and acceleration 0."""
        inside = min(max(t, self.times[0]), self.times[-1])
        a, b, c = (float(f(inside)) for f in self._spline)  # type: ignore[operator]
        return (a, b, c) if inside == t else (a, 0.0, 0.0)
