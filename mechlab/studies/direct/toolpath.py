"""The question `toolpath` on a curve in a file: its length and spans, a place on it, and the point where braking must
begin.

A curve has no bodies, drives or scenes, so it is no catalog entry but a single Question whose parameter is a file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq

from mechlab.analytic.bspline import (
    BSpline,
    Travel,
    arc_length,
    braking,
    braking_distance,
    control_polygon_length,
    quadrature_spans,
    simpson_bound,
    simpson_spans,
)
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.question import Answer, Answers, Question
from mechlab.kit.curve_file import read_curve
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Status
from mechlab.studies.direct.keys import known_keys, number_of

NAME = "toolpath"
BRAKING = {"speed": "m/s", "exit_speed": "m/s", "deceleration": "m/s2"}
PLACE = {"fraction": "", "distance": "m", "parameter": ""}
"""Keys that choose a place on the curve, one at a time: a fraction of its length, the arc length from its start [m], or
the parameter u."""
KEYS = PLACE | BRAKING
PANELS = 64


@dataclass(frozen=True)
class Path:
    """The curve of the question."""

    curve: BSpline


def solve_toolpath(values: Mapping[str, Any]) -> Answers:
    """The answers to curve=FILE.json [fraction=... | distance=... | parameter=...] [speed=... deceleration=... exit_speed=...].

    Raises MechlabError for an unknown or missing key, a bad file, a place outside its limits, or speeds that need no
    braking.
    """
    known_keys(NAME, values, ("curve", *KEYS))
    if "curve" not in values:
        raise MechlabError(f"{NAME}: curve is missing; give curve=FILE.json with the keys degree, knots, points.")
    numbers = {k: number_of(NAME, k, v, KEYS[k], k in PLACE) for k, v in values.items() if k != "curve"}
    if _brakes(numbers):
        missing = [k for k in ("speed", "deceleration") if k not in numbers]
        if missing:
            raise MechlabError(f"{NAME}: {' and '.join(missing)} missing; braking needs speed and deceleration.")
        numbers.setdefault("exit_speed", 0.0)
        braking_distance(numbers["speed"], numbers["exit_speed"], numbers["deceleration"])
    path = Path(read_curve(str(values["curve"])))
    _refuse_place(path.curve, numbers)
    answers = {name: ask(path, numbers) for name, ask in QUESTION.witnesses.items()}
    return Answers(
        QUESTION.name, answers, units=QUESTION.units, parameters={"curve": str(values["curve"])}, given=numbers
    )


def _brakes(given: Mapping[str, Any]) -> bool:
    return any(k in given for k in BRAKING)


def _refuse_place(curve: BSpline, given: Mapping[str, Any]) -> None:
    """Raises MechlabError for two places, a fraction outside 0 to 1, a negative distance, u outside the knots."""
    chosen = [k for k in PLACE if k in given]
    if len(chosen) > 1:
        raise MechlabError(f"{NAME}: {' and '.join(chosen)} are given; expected one of {', '.join(PLACE)}.")
    limits = {"fraction": (0.0, 1.0), "distance": (0.0, np.inf), "parameter": (curve.start, curve.end)}
    for key in chosen:
        low, high = limits[key]
        x = np.asarray(given[key], dtype=float)
        if np.any((x < low) | (x > high)):
            wanted = f"{low:g} to {high:g}" if np.isfinite(high) else f"{low:g} or more"
            worst = float(x.min() if np.any(x < low) else x.max())
            raise MechlabError(f"{NAME}: {key}: expected {wanted}, got {worst:g}.")


def _analytic(path: Path, given: Mapping[str, Any]) -> Answer:
    """Answer by Gauss-Legendre quadrature between the slow points of the curve, and Newton's method for the
    parameter."""
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
    travel = Travel(curve)
    place = _place(curve, given, travel.length, travel.length_at, travel.parameter_at)
    if place.status is not Status.SOLVED:
        return Answer(values, place.status, (*notes, *place.notes), details=details)
    values |= place.values
    if _brakes(given):
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
    """Answer by adaptive Gauss-Kronrod quadrature and a bracketing root search, on scipy's evaluation of the spline."""
    curve = path.curve
    spans = quadrature_spans(curve)
    length = float(spans.sum())
    values: dict[str, Any] = {"length": length, "spans": spans}
    sums = np.concatenate([[0.0], np.cumsum(spans)])

    def span(value: float, ends: Any) -> int:
        return int(np.clip(np.searchsorted(ends, value, side="right") - 1, 0, len(spans) - 1))

    def length_at(u: float) -> float:
        k = span(u, curve.breaks)
        return float(sums[k] + _between(curve, curve.breaks[k], u))

    def parameter_at(s: float) -> float:
        k = span(s, sums)
        low, high = curve.breaks[k], curve.breaks[k + 1]
        miss = [sums[k] - s, sums[k + 1] - s]
        if miss[0] * miss[1] >= 0.0:  # at an end of the span, up to rounding
            return float((low, high)[int(np.argmin(np.abs(miss)))])
        return float(brentq(lambda v: sums[k] + _between(curve, low, v) - s, low, high, xtol=1e-15, rtol=1e-14))

    place = _place(curve, given, length, np.vectorize(length_at), np.vectorize(parameter_at))
    if place.status is not Status.SOLVED:
        return Answer(values, place.status, place.notes)
    values |= place.values
    if _brakes(given):
        distance = (given["speed"] ** 2 - given["exit_speed"] ** 2) / (2.0 * given["deceleration"])
        if distance > length:
            return Answer(values, Status.OUT_OF_REACH, (f"the curve is {distance - length:.6g} m too short",))
        wanted = length - distance
        u = parameter_at(wanted)
        values |= {
            "braking_distance": distance, "braking_length": wanted, "braking_parameter": u, "braking_point": curve.at(u),
        }  # fmt: skip
    return Answer(values)


