"""The mean speed and the limits of one-way rotation: closed form, and event simulation over whole cycles."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq

from mechlab.analytic.impulse import Impulse, frictionless_mean_speed, limits, unidirectional
from mechlab.catalog.impulse_transmission.build import Parameters
from mechlab.catalog.impulse_transmission.problems import ConstantSpeed, Cycle, cycle
from mechlab.errors import MechlabError
from mechlab.experiment.question import Answer, Question
from mechlab.mechanism import Status

ANSWERS = ("mean_speed", "forward_time", "return_time", "mean_motor_torque")
TURNS = 10
"""Cycles over which the event simulation averages; whole ones, so that no ripple is left."""


def positive(key: str, speed: Any) -> None:
    """Raises MechlabError unless an input speed is above 0."""
    if not np.all(np.asarray(speed) > 0):
        raise MechlabError(f"impulse_transmission: {key}: expected more than 0 rad/s, got {float(np.min(speed)):g}.")


def stalled(p: Impulse) -> str:
    """Why there is no one-way rotation; empty where there may be."""
    if p.c:
        return "the spring c holds the output shaft: its mean speed is 0"
    if p.q < 0:
        return "one-way rotation is worked out for q > 0"
    return ""


def analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """The exact half-phases."""
    i = p.impulse
    speed = np.asarray(given["input_speed"], dtype=float)
    if stalled(i):
        return Answer(cannot=stalled(i))
    positive("input_speed", speed)
    found = [unidirectional(i, float(w)) for w in speed.ravel()]
    reasons = [str(r.reason) for r in found]
    bad = next((k for k, r in enumerate(found) if not r.exists), None)
    if bad is not None:
        if "sticks" in reasons[bad]:
            return Answer(
                cannot="the closed form is for rotation without sticking, and here the output shaft sticks "
                f"(ignoring that, the formula would give {float(found[bad].without_sticking):.9g} rad/s)"
            )
        sine = float(found[bad].sine)
        excess = f"; sin(psi_m) = {sine:.6g}, the limit is 1" if math.isfinite(sine) else ""
        return Answer(status=Status.NO_REGIME, notes=(reasons[bad].removeprefix("no such regime: ") + excess,))
    values = {k: np.array([float(getattr(r, k)) for r in found]).reshape(speed.shape) for k in ANSWERS}
    notes: tuple[str, ...] = ()
    if i.M1 == 0:
        limit = frictionless_mean_speed(i, float(speed.ravel()[0]))
        notes = (
            f"without friction this is the limit M1 -> 0; the integral of the source's item gives {limit:.9g} rad/s",
        )
    return Answer(values, notes=notes)


@lru_cache(maxsize=64)
def closed_cycle(p: Impulse, speed: float, section: float = 0.0) -> Cycle | None:
    """One cycle that ends as it began, found by the secant method on the simulated map of one cycle; None without one."""

    def gap(x: float) -> float:
        done = cycle(p, speed, x, section=section)
        return done.end - x if done.complete else math.nan

    x0 = 0.0
    for _ in range(3):
        f0 = gap(x0)
        if not math.isfinite(f0):
            return None
        if f0 == 0.0:
            return cycle(p, speed, x0, TURNS, section)
        x0 += f0
    f0 = gap(x0)
    x1 = x0 + f0
    f1 = gap(x1)
    for _ in range(30):
        if not math.isfinite(f1):
            return None
        if abs(f1) < 1e-10 or f1 == f0:
            break
        x0, f0, x1 = x1, f1, x1 - f1 * (x1 - x0) / (f1 - f0)
        f1 = gap(x1)
    if not abs(f1) < 1e-8:
        return None
    return cycle(p, speed, x1, TURNS, section)


def hybrid(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Event simulation: the cycle that closes, then times and torque between crossings of psi that are 2 pi apart."""
    i, speed = p.impulse, float(given["input_speed"])
    if stalled(i):
        return Answer(cannot=stalled(i))
    positive("input_speed", speed)
    if i.M1 == 0:
        return Answer(cannot="without friction every motion is its own cycle: there is no mean speed to converge to")
    if i.M0 >= i.M1:
        return Answer(status=Status.NO_REGIME, notes=("the constant load M0 is not smaller than the friction M1",))
    found = closed_cycle(i, speed)
    if found is None or not found.complete:
        return Answer(status=Status.NO_REGIME, notes=("the simulation finds no cycle that closes",))
    if found.forward_time == 0.0 or found.return_time == 0.0:
        mean = found.angle / found.time
        text = f"the simulated cycle does not go forward and back (mean speed {mean:.6g} rad/s, sticking included)"
        return Answer(status=Status.NO_REGIME, notes=(text,))
    values = dict(zip(ANSWERS, (
        found.angle / found.time, found.forward_time / TURNS, found.return_time / TURNS, found.torque_integral / found.time,
    ), strict=True))  # fmt: skip
    notes = [f"{TURNS} cycles, {len(found.events)} events, {found.evaluations} evaluations"]
    if found.stuck_psi > 0.0:
        notes.append(f"the output shaft sticks for {found.stuck_psi / TURNS:.6g} rad of psi in each cycle")
    return Answer(values, notes=tuple(notes))


