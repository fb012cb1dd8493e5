"""The question of the limits of one-way rotation: closed form, and event simulation of the cycles that close."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any

from scipy.optimize import brentq

from mechlab.analytic.impulse import Impulse, limits
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.problems import ConstantSpeed, Cycle, cycle
from mechlab.catalog.impulse_transmission.questions import positive, stalled
from mechlab.experiment.question import Answer, Question
from mechlab.mechanism import Status

SPEEDS = ("existence_speed", "sticking_speed", "frictionless_mean_speed")
TORQUES = ("existence_load", "sticking_load", "existence_friction", "sticking_friction", "standstill_load")
REASONS = {
    "sticking_load": "the output shaft sticks without any load too",
    "sticking_friction": "the output shaft sticks under any friction above the load",
    "standstill_load": "no load below sticking_load makes the mean speed 0",
}
WEAK = (0.02, 0.04)
"""Frictions, as shares of the largest, from which the limit of no friction is extrapolated."""


def _refused(i: Impulse, speed: float) -> str:
    """Why there is no regime that could have limits."""
    positive("limits_at_speed", speed)
    if i.M0 < i.M1:
        return stalled(i)
    return f"the load M0 = {i.M0:g} N m is not smaller than the friction M1 = {i.M1:g} N m"


def analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """The limits of the exact half-phases."""
    speed = float(given["limits_at_speed"])
    if _refused(p.impulse, speed):
        return Answer(status=Status.NO_REGIME, notes=(_refused(p.impulse, speed),))
    found = asdict(limits(p.impulse, speed))
    notes = tuple(f"no {k}: {REASONS[k]}" for k, x in found.items() if x is None)
    return Answer({k: x for k, x in found.items() if x is not None}, notes=notes)


def closing(i: Impulse, speed: float, guess: float = 0.0) -> Cycle | None:
    """One cycle that ends as it began: secant steps on the simulated map of one cycle; None without one."""
    before: tuple[float, float] | None = None
    x = guess
    for _ in range(40):
        done = cycle(i, speed, x, rtol=1e-11)
        gap = done.end - x if done.complete else math.nan
        if not math.isfinite(gap):
            return None
        if abs(gap) < 1e-9:
            return done
        step = gap if before is None or gap == before[1] else -gap * (x - before[0]) / (gap - before[1])
        before, x = (x, gap), x + step
    return None


def grip(i: Impulse, speed: float) -> float:
    """Driving torque beyond the friction where the simulated shaft turns round, the least of a cycle, as a share of M1;
    -1 where no cycle turns round."""
    done = closing(i, speed)
    if done is None or not done.events:
        return -1.0
    problem = ConstantSpeed(i, speed)
    return min(abs(float(problem.holding(e.t, e.y, (0,))[0])) for e in done.events) / i.M1 - 1.0


def hybrid(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Where the simulated cycle begins to stick, and where its mean speed is 0."""
    i, speed = p.impulse, float(given["limits_at_speed"])
    if _refused(i, speed):
        return Answer(status=Status.NO_REGIME, notes=(_refused(i, speed),))
    known = limits(i, speed)
    values: dict[str, float] = {}

    def near(key: str, at: float | None, f: Callable[[float], float]) -> None:
        """The root of f, bracketed by 2 % about the closed form; it is not taken over, only looked for there."""
        if at is None:
            return
        low, high = 0.98 * at, 1.02 * at
        if f(low) * f(high) < 0.0:
            values[key] = float(brentq(f, low, high, xtol=1e-9 * at, rtol=1e-9))

    near("sticking_speed", known.sticking_speed, lambda w: grip(i, w))
    near("sticking_load", known.sticking_load, lambda x: grip(replace(i, M0=x), speed))
    near("sticking_friction", known.sticking_friction, lambda x: grip(replace(i, M1=x), speed))
    near("standstill_load", known.standstill_load, lambda x: mean_speed(replace(i, M0=x), speed))
    if known.existence_friction is not None:
        slow, slower = (mean_speed(replace(i, M0=0.0, M1=x * known.existence_friction), speed) for x in WEAK)
        # even in M1: the error of the extrapolation goes with its fourth power
        values["frictionless_mean_speed"] = (WEAK[1] ** 2 * slow - WEAK[0] ** 2 * slower) / (
            WEAK[1] ** 2 - WEAK[0] ** 2
        )
    return Answer(values, notes=("existence without regard to sticking is no motion that could be simulated",))


def mean_speed(i: Impulse, speed: float) -> float:
    """Of the simulated cycle [rad/s]; NaN without one."""
    done = closing(i, speed)
    return math.nan if done is None else done.angle / done.time


LIMITS = Question(
    "limits of one-way rotation",
    given=("limits_at_speed",),
    answers=(*SPEEDS, *TORQUES),
    witnesses={"analytic": analytic, "hybrid": hybrid},
    units={"limits_at_speed": "rad/s"} | dict.fromkeys(SPEEDS, "rad/s") | dict.fromkeys(TORQUES, "N m"),
    text="least input speed, largest load M0 and largest friction M1 for which one-way rotation exists (sin(psi_m) <= 1) and "
    "for which the output shaft does not stick; load at which the mean speed is 0; mean speed without friction",
    # extrapolation to no friction
    tolerance=1e-5,
)
