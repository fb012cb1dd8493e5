"""The mean speed and the limits of one-way rotation: closed form, and event simulation over whole cycles."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic.impulse import ConstantSpeed, Impulse, frictionless_mean_speed, limits, unidirectional
from mechlab.analytic.roots import brentq
from mechlab.catalog.impulse_transmission.build import NAME, Parameters
from mechlab.catalog.impulse_transmission.torque import TORQUE
from mechlab.errors import MechlabError
from mechlab.experiment.question import Answer, Question
from mechlab.integrate import Event, integrate_hybrid
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Status

ANSWERS = {"mean_speed": "rad/s", "forward_time": "s", "return_time": "s", "mean_motor_torque": "N m"}
TURNS = 10
"""Cycles over which the event simulation averages; whole ones, so that no ripple is left."""


@dataclass(frozen=True)
class Cycle:
    """Some cycles of the planets at constant input speed: output speed `start` before and `end` after [rad/s]; over all of them
    time [s], angle [rad], integral of the motor torque [N m s], events; in each the times forward and back [s], and the turn of
    psi while the output shaft sticks [rad]."""

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

    @property
    def mean_speed(self) -> float:
        """Mean output speed [rad/s]."""
        return self.angle / self.time

    @property
    def mean_motor_torque(self) -> float:
        """Mean torque that keeps the input speed [N m]."""
        return self.torque_integral / self.time


def cycle(p: Impulse, speed: float, start: float, turns: int = 1, rtol: float = 1e-12) -> Cycle:
    """Follow psi from 0 through whole turns from the output speed `start` [rad/s], through all sticking."""
    problem = ConstantSpeed(p, speed)
    done = integrate_hybrid(problem, [0.0, start, 0.0, 0.0], [0.0, 2.0 * math.pi * turns], rtol=rtol, atol=1e-14)
    beta, v, t, impulse = (float(x) for x in done.last_y)
    spent = {1: 0.0, 0: 0.0, -1: 0.0}
    mode, at = (int(done.modes[0][0]) if problem.limits.size else int(np.sign(start))), 0.0
    for event in done.events:
        spent[mode] += float(event.y[2]) - at
        mode, at = event.after, float(event.y[2])
    spent[mode] += t - at
    stuck = float(done.stuck_time.sum()) / turns
    return Cycle(
        start,
        v,
        t,
        beta,
        impulse,
        spent[1] / turns,
        spent[-1] / turns,
        stuck,
        done.evaluations,
        done.complete,
        done.events,
    )


def closing(i: Impulse, speed: float, plain: int = 0, limit: float = 1e-9, rtol: float = 1e-11) -> Cycle | None:
    """One cycle that ends within `limit` [rad/s] of how it began, or None: secant steps on the simulated map of one cycle, after
    `plain` cycles that only follow each other."""
    x, x_before, gap_before = 0.0, math.nan, math.nan
    for step in range(40):
        done = cycle(i, speed, x, rtol=rtol)
        gap = done.end - x if done.complete else math.nan
        if not math.isfinite(gap) or (abs(gap) < limit and step >= plain):
            break
        follow = step <= plain or gap == gap_before
        way = gap if follow else -gap * (x - x_before) / (gap - gap_before)
        x_before, gap_before, x = x, gap, x + way
    return done if abs(gap) < max(limit, ROUNDING) else None


ROUNDING = 1e-8
"""Gap [rad/s] of a cycle that no more steps close: what rounding leaves at large input speeds."""


@lru_cache(maxsize=64)
def closed_cycle(p: Impulse, speed: float) -> Cycle | None:
    """TURNS cycles from the output speed at which one cycle closes; None without one."""
    found = closing(p, speed, plain=3, limit=1e-10, rtol=1e-12)
    return None if found is None else cycle(p, speed, found.start, TURNS)


def positive(key: str, speed: Any) -> None:
    """Raises MechlabError unless an input speed is above 0."""
    if not np.all(np.asarray(speed) > 0):
        raise MechlabError(f"{NAME}: {key}: expected more than 0 rad/s, got {float(np.min(speed)):g}.")


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
    if reason := stalled(i):
        return Answer(cannot=reason)
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
    if i.M1:
        return Answer(values)
    limit = frictionless_mean_speed(i, float(speed.ravel()[0]))
    note = f"without friction this is the limit M1 -> 0; the integral of the source's item gives {limit:.9g} rad/s"
    return Answer(values, notes=(note,))


def hybrid(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Event simulation: the cycle that closes, then times and torque between crossings of psi that are 2 pi apart."""
    i, speed = p.impulse, float(given["input_speed"])
    if reason := stalled(i):
        return Answer(cannot=reason)
    positive("input_speed", speed)
    if i.M1 == 0:
        return Answer(cannot="without friction every motion is its own cycle: there is no mean speed to converge to")
    if i.M0 >= i.M1:
        return Answer(status=Status.NO_REGIME, notes=("the constant load M0 is not smaller than the friction M1",))
    found = closed_cycle(i, speed)
    if found is None or not found.complete:
        return Answer(status=Status.NO_REGIME, notes=("the simulation finds no cycle that closes",))
    if found.forward_time == 0.0 or found.return_time == 0.0:
        mean = f"mean speed {found.mean_speed:.6g} rad/s, sticking included"
        return Answer(status=Status.NO_REGIME, notes=(f"the simulated cycle does not go forward and back ({mean})",))
    notes = [f"{TURNS} cycles, {len(found.events)} events, {found.evaluations} evaluations"]
    if found.stuck_psi > 0.0:
        notes.append(f"the output shaft sticks for {found.stuck_psi:.6g} rad of psi in each cycle")
    return Answer({k: getattr(found, k) for k in ANSWERS}, notes=tuple(notes))


