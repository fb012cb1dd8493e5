"""Questions: the output from the crank, and the regime, from the closed form and from both engines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.analytic.roots import brentq
from mechlab.catalog.gear_linkage.build import Parameters, build
from mechlab.experiment.question import Answer, Question
from mechlab.kit.questions import for_engines
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Status

PARTS = ("output", "idler", "coupler", "rocker")
ORDERS = {"angle": ("angle", "rad"), "rate": ("angle_rate", "rad/s"), "accel": ("angle_accel", "rad/s2")}
"""Order of a quantity here -> its name in the engines, its unit."""
GIVEN = {f"crank_{order}": f"crank_{theirs}" for order, (theirs, _) in ORDERS.items()}
NAMES = {f"{part}_{order}": f"{part}_{theirs}" for part in PARTS for order, (theirs, _) in ORDERS.items()}
ANSWERS = tuple(NAMES)
SINGULAR = (
    "coupler and rocker are in one line with the frame: two assembly modes meet, the crank does not set the rates"
)


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    x = closed_form.motion(p.linkage, given["crank_angle"], given["crank_rate"], given["crank_accel"])
    if not np.all(x.regular):
        return Answer(status=Status.CHANGE_POINT, notes=(SINGULAR,))
    values = {name: getattr(x, name) for name in ANSWERS} | {"transmission_angle": x.transmission_angle}
    return Answer(values)


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Gear angles count from crank angle 0, so the engine solves that position too."""
    m = build(p, "minimal")
    asked = {theirs: given[ours] for ours, theirs in GIVEN.items()}
    found = engine_answer(engine, m, asked, tuple(NAMES.values()))
    if not found.values:
        return found
    start = engine_answer(engine, m, {"crank_angle": 0.0}, ("output_angle", "idler_angle"))
    if not start.values:
        return start
    values = {ours: found.values[theirs] for ours, theirs in NAMES.items() if theirs in found.values}
    for part in ("output", "idler"):
        values[f"{part}_angle"] -= start.values[f"{part}_angle"]
    return Answer(values, found.status, found.notes)


UNITS = {f"{part}_{order}": unit for part in (*PARTS, "crank") for order, (_, unit) in ORDERS.items()}

MOTION = Question(
    "motion",
    given=("crank_angle",),
    optional={"crank_rate": 1.0, "crank_accel": 0.0},
    answers=(*ANSWERS, "transmission_angle"),
    witnesses={"analytic": _analytic} | for_engines(_engine),
    angles=("coupler_angle", "rocker_angle"),
    units=UNITS | {"transmission_angle": "rad"},
    text="angle, rate and acceleration of the output gear (0 at crank angle 0, followed continuously) and of all parts",
)

NUMBERS = (
    "slowest_rate", "slowest_angle", "fastest_rate", "fastest_angle", "reverse_angle", "dwell_angle",
    "dwell_angle_one_sided", "least_transmission_angle",
)  # fmt: skip


def _regime(p: Parameters, given: Mapping[str, Any]) -> Answer:
    g = p.linkage
    if g.at_change_point:
        return Answer(status=Status.CHANGE_POINT, notes=(SINGULAR,))
    report = closed_form.regime(g)
    values = {name: getattr(report, name) for name in NUMBERS}
    values |= {"longest_crank": g.longest_crank, "mean_rate": g.ratio}
    notes = [report.regime.value]
    if p.backlash and report.regime is closed_form.OutputRegime.REVERSING:
        stands = report.reverse_angle <= p.play
        notes.append("the play takes up the reverse motion: the output stands" if stands else
                     "the reverse motion exceeds the play: the output runs back")  # fmt: skip
    return Answer(values, notes=tuple(notes))


def _engine_regime(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    """The reverse motion by root finding on the engine's own output rate: no formula, no derivative."""
    if p.linkage.at_change_point:
        return Answer(status=Status.CHANGE_POINT, notes=(SINGULAR,))
    m = build(p, "minimal")

    def ask(phi: float, what: str) -> float:
        given = {"crank_angle": phi, "crank_angle_rate": 1.0}
        return float(engine_answer(engine, m, given, (what,), steps=4).values[what])

    grid = np.linspace(0.0, 2.0 * math.pi, 37)
    rates = np.array([ask(phi, "output_angle_rate") for phi in grid])
    mean = (ask(2.0 * math.pi, "output_angle") - ask(0.0, "output_angle")) / (2.0 * math.pi)
    values = {"mean_rate": mean}
    k = int(np.argmin(rates[:-1]))
    if rates[k] >= 0.0:
        return Answer(values, notes=("no reverse motion at 36 crank angles",))
    before, after = k, k
    while rates[before % 36] < 0.0 and before > k - 36:
        before -= 1
    while rates[after % 36] < 0.0 and after < k + 36:
        after += 1
    step = 2.0 * math.pi / 36
    stop, turn = (
        float(brentq(lambda x: ask(x, "output_angle_rate"), a * step, b * step, xtol=1e-12))
        for a, b in ((before, before + 1), (after - 1, after))
    )
    values["dwell_angle"] = turn - stop
    values["reverse_angle"] = ask(stop, "output_angle") - ask(turn, "output_angle")
    return Answer(values)


REGIME = Question(
    "regime",
    given=(),
    answers=NUMBERS,
    witnesses={"analytic": _regime} | for_engines(_engine_regime),
    # the crank turns at rate 1: the rates are ratios
    units=dict.fromkeys((n for n in NUMBERS if not n.endswith("rate")), "rad")
    | dict.fromkeys(("slowest_rate", "fastest_rate", "mean_rate"), "")
    | {"longest_crank": "m"},
    text="regime of one turn: slowest and fastest output rate (crank rate 1), reverse angle, dwell, transmission angle",
)

QUESTIONS = (MOTION, REGIME)
