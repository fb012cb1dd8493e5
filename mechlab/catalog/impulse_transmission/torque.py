"""Torque: with and without a one-way clutch from the output shaft to the housing. A question, a scene, and the best load."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.impulse import ClutchedCycle, Impulse, clutched, shape, simulated_clutch
from mechlab.catalog.impulse_transmission.build import Parameters
from mechlab.errors import NoSolution
from mechlab.experiment.held_rates import HeldRates, RateHold
from mechlab.experiment.laws import Constant, Law
from mechlab.experiment.question import Answer, Question
from mechlab.mechanism import Status

UNITS = {
    "clutched_speed": "rad/s", "clutched_motor_torque": "N m", "holding_torque": "N m", "torque_ratio": "", "useful_power": "W",
    "efficiency": "",
}  # fmt: skip
STEP = 2.5e-5
"""Timestep of the scene [s]: the capture of the held rates is of first order in it."""


def _answers(of: Callable[[Impulse, float], ClutchedCycle]) -> Callable[[Parameters, Mapping[str, Any]], Answer]:
    def answer(p: Parameters, given: Mapping[str, Any]) -> Answer:
        speed, i = float(given["clutch_at_speed"]), p.impulse
        try:
            found = of(i, speed)
        except NoSolution as error:
            return Answer(status=Status.NO_REGIME, notes=(str(error).removeprefix("impulse: "),))
        useful = i.M0 * found.mean_speed
        values = (found.mean_speed, found.motor_torque, found.holding_torque, i.M0 / found.motor_torque, useful)
        return Answer(dict(zip(UNITS, (*values, useful / (found.motor_torque * speed)), strict=True)))

    return answer


TORQUE = Question(
    "torque with a one-way clutch to the housing", ("clutch_at_speed",), tuple(UNITS),
    {"analytic": _answers(clutched), "hybrid": _answers(simulated_clutch)}, units={"clutch_at_speed": "rad/s"} | UNITS,
    text="at constant input speed, c = 0: mean output speed, mean torque of the motor, mean torque that holds the output shaft at rest, "
    "load over motor torque, power of the load M0, its share of the motor's power",
    # the integration is accurate to 1e-11 of torques of 1e3 N m and powers of 1e4 W
    tolerance=1e-5,
)  # fmt: skip


def clutch_laws(p: Parameters) -> tuple[Law, ...]:
    """The input held at its nominal speed, the output free to turn forwards only, under the constant load."""
    holds = (RateHold("alpha", p.nominal_speed), RateHold("beta", 0.0, low=0.0))
    return (HeldRates(holds, (Constant("beta", -p.M0),), STEP),)


def best_load(p: Impulse, speed: float) -> tuple[float, ClutchedCycle]:
    """The load M0 [N m] of largest useful power M0 times the mean speed, with a clutch and without friction; and its cycle."""
    from scipy.optimize import minimize_scalar

    s = shape(p)
    largest = (s.a6 - s.a5) * speed**2

    def cycle(load: float) -> ClutchedCycle:
        return clutched(replace(p, M0=load, M1=0.0), speed)

    found = minimize_scalar(lambda x: -x * cycle(x).mean_speed, bounds=(1e-3 * largest, (1.0 - 1e-9) * largest), method="bounded",
                            options={"xatol": 1e-9 * largest})  # fmt: skip
    return float(found.x), cycle(float(found.x))


def over_load(p: Impulse, speed: float, count: int = 60) -> dict[str, np.ndarray]:
    """Load [N m], mean speed [rad/s] and motor torque [N m] with a clutch and without friction, from nearly no load to the largest."""
    s = shape(p)
    largest = (s.a6 - s.a5) * speed**2
    rows = []
    for load in largest * np.linspace(0.01, 0.9995, count) ** 2:
        found = clutched(replace(p, M0=float(load), M1=0.0), speed)
        rows.append((load, found.mean_speed, found.motor_torque))
    return dict(zip(("load", "speed", "motor"), np.array(rows).T, strict=True))