MEAN_SPEED = Question(
    "mean speed at constant input speed", ("input_speed",), tuple(ANSWERS), {"analytic": analytic, "hybrid": hybrid},
    units={"input_speed": "rad/s"} | ANSWERS,
    text="one-way rotation under load and dry friction: mean output speed, times forward and back, mean motor torque",
)  # fmt: skip

LIMIT_UNITS = dict.fromkeys(("existence_speed", "sticking_speed", "frictionless_mean_speed"), "rad/s") | dict.fromkeys(
    ("existence_load", "sticking_load", "existence_friction", "sticking_friction", "standstill_load"), "N m"
)
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
    return (
        stalled(i) if i.M0 < i.M1 else f"the load M0 = {i.M0:g} N m is not smaller than the friction M1 = {i.M1:g} N m"
    )


def limit_analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Limits of one-way rotation from the exact half-phases."""
    speed = float(given["limits_at_speed"])
    if reason := _refused(p.impulse, speed):
        return Answer(status=Status.NO_REGIME, notes=(reason,))
    found = asdict(limits(p.impulse, speed))
    notes = tuple(f"no {k}: {REASONS[k]}" for k, x in found.items() if x is None)
    return Answer({k: x for k, x in found.items() if x is not None}, notes=notes)


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
    if reason := _refused(i, speed):
        return Answer(status=Status.NO_REGIME, notes=(reason,))
    known = limits(i, speed)
    vanishing: dict[str, Callable[[float], float]] = {
        "sticking_speed": lambda x: grip(i, x),
        "sticking_load": lambda x: grip(replace(i, M0=x), speed),
        "sticking_friction": lambda x: grip(replace(i, M1=x), speed),
        "standstill_load": lambda x: mean_speed(replace(i, M0=x), speed),
    }
    values: dict[str, float] = {}
    for key, f in vanishing.items():
        at = getattr(known, key)  # the closed form gives the bracket alone
        if at is not None and f(0.98 * at) * f(1.02 * at) < 0.0:
            values[key] = float(brentq(f, 0.98 * at, 1.02 * at, xtol=1e-9 * at, rtol=1e-9))
    if known.existence_friction is not None:
        first, second = (mean_speed(replace(i, M0=0.0, M1=x * known.existence_friction), speed) for x in WEAK)
        # the mean speed is even in M1, so the error of the extrapolation falls with the fourth power of M1
        a, b = (x**2 for x in WEAK)
        values["frictionless_mean_speed"] = (b * first - a * second) / (b - a)
    return Answer(values, notes=("existence without regard to sticking is no motion that could be simulated",))


def mean_speed(i: Impulse, speed: float) -> float:
    """Mean output speed of the simulated cycle [rad/s]; NaN where none closes."""
    done = closing(i, speed)
    return math.nan if done is None else done.mean_speed


LIMITS = Question(
    "limits of one-way rotation",
    given=("limits_at_speed",),
    answers=tuple(LIMIT_UNITS),
    witnesses={"analytic": limit_analytic, "hybrid": limit_hybrid},
    units={"limits_at_speed": "rad/s"} | LIMIT_UNITS,
    text="least input speed, largest load M0 and largest friction M1 for which one-way rotation exists (sin(psi_m) <= 1) and "
    "for which the output shaft does not stick; load at which the mean speed is 0; mean speed without friction",
    # extrapolation to no friction
    tolerance=1e-5,
)

QUESTIONS = (MEAN_SPEED, LIMITS, TORQUE)
