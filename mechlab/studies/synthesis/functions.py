"""Synthesis of function generators: four-bars whose output angle follows a function of the input angle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import remainder
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.function_generation import (
    EXACT,
    FunctionFourbar,
    FunctionTask,
    chebyshev_points,
    function_fourbars,
)
from mechlab.analytic.path_synthesis.sixbar_function import FunctionSixbar, function_sixbars
from mechlab.errors import MechlabError
from mechlab.mechanism.newton import Status
from mechlab.studies.synthesis.built import Built, led, rounded
from mechlab.studies.synthesis.expression import function_of_x
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.result import SynthesisResult
from mechlab.values import Range

Array = NDArray[np.float64]
POINTS = 100
"""Most precision points."""
CLOSE = 1e-7
"""Largest difference between the output angle of the engine and that of the closed form [rad]."""
SPREAD = 1e-9
"""Least way of y from its first to its last value, relative to its largest value."""


def function(given: Given) -> SynthesisResult:
    """Four-bars that generate a function, or six-bars: see `mechlab.analytic.function_generation` and `path_synthesis.sixbar_function`.

    y is a list, or a text such as log10(x).
    """
    xs, ys, known, ends = _points(given)
    turn, turn_out = (given.within(k, "rad", np.radians(60.0), -2 * np.pi, 2 * np.pi) for k in ("turn", "turn_out"))
    if turn == 0.0 or turn_out == 0.0:
        raise given.refuse("turn" if turn == 0.0 else "turn_out", "an angle that is not 0")
    low, high = ends
    y0, y1 = (float(known(np.array([x]))[0]) for x in ends) if known else (ys[0], ys[-1])
    if abs(y1 - y0) <= SPREAD * float(np.max(np.abs(ys))):
        raise MechlabError("synthesize function: y ends where it began, so it has no scale on the output; take a part of its range.")

    def output(y: Array) -> Array:
        return np.asarray(turn_out * (y - y0) / (y1 - y0))

    wanted = (lambda s: output(known(low + (high - low) * s / turn))) if known else None
    first, first_out = (given.number(k, "rad") if k in given.values else None for k in ("first", "first_out"))
    task = FunctionTask(
        turn * (xs - low) / (high - low), output(ys), turn, first, first_out, wanted,
        given.within("transmission_angle_min", "rad", np.radians(30.0), 0.0, np.radians(80.0)), given.within("ratio", "", 10.0, 1.0, 1e4),
    )  # fmt: skip
    ground, limit, six = given.within("ground", "m", 0.2, 1e-9, 1e9), given.integer("limit", 3, 1, 50), given.six_bar()
    if six and not (first is None or first_out is None):
        raise MechlabError("synthesize function: a six-bar is turned as a whole, so give first or first_out, not both.")
    found: Sequence[FunctionFourbar | FunctionSixbar] = (
        function_sixbars(task, progress=given.progress) if six else function_fourbars(task, given.progress)
    )
    left_out = {"branch": sum(f.defect == "branch" for f in found), "transmission_angle": 0, "engine": 0}
    solutions = list[dict[str, Any]]()
    for f in (f for f in found if not f.defect):
        # the search trades the angle against the error, so that it may fall a little short of it
        if f.least_transmission_angle < task.least - np.radians(0.1):
            left_out["transmission_angle"] += 1
        elif len(solutions) < limit:
            row = _verified(given, f, task, ground)
            if row is None:
                left_out["engine"] += 1
            else:
                solutions.append(row)
    data = {
        "count": len(solutions), "solutions": solutions, "left_out": left_out, "precision_points": {"x": xs.tolist(), "y": ys.tolist()},
        "unknowns": 11 if six else task.unknowns,
    }  # fmt: skip
    named = "six-bar" if six else "four-bar"
    if not solutions:
        text = (
            f"no {named} generates these {len(xs)} points within a transmission angle of {np.degrees(task.least):.3g} deg and bars of "
            f"1 to {task.ratio:g} ({left_out['branch']} jump the branch, {left_out['transmission_angle']} transmit worse). Leave first or "
            "first_out free, change turn or turn_out, take a smaller transmission_angle_min, or more points (then the least squares)"
        )
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    best = solutions[0]
    exact = len(xs) <= task.unknowns and not six or best["point_error"] < EXACT
    how = "exactly" if exact else f"within {np.degrees(best['point_error']):.4g} deg"
    text = f"a {named} meets the {len(xs)} points {how}"
    if known:
        share = 100.0 * best["range_error"] / abs(turn_out)
        text += f"; over the whole range it errs by at most {np.degrees(best['range_error']):.4g} deg, {share:.3g} % of the output range"
    if not six and best["parameters"]["coupler"] == ground and best["parameters"]["crank"] == best["parameters"]["rocker"]:
        text += "; it is a parallelogram, which any crank makes, and which could fold where it lies flat"
    names = ("range_error", "point_error", "least_transmission_angle", "crank_turns", "first", "first_out")
    bars = ("crank", "coupler", "rocker", "ground", *(("link", "output") if six else ()))
    rows = tuple((*(s["parameters"][k] for k in bars), *(s[n] for n in names)) for s in solutions)
    return SynthesisResult(given.task, Status.SOLVED, text, data, (*bars, *names), rows, tuple(s["command"] for s in solutions))


def _points(given: Given) -> tuple[Array, Array, Callable[[Array], Array] | None, tuple[float, float]]:
    """x and y of the precision points, the function where it is known, and the range of x."""
    y, x = given.values.get("y"), given.values.get("x")
    if not isinstance(y, str):
        if "points" in given.values:
            raise MechlabError("synthesize function: points spaces a function, such as y=log10(x); with y as a list the points are given.")
        xs = np.array(given.numbers("x", "", 3, POINTS))
        return xs, np.array(given.numbers("y", "", len(xs), len(xs))), None, (float(xs[0]), float(xs[-1]))
    known = function_of_x(y)
    if isinstance(x, Range) and x.count is None:
        xs = chebyshev_points(float(x.low), float(x.high), given.integer("points", 3, 3, POINTS))
        ends = float(x.low), float(x.high)
    else:
        xs = np.array(given.numbers("x", "", 3, POINTS))
        ends = float(xs[0]), float(xs[-1])
    if not ends[1] != ends[0]:
        raise given.refuse("x", "a range low:high")
    over = known(np.linspace(*ends, 1001))
    if not np.all(np.isfinite(over)):
        raise MechlabError(f"synthesize function: y={y} is not finite over x from {ends[0]:g} to {ends[1]:g}.")
    return xs, known(xs), known, ends


def _verified(
    given: Given, f: FunctionFourbar | FunctionSixbar, task: FunctionTask, ground: float
) -> dict[str, Any] | None:
    """The linkage as an entry, with the output angles that an engine measures; None where the engine does not follow."""
    if isinstance(f, FunctionSixbar):
        f, entry, sizes = _six_parameters(f, task, ground)
        name = "output_angle"
    else:
        entry, name = "path_fourbar", "rocker_angle"
        sizes = {
            "ground": ground, "crank": f.crank * ground, "coupler": f.coupler * ground, "rocker": f.rocker * ground, "mode": f.mode,
            "point": 0.5 * f.coupler * ground, "point_angle": 0.0,
        }  # fmt: skip
    crank = f.first + np.concatenate([[0.0], task.turned, [task.turn]])
    order = np.argsort(crank * np.sign(task.turn))
    built = Built(entry, rounded(sizes | {"first": f.first, "turn": task.turn}), crank[order])
    seen = led(given.find, built, (name,))
    if seen is None:
        return None
    witness, values = seen
    errors = f.errors
    if witness:
        angle = np.empty(len(crank))
        angle[order] = values[name]
        errors = np.angle(np.exp(1j * (angle[1:-1] - f.first_out - task.output)))
    if np.max(np.abs(errors - f.errors)) > CLOSE:
        return None
    facts = {
        "range_error": None if np.isnan(f.range_error) else f.range_error, "point_error": float(np.max(np.abs(errors))),
        "errors": errors.tolist(), "least_transmission_angle": f.least_transmission_angle, "crank_turns": f.crank_turns,
        "first": f.first, "first_out": f.first_out, "measured_by": witness or "closed form",
    }  # fmt: skip
    return replace(built, facts=facts).to_dict()


def _six_parameters(f: FunctionSixbar, task: FunctionTask, ground: float) -> tuple[FunctionSixbar, str, dict[str, float | int]]:
    """The six-bar turned so that its scales begin where they are to, and the parameters of path_stephenson; its point is the joint E."""
    tilt = task.first - f.first if task.first is not None else task.first_out - f.first_out if task.first_out is not None else 0.0
    scale, pivot = ground / f.ground, f.pivot * np.exp(1j * tilt)
    sizes: dict[str, float | int] = {
        "tilt": remainder(tilt, 2.0 * np.pi), "ground": ground, "crank": scale, "coupler": f.coupler * scale, "rocker": f.rocker * scale,
        "mode": f.mode, "joint": abs(f.point) * scale, "joint_angle": float(np.angle(f.point)), "link": f.link * scale,
        "output": f.output * scale, "output_x": pivot.real * scale, "output_y": pivot.imag * scale, "mode_output": f.side,
        "point": f.link * scale, "point_angle": 0.0,
    }  # fmt: skip
    first = remainder(f.first + tilt, 2.0 * np.pi) if task.first is None else task.first
    first_out = remainder(f.first_out + tilt, 2.0 * np.pi) if task.first_out is None else task.first_out
    return replace(f, first=first, first_out=first_out), "path_stephenson", sizes
