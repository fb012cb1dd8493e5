"""Verbs that choose: the best parameters of a mechanism, and what an answer depends on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.api.finding import Source, load
from mechlab.errors import MechlabError, UsageError
from mechlab.lab.ask import parameters_and_rest

if TYPE_CHECKING:
    from mechlab.studies.optimize.result import Optimum
    from mechlab.studies.sensitivity.result import Sensitivity


def optimize(
    source: Source,
    values: Mapping[str, Any] | None = None,
    maximize: str | None = None,
    minimize: str | None = None,
    subject: str | Sequence[str] = (),
    front: str | None = None,
    evaluations: int | None = None,
    seed: int = 0,
    out: str | Path | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    **more: Any,
) -> Optimum:
    """The best parameters of a mechanism for a goal.

    values (and keyword arguments): parameters as ranges, `mechlab.values.Range` or (low, high): the variables; fixed
    parameters; what the quantities need beside them (keys of a question, limits and axes of a workspace, X_rate). maximize,
    minimize: a quantity, see `mechlab.studies.optimize.quantity.measured`. subject: "Q>=value,Q<=value". front: a second goal,
    Q, max:Q or min:Q. What is not said comes from the mechanism's task, where it has one (delta6, gear_linkage, fourbar).
    evaluations: designs of the global search, at least 40 and 24 a variable; the refinement of the best adds to them. out: a
    folder for optimum.json and the front. The same seed gives the same answer. That no design meets the constraints is an
    answer with exit code 4.
    """
    from mechlab.studies.optimize.problem import OptimisationGoal
    from mechlab.studies.optimize.study import optimize as work

    if maximize is not None and minimize is not None:
        raise UsageError("give one goal, maximize or minimize; a second one is the front.")
    named = maximize if maximize is not None else minimize
    goal = None if named is None else OptimisationGoal(named, 1 if maximize is not None else -1)
    folder = None if out is None else Path(out)
    return work(load(source), dict(values or {}) | more, goal, subject, front, evaluations, seed, folder, progress)


def sensitivity(
    source: Source,
    values: Mapping[str, Any] | None = None,
    tolerance: Mapping[str, Any] | float | None = None,
    only: Sequence[str] = (),
    progress: Callable[[int, int], None] = lambda done, total: None,
    **more: Any,
) -> Sensitivity:
    """First-order sensitivity of every answer to every parameter that is a number, from each witness, and tolerances.

    values (and keyword arguments): as `solve`. tolerance: half widths by name, in SI (a given quantity with one is an input
    too), or one number: the share of every parameter. only: inputs by name, default all.
    """
    from mechlab.studies.sensitivity.inputs import Tolerances
    from mechlab.studies.sensitivity.study import sensitivity as work

    if source == "toolpath":
        raise MechlabError("toolpath: a curve of a file has no parameters to vary; sensitivity is for mechanisms.")
    base = load(source)
    parameters, given = parameters_and_rest(base.entry.parameters, dict(values or {}) | more)
    return work(load(base, **parameters), given, Tolerances.of(tolerance), only, progress)
