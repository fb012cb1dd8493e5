"""The question of the mean speed: closed form, and event simulation over whole cycles."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic.impulse import Impulse, frictionless_mean_speed, unidirectional
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.problems import Cycle, cycle
from mechlab.experiment.question import Answer, Question
from mechlab.mechanism import Status

ANSWERS = ("mean_speed", "forward_time", "return_time", "mean_motor_torque")
TURNS = 10
"""Cycles over which the event simulation averages; whole ones, so that no ripple is left."""


def _stalled(p: Impulse) -> str:
    if p.c:
        return "the spring c holds the output shaft: its mean speed is 0"
    if p.q < 0:
        return "one-way rotation is worked out for q > 0"
    return ""


def analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """The exact half-phases."""
    i = p.impulse
    speed = np.asarray(given["input_speed"], dtype=float)
    if _stalled(i):
        return Answer(cannot=_stalled(i))
    if not np.all(speed > 0):
        return Answer(cannot="input_speed must be > 0 rad/s")
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
        told = f"; sin(psi_m) = {sine:.6g}, the limit is 1" if math.isfinite(sine) else ""
        return Answer(status=Status.NO_REGIME, notes=(reasons[bad].removeprefix("no such regime: ") + told,))
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
    if _stalled(i):
        return Answer(cannot=_stalled(i))
    if not speed > 0:
        return Answer(cannot="input_speed must be > 0 rad/s")
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