def _place(
    curve: BSpline,
    given: Mapping[str, Any],
    length: float,
    length_at: Callable[[Any], Any],
    parameter_at: Callable[[Any], Any],
) -> Answer:
    """The place chosen by one key of PLACE, by a witness's own s(u) [m] and u(s); an empty answer without such a
    key."""
    chosen = next((k for k in PLACE if k in given), None)
    if chosen is None:
        return Answer()
    x = np.asarray(given[chosen], dtype=float)
    s = length_at(x) if chosen == "parameter" else x * (length if chosen == "fraction" else 1.0)
    if np.max(s) > length * (1.0 + 1e-12):
        return Answer(
            status=Status.OUT_OF_REACH,
            notes=(f"the curve is {float(np.max(s)) - length:.6g} m too short for this distance",),
        )
    u = x if chosen == "parameter" else parameter_at(s)
    values = {"fraction": s / length, "distance": s, "parameter": u, "point": curve.at(u)}
    del values[chosen]
    return Answer({k: float(v) if np.ndim(v) == 0 else v for k, v in values.items()})


def _between(curve: BSpline, low: float, high: float) -> float:
    from warnings import catch_warnings, simplefilter

    from scipy.integrate import IntegrationWarning, quad

    with catch_warnings():
        simplefilter("ignore", IntegrationWarning)  # the tolerance asked for is rounding itself
        return float(quad(lambda u: float(curve.speed(u)), low, high, epsabs=0.0, epsrel=1e-13, limit=400)[0])


QUESTION = Question(
    NAME, ("curve",),
    ("length", "spans", *PLACE, "point", "braking_distance", "braking_length", "braking_parameter", "braking_point"),
    {"analytic": _analytic, "quadrature": _quadrature}, dict.fromkeys(KEYS),
    units=dict.fromkeys(("length", "spans", "point", "braking_distance", "braking_length", "braking_point"), "m") | KEYS
    | {"curve": "", "braking_parameter": ""},
    text="length of a B-spline curve and of its spans; parameter and point at a fraction or distance of its length, or the "
    "reverse; the point where braking must begin",
)  # fmt: skip
