"""The question `bspline` on a curve in a file: travel along it by a speed law that arrives exactly at its end.

The law needs the length of the curve: to know where braking begins, and to end at the last point and not before or behind it.
Two witnesses: the closed form of the law with Newton's method for u(s), and the numerical solution of u' = s'(t) / |C'(u)|,
which knows nothing of arc lengths along the way.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.analytic.bspline import BSpline, SpeedLaw, Travel, arc_length, quadrature_spans
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.question import Answer, Answers, Question
from mechlab.kit.curve_file import read_curve
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Status
from mechlab.studies.direct.keys import known_keys, number_of

NAME = "bspline"
LAW = {"speed": "m/s", "deceleration": "m/s2", "exit_speed": "m/s", "start_speed": "m/s", "acceleration": "m/s2", "period": "s"}
KEYS = LAW | {"time": "s"}


@dataclass(frozen=True)
class Path:
    """The curve of the question, and what its arc length says of it."""

    curve: BSpline
    cusps: tuple[float, ...]


def solve_bspline(values: Mapping[str, Any]) -> Answers:
    """The answers to curve=FILE.json speed=... deceleration=... [exit_speed= start_speed= acceleration= period= time=...].

    Raises MechlabError for an unknown or missing key, a bad file, or numbers outside their limits.
    """
    known_keys(NAME, values, ("curve", *KEYS))
    missing = [k for k in ("curve", "speed", "deceleration") if k not in values]
    if missing:
        raise MechlabError(
            f"{NAME}: {' and '.join(missing)} missing; give curve=FILE.json (degree, knots, points), speed and deceleration."
        )
    numbers = {k: number_of(NAME, k, v, KEYS[k], k == "time") for k, v in values.items() if k != "curve"}
    if np.any(np.asarray(numbers.get("time", 0.0)) < 0.0):
        raise MechlabError(f"{NAME}: time: expected 0 or more, got {float(np.min(numbers['time'])):g}.")
    curve = read_curve(str(values["curve"]))
    try:
        answers = {who: ask(Path(curve, arc_length(curve).cusps), numbers) for who, ask in QUESTION.witnesses.items()}
    except NoSolution:
        raise
    except MechlabError as error:
        raise MechlabError(f"{NAME}: {error}") from None
    return Answers(QUESTION.name, answers, units=QUESTION.units, parameters={"curve": str(values["curve"])}, given=numbers)


def _law(length: float, given: Mapping[str, Any]) -> SpeedLaw:
    """The law on a length; on the ticks of a period where one is given."""
    chosen = {k: given[k] for k in LAW if k in given and k != "period"}
    law = SpeedLaw(length, **chosen)
    return law.on_ticks(given["period"]) if "period" in given else law


def _analytic(path: Path, given: Mapping[str, Any]) -> Answer:
    """Answer by the closed form of the law, and Newton's method for the parameter at an arc length."""
    travel = Travel(path.curve)
    try:
        law = _law(travel.length, given)
    except NoSolution as cause:
        return Answer({"length": travel.length}, Status.OUT_OF_REACH, (str(cause),))
    notes = [
        f"the curve stands still at u = {u:.9g} (a cusp): its direction jumps there, so that no tool passes at this speed"
        for u in path.cusps
    ]
    if law.top_speed < law.speed:
        notes.append(f"the curve is too short for {law.speed:g} m/s: the tool reaches {law.top_speed:.6g} m/s")
    if "period" in given:
        notes.append(f"deceleration lowered to {law.deceleration:.9g} m/s2, so that the arrival is on a tick")
    return Answer(_values(path.curve, law, given, travel.parameter_at), notes=tuple(notes))


