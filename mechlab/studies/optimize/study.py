"""The optimization study: from keys and values to the best design and its checks."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError, UsageError
from mechlab.experiment.parameters import describe
from mechlab.files import whole_folder, write
from mechlab.lab.ask import in_si
from mechlab.lab.design import Design
from mechlab.studies.named.number import varied
from mechlab.studies.optimize.problem import (
    TASKS,
    OptimisationGoal,
    OptimisationProblem,
    TriedDesign,
    given_ranges,
    read_constraints,
    read_goal,
    split_constraints,
    variables_of,
)
from mechlab.studies.optimize.quantity import quantity_set, workspace_names
from mechlab.studies.optimize.report import draw, rows
from mechlab.studies.optimize.result import Optimum
from mechlab.studies.optimize.search import LEVELS, MEMBERS, SHARE, fewest, search
from mechlab.studies.optimize.search import front as front_of
from mechlab.tables import counted, csv_text

EACH = 250
"""Evaluations for each variable where no number is given."""


def optimize(
    base: Design,
    values: Mapping[str, Any],
    goal: OptimisationGoal | None = None,
    subject: str | Sequence[str] = (),
    front: str | OptimisationGoal | None = None,
    evaluations: int | None = None,
    seed: int = 0,
    out: Path | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Optimum:
    """The best design.

    values: parameters as ranges (the variables) or fixed values, and the keys that the quantities need. Without a goal,
    the predefined task of the mechanism supplies the goal and every variable, constraint and fixed value not given.
    front: the second goal. out: a folder for optimum.json, and front.csv, front.png, front.svg. The same seed gives the
    same answer. Raises MechlabError for invalid input; when no design meets the constraints the result says so
    (exit code 4).
    """
    ranges, fixed, rest = given_ranges(base, values)
    rest = in_si(base, rest)
    task = TASKS.get(base.entry.name)
    by_task = task is not None and goal is None
    if task is not None and goal is None:
        goal, ranges = task.goal, ranges or {k: v for k, v in task.variables.items() if k not in fixed}
        subject = subject or task.subject
        _, own, others = given_ranges(base, task.given)
        fixed = {k: v for k, v in own.items() if k not in ranges} | fixed
        rest = others | rest
        evaluations = task.evaluations if evaluations is None else evaluations
    if goal is None:
        named = ", ".join(TASKS)
        raise UsageError(
            f"{base.name}: say what is wanted: --maximize QUANTITY or --minimize QUANTITY. Without words: {named}."
        )
    if not ranges:
        raise MechlabError(
            f"{base.name}: no parameter may vary; give at least one as a range, key=low:high. "
            f"Parameters: {', '.join(i.name for i in describe(base.entry.parameters))}."
        )
    second = _second(front, task.front if task else None)
    start_design = varied(base, fixed)
    wishes = split_constraints(subject) if subject else []
    wanted = [goal.quantity, *(w[0] for w in wishes), *([second.quantity] if second else [])]
    tell = _spelled(start_design)
    goal, second = (
        replace(goal, quantity=tell(goal.quantity)),
        second and replace(second, quantity=tell(second.quantity)),
    )
    measure = quantity_set(start_design, [tell(n) for n in wanted], rest)
    spelled = [f"{tell(n)}{'>=' if s > 0 else '<='}{b}" for n, s, b in wishes]
    variables = variables_of(start_design, ranges)
    count = EACH * len(variables) if evaluations is None else evaluations
    if count < fewest(len(variables)):
        raise MechlabError(
            f"evaluations: a search over {counted(len(variables), 'variable')} tries a first generation of designs before it refines "
            f"the best; expected {fewest(len(variables))} or more, got {count}."
        )
    problem = OptimisationProblem(
        start_design, variables, goal, read_constraints(spelled, measure.units) if spelled else (), measure
    )
    size = max(20, MEMBERS * len(variables))
    total = max(count, size) + 300
    total += max(count, size) + 2 * LEVELS * max(count // SHARE, size) if second else 0
    problem.report = lambda done: progress(min(done, total), total)
    start = _start(problem)
    inside = not start.failure and problem.inside(start.x) == start.x
    best = search(problem, goal, problem.constraints, count, seed, [start] if inside else [])
    known = [t for t in problem.trials.values() if not t.failure]
    nearest = None if best or not known else max(known, key=lambda t: t.worst(problem.constraints))
    found = Optimum(
        problem,
        best,
        start,
        seed,
        nearest,
        task=task.text if task is not None and by_task else "",
        given=rest,
        second=second,
    )
    if best is not None:
        found = replace(found, checks=_checked(problem, best))
        if second is not None:
            others_kept = tuple(c for c in problem.constraints if c.quantity != second.quantity)
            found = replace(found, front=front_of(problem, second, others_kept, count, seed))
    return found if out is None else _write(found, out)


def _second(front: str | OptimisationGoal | None, usual: OptimisationGoal | None) -> OptimisationGoal | None:
    """The second goal; without max: or min: it takes the direction of the task, else the largest."""
    if front is None or isinstance(front, OptimisationGoal):
        return front
    read = read_goal(front)
    return usual if usual is not None and ":" not in front and usual.quantity == read.quantity else read


def _spelled(base: Design) -> Callable[[str], str]:
    """A function that replaces the workspace verb's name of the grid columns, as xy_nodes, by "columns"."""
    recipe = base.entry.workspace
    if recipe is None or "columns" not in workspace_names(base):
        return lambda name: name
    other = f"{''.join(list(recipe.grid)[:2])}_nodes"
    return lambda name: "columns" if name == other else name


def _start(problem: OptimisationProblem) -> TriedDesign:
    """The quantities of the given design, which may lie outside the ranges."""
    x = tuple(float(getattr(problem.base.parameters, v.name)) for v in problem.variables)
    try:
        return TriedDesign(x, problem.measured.numbers(problem.base))
    except MechlabError as cause:
        return TriedDesign(x, {}, str(cause))


def _checked(problem: OptimisationProblem, best: TriedDesign) -> dict[str, dict[str, float]]:
    """The best design computed again, without cached values, and in other ways: quantity -> way -> value."""
    made = problem.design(best.x)
    again = problem.measured.numbers(made)
    other = problem.measured.checked(made)
    return {n: {"again": again[n]} | other.get(n, {}) for n in problem.measured.units}


def _write(found: Optimum, folder: Path) -> Optimum:
    """Write optimum.json and, with a front, its table and pictures; the result with the paths of the files."""
    names = {"optimum": "optimum.json"}
    if found.front:
        names |= {"front": "front.csv", "picture": "front.png", "drawing": "front.svg"}
    with whole_folder(folder) as stage:
        if found.front:
            write(stage / names["front"], csv_text(rows(found), "\r\n"))
            draw(found, stage / names["picture"])
            draw(found, stage / names["drawing"])
        write(stage / names["optimum"], json.dumps(found.to_dict(), indent=2, default=_plain) + "\n")
    return replace(found, files={kind: folder / name for kind, name in names.items()})


def _plain(item: Any) -> Any:
    return item.tolist() if hasattr(item, "tolist") else str(item)
