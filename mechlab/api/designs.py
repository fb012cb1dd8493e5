"""Verbs that seek or compare designs: the best one, parameters from measurements, dimensions from wanted properties."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.api.arguments import (
    Compared,
    Count,
    Engine,
    File,
    Progress,
    Task,
    Values,
    Whole,
    as_range,
    key_values,
    silent,
)
from mechlab.api.finding import Source, find, load_design
from mechlab.api.studies import LISTS
from mechlab.errors import UsageError, explained
from mechlab.values import Value

if TYPE_CHECKING:
    from mechlab.studies.compare import Comparison
    from mechlab.studies.fit.result import FitResult
    from mechlab.studies.optimize.result import Optimum
    from mechlab.studies.synthesis import SynthesisResult


@explained
def optimize(
    source: Source,
    values: Values | None = None,
    /,
    *,
    maximize: str | None = None,
    minimize: str | None = None,
    subject: str | Sequence[str] = (),
    front: str | None = None,
    evaluations: Count | None = None,
    seed: Whole = 0,
    out: File | None = None,
    progress: Progress = silent,
    **given: Value,
) -> Optimum:
    """The best parameters of a mechanism for a goal.

    Keys: parameters as ranges are the variables; fixed parameters; what the quantities need beside them (keys of a question,
    limits and axes of a workspace, X_rate). What is not given comes from the mechanism's task, where it has one (delta6,
    gear_linkage, fourbar). That no design meets the constraints is an answer with exit code 4.

    Options:
        maximize=Q: a quantity: a parameter, an answer, reach, volume, cycle.peak.COLUMN, ...
        minimize=Q: a quantity
        subject=Q>=v,Q<=v: constraints; quote them for the shell
        front=Q2: the front against a second goal: Q2, max:Q2 or min:Q2
        evaluations=N: designs of the global search, at least 40 and 24 a variable; refining the best adds some
        seed=N: another seed, another search; the same seed, the same answer
        out=DIR: folder for optimum.json, and front.csv, front.png, front.svg
    """
    if maximize is not None and minimize is not None:
        raise UsageError("give one goal, `maximize` or `minimize`; a second one is the `front`.")
    from mechlab.experiment.parameters import describe
    from mechlab.studies.optimize.problem import OptimisationGoal
    from mechlab.studies.optimize.study import optimize as study

    quantity = minimize if maximize is None else maximize
    goal = None if quantity is None else OptimisationGoal(quantity, -1 if maximize is None else 1)
    base = load_design(source, {})
    numbers = {i.name for i in describe(base.entry.parameters) if i.kind not in (*LISTS, "text")}
    asked: dict[str, Any] = {
        k: (as_range(k, v) or v) if k in numbers else v for k, v in key_values(values, given).items()
    }
    folder = None if out is None else Path(out)
    return study(base, asked, goal, subject, front, evaluations, seed, folder, progress)


@explained
def fit(
    source: Source,
    data: File | Values,
    values: Values | None = None,
    /,
    *,
    free: Sequence[str] = (),
    noise: Values | None = None,
    scene: str | None = None,
    fidelity: str | None = None,
    engine: Engine | None = None,
    starts: int | None = None,
    out: File | None = None,
    progress: Progress = silent,
    **given: Value,
) -> FitResult:
    """Parameters from measured series by least squares, with 95 % confidence intervals and a verdict on what the data determine.

    data: a CSV file as `view --csv` writes it, or a mapping of its columns. Heads are "name [unit]", empty cells are gaps. A first
    column t [s] means a run of a scene; any other first column is a drive or a given quantity, and the others are answers. Keys: unknowns
    as ranges (parameters, X_0, X_rate_0); fixed parameters, initial values and loads as numbers. Exit code 3: something is not
    determined, did not converge, or another engine does not confirm it. See `mechlab.studies.fit`.

    Options:
        free=A,B,...: unknowns without a range, from their present value: parameters, entries as NAME[k], X_0, X_rate_0
        noise=CHANNEL=S,...: standard deviation of measured channels in SI (default: from the residual)
        scene=S: the scene that was measured; `mechlab show NAME` lists them
        fidelity=F: level of fidelity
        engine=E: who fits; default: the cheapest that agrees with the scene's own
        starts=N: search from N places in the ranges (default: 1, and 8 where its end is doubtful and all unknowns have ranges)
        out=DIR: folder for fit.json, fit.csv (measured and fitted) and fit.png
    """
    from mechlab.experiment.parameters import describe
    from mechlab.studies.fit.study import fit as study

    base = load_design(source, {})
    lists = {i.name for i in describe(base.entry.parameters) if i.kind in LISTS}
    asked = {k: v if k in lists else as_range(k, v) or v for k, v in key_values(values, given).items()}
    names = [free] if isinstance(free, str) else free
    folder = None if out is None else Path(out)
    stated = None if noise is None else key_values(noise, {})
    return study(base, data, asked, names, scene, fidelity, engine, stated, starts, folder, progress)


@explained
def synthesize(task: Task, values: Values | None = None, /, *, progress: Progress = silent, **given: Value) -> SynthesisResult:
    """Dimensions from wanted properties: the solutions of a task, or what is reachable instead. See `mechlab.studies.synthesis`."""
    from mechlab.studies.synthesis import synthesize as study

    return study(task, key_values(values, given), find, progress)


@explained
def compare(task: Compared, /, *, out: File | None = None, progress: Progress = silent) -> Comparison:
    """Mechanisms of one purpose beside each other: which straight line is straightest, which quick return cuts most evenly, which leg
    walks most evenly.

    Options:
        out=F: a page with table and charts (.html), which links the mechanisms that stand beside it as in the gallery; .csv; .json
    """
    from mechlab import catalog
    from mechlab.catalog.table import TABLE
    from mechlab.studies.compare import compare as study
    from mechlab.studies.compare import family_of

    family = family_of(task)
    found = study(task, [catalog.entry(row.name) for row in TABLE if row.family == family], progress)
    if out is not None:
        found.save(out)
    return found