QUESTIONS = (
    Question(
        "mean speed at constant input speed", ("input_speed",), ANSWERS, {"analytic": analytic, "hybrid": hybrid},
        units={"input_speed": "rad/s", "mean_speed": "rad/s", "forward_time": "s", "return_time": "s", "mean_motor_torque": "N m"},
        text="one-way rotation under load and dry friction: mean output speed, times forward and back, mean motor torque",
    ),
)  # fmt: skip

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
    """Why there is no one-way rotation that could have limits; empty where there may be."""
    positive("limits_at_speed", speed)
    if i.M0 < i.M1:
        return stalled(i)
    return f"the load M0 = {i.M0:g} N m is not smaller than the friction M1 = {i.M1:g} N m"


def limit_analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Limits of one-way rotation from the exact half-phases."""
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
    """min |torque| / M1 - 1 over the reversals of the simulated cycle: by how much the torque on the output shaft
    exceeds the friction. Negative: it sticks; -1 where no cycle has a reversal."""
    done = closing(i, speed)
    if done is None or not done.events:
        return -1.0
    problem = ConstantSpeed(i, speed)
    return min(abs(float(problem.holding(e.t, e.y, (0,))[0])) for e in done.events) / i.M1 - 1.0


def limit_hybrid(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Where the simulated cycle begins to stick, and where its mean speed is 0."""
    i, speed = p.impulse, float(given["limits_at_speed"])
    if _refused(i, speed):
        return Answer(status=Status.NO_REGIME, notes=(_refused(i, speed),))
    known = limits(i, speed)
    values: dict[str, float] = {}

    def near(key: str, at: float | None, f: Callable[[float], float]) -> None:
        """Store the root of f that lies within 2 % of the closed form `at`; `at` gives the bracket alone."""
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
        # the mean speed is even in M1, so the error of the extrapolation falls with the fourth power of M1
        values["frictionless_mean_speed"] = (WEAK[1] ** 2 * slow - WEAK[0] ** 2 * slower) / (
            WEAK[1] ** 2 - WEAK[0] ** 2
        )
    return Answer(values, notes=("existence without regard to sticking is no motion that could be simulated",))


def mean_speed(i: Impulse, speed: float) -> float:
    """Mean output speed of the simulated cycle [rad/s]; NaN where none closes."""
    done = closing(i, speed)
    return math.nan if done is None else done.angle / done.time


LIMITS = Question(
    "limits of one-way rotation",
    given=("limits_at_speed",),
    answers=(*SPEEDS, *TORQUES),
    witnesses={"analytic": limit_analytic, "hybrid": limit_hybrid},
    units={"limits_at_speed": "rad/s"} | dict.fromkeys(SPEEDS, "rad/s") | dict.fromkeys(TORQUES, "N m"),
    text="least input speed, largest load M0 and largest friction M1 for which one-way rotation exists (sin(psi_m) <= 1) and "
    "for which the output shaft does not stick; load at which the mean speed is 0; mean speed without friction",
    # extrapolation to no friction
    tolerance=1e-5,
)
