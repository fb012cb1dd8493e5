"""Limits of one-way rotation at constant input speed: existence, sticking, and zero mean speed of the output."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from mechlab.analytic.impulse.model import Impulse
from mechlab.analytic.impulse.regime import frictionless_mean_speed, phases, unidirectional
from mechlab.errors import MechlabError

EDGE = 1e-9
"""Relative distance from M0 = M1 at which a search ends: at equality the forward half-phase has no duration."""
SAMPLES = 101
"""Points of the scan for the last limit: the shaft sticks under a friction near the load as well as under a large one."""


@dataclass(frozen=True)
class OneWayLimits:
    """Limits of the regime of `unidirectional`; None where there is none.

    existence_speed, sticking_speed: the least input speed [rad/s] at M0 and M1 for which sin(psi_m) <= 1, and for which the
    output shaft does not stick. existence_load, sticking_load: the largest M0 [N m] at M1 and the input speed.
    existence_friction, sticking_friction: the largest M1 [N m] at M0 and the input speed. standstill_load: the M0 [N m] at
    which the mean speed is 0, where it does not stick. frictionless_mean_speed [rad/s]: M0 = 0, M1 -> 0.
    """

    existence_speed: float | None
    sticking_speed: float | None
    existence_load: float | None
    sticking_load: float | None
    existence_friction: float | None
    sticking_friction: float | None
    standstill_load: float | None
    frictionless_mean_speed: float


def limits(p: Impulse, speed: float) -> OneWayLimits:
    """The limits at an input speed [rad/s]. Raises MechlabError unless speed > 0, c = 0 and 0 <= M0 < M1."""
    if not (speed > 0.0 and p.c == 0.0 and 0.0 <= p.M0 < p.M1):
        raise MechlabError(
            f"impulse: limits of one-way rotation need an input speed > 0, c = 0 and M0 < M1, got {speed:g} rad/s, "
            f"c = {p.c:g} N m/rad, M0 = {p.M0:g}, M1 = {p.M1:g} N m."
        )

    def exists(w: float, M0: float, M1: float) -> float:
        return 1.0 - float(phases(p, w, M0, M1).sine)

    def slips(w: float, M0: float, M1: float) -> float:
        """A number with the sign of the sticking margin; negative where sin(psi_m) > 1 and no motion exists."""
        found = phases(p, w, M0, M1)
        return float(found.sticking_margin) / M1 if found.sine <= 1.0 else 1.0 - float(found.sine) - 1.0

    least = speed * float(np.sqrt(phases(p, speed, p.M0, p.M1).sine))  # sin(psi_m) goes with 1 / w^2
    largest = 2.0 * p.M1

    def of_load(f: Callable[[float, float, float], float]) -> float | None:
        return _last(lambda x: f(speed, min(x, p.M1 * (1.0 - EDGE)), p.M1), 0.0, p.M1)

    def of_friction(f: Callable[[float, float, float], float]) -> float | None:
        low, high = (p.M0 * (1.0 + EDGE) if p.M0 > 0.0 else EDGE * p.M1), largest
        while f(speed, p.M0, high) > 0.0:
            high *= 2.0
        return _last(lambda x: f(speed, p.M0, x), low, high)

    def fast() -> float:
        high = 2.0 * least
        while slips(high, p.M0, p.M1) < 0.0:
            high *= 2.0
        return float(brentq(lambda w: slips(w, p.M0, p.M1), least, high, xtol=1e-13 * least, rtol=1e-14))

    sticking_load = of_load(slips)
    return OneWayLimits(
        least, fast(), of_load(exists), sticking_load, of_friction(exists), of_friction(slips),
        _standstill(p, speed, sticking_load), frictionless_mean_speed(p, speed),
    )  # fmt: skip


def _last(f: Callable[[float], float], low: float, high: float) -> float | None:
    """The last x at which f falls through 0; None where f < 0 at all samples, `high` where f(high) >= 0."""
    x = np.linspace(low, high, SAMPLES)
    above = np.flatnonzero([f(float(y)) >= 0.0 for y in x])
    if not len(above):
        return None
    k = int(above[-1])
    return high if k == SAMPLES - 1 else float(brentq(f, x[k], x[k + 1], xtol=1e-13 * high, rtol=1e-14))


def _standstill(p: Impulse, speed: float, largest: float | None) -> float | None:
    """M0 between 0 and `largest` at which the mean speed is 0."""
    if largest is None:
        return None

    def mean(M0: float) -> float:
        return float(unidirectional(p, speed, M0, p.M1).without_sticking)

    ends = mean(0.0), mean(largest * (1.0 - EDGE))
    if not ends[0] * ends[1] <= 0.0:
        return None
    return float(brentq(mean, 0.0, largest * (1.0 - EDGE), xtol=1e-13 * largest, rtol=1e-14))
