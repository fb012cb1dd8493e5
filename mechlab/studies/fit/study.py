"""The fit study: from measured series and names of unknowns to values, intervals and verdicts."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

from mechlab.errors import MechlabError
from mechlab.experiment.parameters import describe
from mechlab.files import whole_folder, write
from mechlab.lab.ask import in_si, numeric
from mechlab.lab.design import Design
from mechlab.mechanism.geometry import Array
from mechlab.studies.fit.identify import Identifiability, identifiability
from mechlab.studies.fit.predictions import Predictions, RunPredictions, question_predictions
from mechlab.studies.fit.report import draw
from mechlab.studies.fit.result import ChannelResidual, FitResult, FittedParameter, channel_residual
from mechlab.studies.fit.solve import FitProblem, LeastSquares, minimise
from mechlab.studies.fit.starts import from_many
from mechlab.studies.fit.table import TIME, Data, MeasuredTable, noise_of, read_table
from mechlab.studies.fit.unknowns import FitUnknown, applied, unknowns_of
from mechlab.studies.named.number import varied
from mechlab.tables import csv_text, listed
from mechlab.values import Range

LEVEL = 0.95
"""Probability that an interval covers the true value."""
SAME = 0.3
"""Standard errors by which the scene's own engine may move a parameter before it fits again itself."""
DONE = 0.05
"""Standard errors that the next Gauss-Newton step may still be at a least square."""
MORE = 8
"""Starts of a fit whose first end is doubtful."""
NEAR_END = 1e-6
"""Distance from an end of a range, relative to the scale, that counts as at the end."""


