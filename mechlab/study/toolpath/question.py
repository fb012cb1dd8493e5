"""The question `toolpath`: length of a curve, of its spans, and where to begin to brake.

A curve has no bodies, drives or scenes, so it is no entry of the catalog: it is one Question, whose parameter is a file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from mechlab.analytic.bspline import (
    BSpline,
    arc_length,
    braking,
    braking_distance,
    control_polygon_length,
    quadrature_spans,
    simpson_bound,
    simpson_spans,
)
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.experiment.question import Answer, Answers, Question
from mechlab.mechanism import Status
from mechlab.study.ask import numeric
from mechlab.study.toolpath.curve_file import read_curve

NAME = "toolpath"
BRAKING = {"speed": "m/s", "exit_speed": "m/s", "deceleration": "m/s2"}
PANELS = 64


@dataclass(frozen=True)
class Path:
    """The curve that is asked about."""

    curve: BSpline


def solve_toolpath(values: Mapping[str, Any]) -> Answers:
    """The answers to curve=FILE.json [speed=... deceleration=... exit_speed=...].

    Raises MechlabError for an unknown or missing key, a bad file, or speeds that are no braking.
    """
    for key in values:
        if key not in ("curve", *BRAKING):
            raise unknown(f"{NAME}: quantity", key, ("curve", *BRAKING))
    if "curve" not in values:
        raise MechlabError(f"{NAME}: curve is missing; give curve=FILE.json with the keys degree, knots, points.")
    numbers = {k: _number(k, v) for k, v in values.items() if k != "curve"}
    if numbers and not {"speed", "deceleration"} <= set(numbers):
        missing = [k for k in ("speed", "deceleration") if k not in numbers]
        raise MechlabError(f"{NAME}: {' and '.join(missing)} missing; braking needs speed and deceleration.")
    if numbers:
        numbers.setdefault("exit_speed", 0.0)
        braking_distance(numbers["speed"], numbers["exit_speed"], numbers["deceleration"])
    path = Path(read_curve(str(values["curve"])))
    answers = {name: ask(path, numbers) for name, ask in QUESTION.witnesses.items()}
    return Answers(
        QUESTION.name, answers, units=QUESTION.units, parameters={"curve": str(values["curve"])}, given=numbers
    )


def _number(key: str, value: Any) -> float:
    number = numeric(key, value)
    if not isinstance(number, float) or getattr(value, "unit", BRAKING[key]) != BRAKING[key]:
        raise MechlabError(f"{NAME}: {key}: expected a number [{BRAKING[key]}], got {value!r}.")
    return number


def _analytic(path: Path, given: Mapping[str, Any]) -> Answer:
    """Gauss-Legendre between the slow points of the curve, Newton for the parameter."""
    curve = path.curve
    report = arc_length(curve)
    values: dict[str, Any] = {"length": report.length, "spans": report.spans}
    notes = [f"the length is known to {report.error:.2g} m"]
    notes += [
        f"the curve stands still at u = {u:.9g} (a cusp): a tool must stop there, or the corner be rounded"
        for u in report.cusps
    ]
    bound = simpson_bound(curve, PANELS)
    bounded = {"panels": PANELS, "length": float(simpson_spans(curve, PANELS).sum()), "bound": bound}
    details: dict[str, Any] = {
        "simpson": [bounded], "control_polygon_length": control_polygon_length(curve), "error": report.error,
        "cusps": list(report.cusps),
    }  # fmt: skip
    if given:
        try:
            found = braking(curve, given["speed"], given["exit_speed"], given["deceleration"])
        except NoSolution as cause:
            return Answer(values, Status.OUT_OF_REACH, (*notes, str(cause)), details=details)
        values |= {
            "braking_distance": found.distance, "braking_length": found.length, "braking_parameter": found.parameter,
            "braking_point": found.point,
        }  # fmt: skip
    return Answer(values, notes=tuple(notes), details=details)


def _quadrature(path: Path, given: Mapping[str, Any]) -> Answer:
    """Adaptive Gauss-Kronrod and a bracketing root, on scipy's evaluation of the spline."""
    curve = path.curve
    spans = quadrature_spans(curve)
    length = float(spans.sum())
    values: dict[str, Any] = {"length": length, "spans": spans}
    if given:
        distance = (given["speed"] ** 2 - given["exit_speed"] ** 2) / (2.0 * given["deceleration"])
        if distance > length:
            return Answer(values, Status.OUT_OF_REACH, (f"the curve is {distance - length:.6g} m too short",))
        wanted = length - distance
        sums = np.concatenate([[0.0], np.cumsum(spans)])
        k = int(np.clip(np.searchsorted(sums, wanted, side="right") - 1, 0, len(spans) - 1))
        low, high = curve.breaks[k], curve.breaks[k + 1]
        u = float(brentq(lambda v: sums[k] + _between(curve, low, v) - wanted, low, high, xtol=1e-15, rtol=1e-14))
        values |= {
            "braking_distance": distance, "braking_length": wanted, "braking_parameter": u, "braking_point": curve.at(u),
        }  # fmt: skip
    return Answer(values)


def _between(curve: BSpline, low: float, high: float) -> float:
    from warnings import catch_warnings, simplefilter

    from scipy.integrate import IntegrationWarning, quad

    with catch_warnings():
        simplefilter("ignore", IntegrationWarning)  # the tolerance asked for is rounding itself
        return float(quad(lambda u: float(curve.speed(u)), low, high, epsabs=0.0, epsrel=1e-13, limit=400)[0])


QUESTION = Question(
    NAME, ("curve",),
    ("length", "spans", "braking_distance", "braking_length", "braking_parameter", "braking_point"),
    {"analytic": _analytic, "quadrature": _quadrature}, dict.fromkeys(BRAKING),
    units=dict.fromkeys(("length", "spans", "braking_distance", "braking_length", "braking_point"), "m") | BRAKING
    | {"curve": "", "braking_parameter": ""},
    text="length of a B-spline curve, of its spans, and the point where braking must begin",
)  # fmt: skip