def _stepping(path: Path, given: Mapping[str, Any]) -> Answer:
    """Answer by integrating u' = s'(t) / |C'(u)| over the time of the law; the length by adaptive quadrature."""
    if path.cusps:
        return Answer(cannot=f"at u = {path.cusps[0]:.9g} the curve stands still, where u' has no value")
    length = float(quadrature_spans(path.curve).sum())
    try:
        law = _law(length, given)
    except NoSolution as cause:
        return Answer({"length": length}, Status.OUT_OF_REACH, (str(cause),))
    asked = np.ravel(np.asarray(given.get("time", ()), dtype=float))
    times = np.clip([law.braking_time, law.duration, *asked], 0.0, law.duration)
    found = _integrated(path.curve, law, times)
    lengths = law.at(times)

    def parameter_at(s: Any) -> Any:
        """u at one of the lengths."""
        return found[np.argmin(np.abs(lengths - np.asarray(s)[..., None]), axis=-1)]

    return Answer(_values(path.curve, law, given, parameter_at))


def _integrated(curve: BSpline, law: SpeedLaw, times: Any) -> Any:
    """u at times, piece by piece between the bends of the law. Steps are short, as u' loses its smoothness at the knots."""
    from scipy.integrate import solve_ivp

    def slope(t: float, u: Any) -> Any:
        v = np.clip(u, curve.start, curve.end)
        return law.rate(t) / curve.speed(v)

    bends = np.unique(np.clip([0.0, law.braking_time, law.duration, *times], 0.0, law.duration))
    u, out = np.array([curve.start]), {float(bends[0]): curve.start}
    for start, end in zip(bends[:-1], bends[1:], strict=True):
        u = solve_ivp(slope, (start, end), u, method="DOP853", max_step=law.duration / 400, rtol=1e-12, atol=1e-14).y[:, -1]
        out[float(end)] = float(u[0])
    return np.array([out[float(t)] for t in times])


def _values(curve: BSpline, law: SpeedLaw, given: Mapping[str, Any], parameter_at: Any) -> dict[str, Any]:
    """Arrival, braking point and places at times, with a witness's own u(s)."""
    brake, end = law.braking_time, law.duration
    arrived = float(parameter_at(law.at(end)))
    u_end, u_brake = min(arrived, curve.end), min(float(parameter_at(law.at(brake))), curve.end)
    beyond = (arrived - u_end) * float(curve.speed(curve.end))
    values: dict[str, Any] = {
        "length": law.length, "duration": end, "top_speed": law.top_speed, "braking_time": brake,
        "braking_length": float(law.at(brake)), "braking_parameter": u_brake, "braking_point": curve.at(u_brake),
        "end_parameter": u_end, "end_point": curve.at(u_end), "end_rate": float(law.rate(end)),
        "end_gap": float(np.linalg.norm(curve.at(u_end) - curve.at(curve.end))) + beyond,
    }  # fmt: skip
    if "period" in given:
        values["ticks"] = float(round(end / given["period"]))
    if "time" in given:
        t = np.asarray(given["time"], dtype=float)
        s = law.at(np.clip(t, 0.0, end))
        u = np.minimum(parameter_at(s), curve.end)
        places = {"distance": s, "rate": law.rate(t), "parameter": u, "point": curve.at(u)}
        values |= {k: float(v) if np.ndim(v) == 0 else v for k, v in places.items()}
    return values


QUESTION = Question(
    NAME, ("curve", "speed", "deceleration"),
    (
        "length", "duration", "top_speed", "braking_time", "braking_length", "braking_parameter", "braking_point", "end_parameter",
        "end_point", "end_rate", "end_gap", "ticks", "distance", "rate", "parameter", "point",
    ),
    {"analytic": _analytic, "stepping": _stepping}, dict.fromkeys(k for k in KEYS if k not in ("speed", "deceleration")),
    units=dict.fromkeys(("length", "braking_length", "braking_point", "end_point", "end_gap", "distance", "point"), "m")
    | dict.fromkeys(("duration", "braking_time"), "s") | dict.fromkeys(("top_speed", "end_rate", "rate"), "m/s") | KEYS
    | dict.fromkeys(("curve", "braking_parameter", "end_parameter", "parameter", "ticks"), ""),
    text="travel along a B-spline curve that arrives exactly at its end: when and where braking begins, the arrival, the place at a "
    "time; with a period, the arrival is on a tick of it",
)  # fmt: skip