def fit(
    base: Design,
    data: Data,
    values: Mapping[str, Any],
    free: Sequence[str] = (),
    scene: str | None = None,
    fidelity: str | None = None,
    engine: str | None = None,
    noise: Mapping[str, Any] | None = None,
    starts: int | None = None,
    out: Path | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> FitResult:
    """Identify the unknowns from measured series.

    values: unknowns as ranges; other parameters, initial values and loads as numbers. free: unknowns without a range. The first column
    of the data decides: the time t means a run of the scene, anything else a question, whose given quantities stand in columns.
    engine: who fits, an engine or a witness; default the cheapest, and the scene's own where that differs too much. noise: standard
    deviation of channels in SI; default: estimated from the residual. starts: places in the ranges where a search begins; default: 1,
    and MORE where its end is doubtful and every unknown has a range. out: folder for fit.json, fit.csv and fit.png.
    Raises MechlabError for wrong columns, units, times, names and ranges.
    """
    table = read_table(data)
    ranges, fixed, rest = _sorted(base, values)
    start = varied(base, fixed)
    if table.over_time:
        predictions, unknowns = _of_runs(start, table, ranges, rest, free, scene, fidelity, engine)
    else:
        if scene is not None or fidelity is not None:
            raise MechlabError(f"{table.where}: scene and fidelity are for data over time, whose first column is {TIME} [s].")
        constants = {k: float(numeric(k, v)) for k, v in in_si(start, rest).items()}
        unknowns = unknowns_of(start, ranges, free, None, False)
        predictions = question_predictions(start, table, constants, engine)
    measured = table.in_units(predictions.units)
    stated = noise_of(table.where, None if noise is None else {k: float(numeric(k, v)) for k, v in noise.items()}, list(measured))
    problem = FitProblem(
        start, unknowns, predictions, measured, stated, predictions.ways[0], lambda done: progress(done, max(done, 20 * len(unknowns)))
    )
    ran = (scene or start.default_scene) if table.over_time else ""
    begin, tried = np.array([u.start for u in unknowns]), None
    if starts is not None and starts != 1:
        begin, tried = from_many(problem, begin, starts)
    made = replace(_fit_from(problem, table, begin), scene=ran, tried=tried)
    bounded = all(np.isfinite([u.low, u.high]).all() for u in unknowns)
    if starts is None and bounded and made.is_doubtful:
        problem.unknowns = unknowns
        begin, tried = from_many(problem, begin, MORE)
        made = replace(_fit_from(problem, table, begin), scene=ran, tried=tried)
    return made if out is None else _write(made, out)


def _fit_from(problem: FitProblem, table: MeasuredTable, begin: Array) -> FitResult:
    """The fit that begins at the unknowns (p,), with its notes."""
    starts = {u.name: u.start for u in problem.unknowns}
    found, verdict, shift, differences, confirmed = _fitted(problem, begin)
    made = _result(problem, table, found, verdict, shift, starts)
    return replace(made, differences=differences, confirmed_by=confirmed, notes=_notes(made))


def _sorted(base: Design, values: Mapping[str, Any]) -> tuple[dict[str, Range], dict[str, Any], dict[str, Any]]:
    """Ranges, fixed parameters, and what is left."""
    names = {i.name for i in describe(base.entry.parameters)}
    ranges = {k: v for k, v in values.items() if isinstance(v, Range)}
    others = {k: v for k, v in values.items() if k not in ranges}
    return ranges, {k: v for k, v in others.items() if k in names}, {k: v for k, v in others.items() if k not in names}


def _of_runs(
    base: Design, table: MeasuredTable, ranges: Mapping[str, Range], rest: Mapping[str, Any], free: Sequence[str],
    scene: str | None, fidelity: str | None, engine: str | None,
) -> tuple[Predictions, tuple[FitUnknown, ...]]:  # fmt: skip
    t = table.in_units({TIME: "s"})[TIME]
    if t[-1] <= 0.0:
        raise MechlabError(f"{table.where}: the last time must be later than 0 s, got {t[-1]:g} s.")
    unknowns = unknowns_of(base.for_scene(scene), ranges, free, scene, True)
    loads = {k: float(numeric(k, v)) for k, v in rest.items()}
    states = any(u.initial for u in unknowns)
    channels = tuple(n for n in table.columns if n != TIME)
    predictions = RunPredictions(base, scene, fidelity, t, channels, loads, engine, states)
    predictions.units  # noqa: B018 - a wrong column is named before anything runs
    return predictions, unknowns


def _fitted(problem: FitProblem, x: Array) -> tuple[LeastSquares, Identifiability, Array | None, dict[str, float], str]:
    """The fit by the first way that the next one confirms, among those that may fit."""
    noise = None
    ways = problem.predictions.ways
    for k in range(problem.predictions.trial):
        problem.way = ways[k]
        found = minimise(problem, x, noise)
        problem.unknowns, found = _rescaled(problem.unknowns, found)
        verdict = identifiability(found.jacobian, problem.unknowns, found.factor)
        errors = np.sqrt(np.diag(verdict.covariance) * found.factor) * problem.scales
        shift, confirmed = None, ""
        differences: dict[str, float] = {}
        for other in ways[k + 1 :]:
            try:
                shift, differences = _shift(problem, found, verdict, other)
            except MechlabError:
                continue
            confirmed = other
            break
        if shift is None or np.all(np.abs(shift) <= SAME * errors):
            break
        x, noise = found.x, found.noise
    return found, verdict, shift, differences, confirmed


def _rescaled(unknowns: tuple[FitUnknown, ...], found: LeastSquares) -> tuple[tuple[FitUnknown, ...], LeastSquares]:
    """The unknowns that count relatively by their value at the end, and J by those scales."""
    new = tuple(
        replace(u, start=x, scale=abs(x)) if u.relative and u.scale == abs(u.start) and x != 0.0 else u
        for u, x in zip(unknowns, found.x.tolist(), strict=True)
    )
    factors = np.array([b.scale / a.scale for a, b in zip(unknowns, new, strict=True)])
    return new, replace(found, jacobian=found.jacobian * factors)


def _shift(problem: FitProblem, found: LeastSquares, verdict: Identifiability, way: str) -> tuple[Array, dict[str, float]]:
    """What a Gauss-Newton step on the predictions of another way changes (p,), and channel -> rms difference over its noise."""
    other, own = problem.residuals(found.x, way), found.residuals
    gaps = {n: (other[n] - own[n]) / found.noise[n] for n in own}
    step = verdict.covariance @ (found.jacobian.T @ np.concatenate(list(gaps.values())))
    return step * problem.scales, {n: float(np.sqrt(np.mean(g**2))) for n, g in gaps.items()}


def _result(
    problem: FitProblem, table: MeasuredTable, found: LeastSquares, verdict: Identifiability, shift: Array | None,
    starts: Mapping[str, float],
) -> FitResult:  # fmt: skip
    errors = np.sqrt(np.diag(verdict.covariance) * found.factor) * problem.scales
    quantile = float(student.ppf(0.5 + 0.5 * LEVEL, found.degrees))
    parameters = {}
    for k, u in enumerate(problem.unknowns):
        x, error = float(found.x[k]), float("nan") if u.name in verdict.open else float(errors[k])
        at_end = min(x - u.low, u.high - x) <= NEAR_END * u.scale
        moved = None if shift is None or u.name in verdict.open else float(shift[k])
        parameters[u.name] = FittedParameter(
            u.name, u.unit, x, error, x - quantile * error, x + quantile * error, starts[u.name], moved, at_end
        )
    ends = np.array([p.at_end for p in parameters.values()])
    step = verdict.covariance @ (found.jacobian.T @ found.weighted) * problem.scales
    still = np.abs(step) <= DONE * np.maximum(errors, 1e-9 * problem.scales)
    units = problem.predictions.units
    channels: dict[str, ChannelResidual] = {
        n: channel_residual(n, units[n], r, problem.rows[n], found.noise[n], n in problem.stated) for n, r in found.residuals.items()
    }
    predicted = problem.series(found.x)
    name = table.first
    return FitResult(
        applied(problem.base, problem.unknowns, found.x)[0], table.where, "", parameters, channels, verdict,
        found.ended and bool(np.all(still | ends)), found.factor, found.degrees, problem.way, "", {}, problem.runs,
        (name, table.units[name] or ("s" if table.over_time else ""), table.columns[name]),
        {n: (problem.measured[n], predicted[n]) for n in problem.measured},
    )  # fmt: skip


def _notes(found: FitResult) -> tuple[str, ...]:
    bad = [c for c in found.channels.values() if not (c.is_white and c.is_unbiased)]
    if not bad:
        return ()
    return (
        f"the residuals of {listed([c.name for c in bad])} are not white: the model lacks something that the measurements show, "
        "and the true errors are larger than the standard errors; or the values are those of a local least square, which ranges for all "
        "unknowns and several starts would tell",
    )


def _write(found: FitResult, folder: Path) -> FitResult:
    """fit.json, fit.csv (measured, predicted) and fit.png; the result with the paths of the files."""
    names = {"fit": "fit.json", "series": "fit.csv", "picture": "fit.png"}
    done = replace(found, files={kind: folder / name for kind, name in names.items()})
    first, unit, x = found.first
    heads, columns = [f"{first} [{unit}]" if unit else first], [x]
    for name, both in found.series.items():
        of = f" [{found.channels[name].unit}]" if found.channels[name].unit else ""
        heads += [f"{name}{of}", f"{name} fitted{of}"]
        columns += both
    cells = [[repr(float(v)) if np.isfinite(v) else "" for v in row] for row in zip(*columns, strict=True)]
    with whole_folder(folder) as stage:
        write(stage / names["series"], csv_text([heads, *cells], "\r\n"))
        draw(found, stage / names["picture"])
        write(stage / names["fit"], json.dumps(done.to_dict(), indent=2, default=_plain) + "\n")
    return done


def _plain(item: Any) -> Any:
    return item.tolist() if hasattr(item, "tolist") else str(item)
