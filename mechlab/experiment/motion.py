"""Prescribed motions as data, for servos and computed-torque laws. Each gives value, rate and acceleration."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import cached_property
from numbers import Real
from typing import Any, Protocol, runtime_checkable

import numpy as np

from mechlab.errors import MechlabError, explained
from mechlab.lazy_dataclass import dataclass
from mechlab.values import one_number, short

STEP = 1e-3
"""Step [s] of the differences of a `Function`."""


@runtime_checkable
class PrescribedMotion(Protocol):
    """A twice differentiable function of time."""

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and acceleration at time t [s]."""
        ...


class _Numbers:
    """A motion of plain numbers; it names what is none."""

    def __post_init__(self) -> None:
        for name, x in vars(self).items():
            if not isinstance(x, Real):
                raise MechlabError(f"{type(self).__name__}: {name}: expected a number in SI units, got {short(x)}.")


@explained
@dataclass(frozen=True)
class Hold(_Numbers):
    """Stands still at `value`."""

    value: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, 0, 0."""
        return self.value, 0.0, 0.0


@explained
@dataclass(frozen=True)
class Ramp(_Numbers):
    """Moves from `value` at constant `rate`."""

    value: float = 0.0
    rate: float = 0.0

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate, 0."""
        return self.value + self.rate * t, self.rate, 0.0


@explained
@dataclass(frozen=True)
class Sine(_Numbers):
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
class Function:
    """A function of the time t [s] alone: it returns the value, or the three numbers value, rate and acceleration.

    Where it returns the value alone, rate and acceleration are central differences of the fourth order over STEP: exact to about
    1e-12 and 1e-9 of the size for motions that change in seconds.
    """

    function: Callable[[float], float | tuple[float, float, float]]

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and acceleration at time t [s]. Raises MechlabError where the function gives no number."""
        x = self._of(t)
        if len(x) == 3:
            return x[0], x[1], x[2]
        m2, m1, p1, p2 = (self._of(t + k * STEP)[0] for k in (-2, -1, 1, 2))
        rate = (m2 - 8.0 * m1 + 8.0 * p1 - p2) / (12.0 * STEP)
        return x[0], rate, (-m2 + 16.0 * m1 - 30.0 * x[0] + 16.0 * p1 - p2) / (12.0 * STEP**2)

    def value(self, t: float) -> float:
        """The value alone, by one call of the function."""
        return self._of(t)[0]

    def _of(self, t: float) -> tuple[float, ...]:
        value = self.function(t)
        try:
            numbers = tuple(float(x) for x in value) if isinstance(value, tuple) else (float(value),)
        except (TypeError, ValueError):
            numbers = ()
        if len(numbers) not in (1, 3):
            name = getattr(self.function, "__name__", type(self.function).__name__)
            raise MechlabError(
                f"the target {name} must return one number, or value, rate and acceleration; it returned {value!r} at t = {t:g} s."
            )
        return numbers


@dataclass(frozen=True)
class AtRate:
    """The value of another motion as the rate of this one, for drives that follow a rate and know no value."""

    rates: PrescribedMotion

    def at(self, t: float) -> tuple[float, float, float]:
        """0, the rate and its derivative at time t [s]."""
        return (0.0, *self.rates.at(t)[:2])


@explained
@dataclass(frozen=True)
class Spline:
    """A twice differentiable spline through `values` at `times` [s]: quintic from six points on, else cubic;
    a parabola through three."""

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
    def curve(self) -> Any:
        """The scipy.interpolate.BSpline."""
        from scipy.interpolate import make_interp_spline

        return make_interp_spline(self.times, self.values, k=5 if len(self.times) > 5 else min(3, len(self.times) - 1))

    @cached_property
    def _derivatives(self) -> tuple[Any, Any, Any]:
        return self.curve, self.curve.derivative(1), self.curve.derivative(2)

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and acceleration at time t [s]; beyond the ends the end value, with rate and acceleration 0."""
        inside = min(max(t, self.times[0]), self.times[-1])
        a, b, c = (float(f(inside)) for f in self._derivatives)
        return (a, b, c) if inside == t else (a, 0.0, 0.0)


@explained
@dataclass(frozen=True)
class Polyline:
    """Straight lines between `values` at `times` [s], constant beyond the ends; for forces, as its rate jumps."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def at(self, t: float) -> tuple[float, float, float]:
        """Value and slope at time t [s], and 0."""
        x, y = self.times, self.values
        k = bisect_right(x, t)
        if k in (0, len(x)):
            return (y[0], 0.0, 0.0) if k == 0 else (y[-1], 0.0, 0.0)
        slope = (y[k] - y[k - 1]) / (x[k] - x[k - 1])
        return slope * (t - x[k - 1]) + y[k - 1], slope, 0.0


Target = (
    PrescribedMotion
    | float
    | str
    | Callable[[float], float | tuple[float, float, float]]
    | tuple[Sequence[float], Sequence[float]]
)
"""What a drive may be asked to follow: a motion, a number (text with a unit), a function of time, or (times, values)."""


def as_motion(what: str, target: Target) -> PrescribedMotion:
    """The motion that a target stands for; raises MechlabError that names `what` for anything else."""
    if isinstance(target, type) or isinstance(target, tuple) and len(target) != 2:
        raise MechlabError(
            f"{what}: expected a number, a motion, a function of time or (times, values), got {target!r}."
        )
    if isinstance(target, tuple):
        times, values = (tuple(float(one_number(what, x)) for x in column) for column in target)
        return Spline(times, values)
    if isinstance(target, PrescribedMotion):
        return target
    return Function(target) if callable(target) else Hold(float(one_number(what, target)))
