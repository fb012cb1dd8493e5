"""Makes a region on a grid from key=value: by the mechanism's own recipe, or by a question asked at every node."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import partial
from typing import Any

import numpy as np

from mechlab.analytic.regions import Clause, Region, all_of
from mechlab.errors import EngineMissing, MechlabError, unknown
from mechlab.experiment.entry import Coordinates, WorkspaceMap, WorkspaceRecipe
from mechlab.experiment.question import Answer, Question
from mechlab.lab.ask import asked_mechanism, generic_question, in_si, numeric
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.studies.named.answers import (
    answer_in_parts,
    chosen_witness,
    in_bulk,
    nodes_at,
    witness_answer,
    witness_answers,
)
from mechlab.studies.named.number import keys_to_give
from mechlab.studies.workspace.grid import SLAB as GRID_SLAB
from mechlab.studies.workspace.grid import WorkspaceGrid, grid_of
from mechlab.values import Range

BLOCK = 4096
"""Number of nodes that a closed form or an engine takes in one call."""
SLAB = 200_000
"""Number of nodes of a slab where a question is asked."""
SOLVED = "solved"


@dataclass
class QuestionOnGrid:
    """A question that one witness answers at the nodes. limits: answer -> (low, high), either may be None; `statuses`:
    status of an answer -> number of nodes."""

    design: Design
    question: Question
    given: Mapping[str, float]
    limits: Mapping[str, tuple[float | None, float | None]]
    witness: str
    statuses: dict[Status, int] = field(default_factory=dict)
    _last: tuple[tuple[Array, ...], dict[str, Array]] | None = None

    def region(self, axes: tuple[str, ...]) -> Region:
        """Clauses: the question is solved (margin +-infinity), and each limit (in the unit of the answer)."""
        clauses = [Clause(SOLVED, lambda p: self._value(p, SOLVED), axes, text=f"{self.question.name} has an answer")]
        for name, (low, high) in self.limits.items():
            if low is not None:
                clauses.append(Clause(f"{name}_min", self._side(name, low, 1.0), axes, text=f"{name} >= {low:.6g}"))
            if high is not None:
                clauses.append(Clause(f"{name}_max", self._side(name, high, -1.0), axes, text=f"{name} <= {high:.6g}"))
        return all_of(clauses)

    def _side(self, name: str, bound: float, sign: float) -> Any:
        def margin(points: Coordinates) -> Array:
            value = self._value(points, name)
            return np.where(np.isnan(value), np.inf, sign * (value - bound))

        return margin

    def _value(self, points: Coordinates, name: str) -> Array:
        """Values at the nodes: of an answer (NaN where there is none), or the margin SOLVED. The last nodes are
        cached."""
        arrays = tuple(points.values())
        if self._last is None or any(a is not b for a, b in zip(arrays, self._last[0], strict=True)):
            self._last = (arrays, self._ask_all(points))
        return self._last[1][name]

    def _ask_all(self, points: Coordinates) -> dict[str, Array]:
        shape = np.broadcast_shapes(*(np.shape(v) for v in points.values()))
        flat = {k: np.broadcast_to(v, shape).ravel() for k, v in points.items()}
        count = int(np.prod(shape))
        out = {SOLVED: np.full(count, -np.inf)} | {n: np.full(count, np.nan) for n in self.limits}
        if in_bulk(self.question, self.witness):
            for i in range(0, count, BLOCK):
                at = np.arange(i, min(i + BLOCK, count))
                nodes = dict(self.given) | {k: v[at] for k, v in flat.items()}
                for k, answer in zip(at, witness_answers(self.question, self.design, nodes, self.witness, len(at)), strict=True):
                    (self._refuse if answer.status.exit_code or answer.cannot else partial(self._take, out=out))(np.array([k]), answer)
            return {k: v.reshape(shape) for k, v in out.items()}
        size = BLOCK if self.witness == "analytic" else 1
        for i in range(0, count, size):
            answer_in_parts(
                np.arange(i, min(i + size, count)),
                lambda at: self._answer(nodes_at(flat, at)),
                lambda answer: bool(answer.values),
                lambda at, answer: self._take(at, answer, out),
                self._refuse,
                self._fail,
            )
        return {k: v.reshape(shape) for k, v in out.items()}

    def _take(self, at: Array, answer: Answer, out: Mapping[str, Array]) -> None:
        self._count(at, answer)
        if not answer.values:
            return
        out[SOLVED][at] = np.inf
        for name in self.limits:
            if name not in answer.values:
                raise MechlabError(
                    f"{self.design.name}: {self.witness} does not answer {name}, on which there is a limit; "
                    f"it answers {', '.join(answer.values)}."
                )
            out[name][at] = answer.values[name]

    def _refuse(self, at: Array, answer: Answer) -> None:
        if answer.cannot:
            raise EngineMissing(f"{self.design.name}: {self.witness} cannot answer: {answer.cannot}")
        self._count(at, answer)

    def _fail(self, at: Array, cause: Exception) -> None:
        raise cause

    def _count(self, at: Array, answer: Answer) -> None:
        self.statuses[answer.status] = self.statuses.get(answer.status, 0) + len(at)

    def _answer(self, nodes: Mapping[str, Any]) -> Answer:
        return witness_answer(self.question, self.design, dict(self.given) | dict(nodes), self.witness)


@dataclass(frozen=True)
class WorkspacePlan:
    """The region, grid and maps of a workspace. text: meaning of a node; how: the witness or "closed form";
    margin_unit: "m" where all margins are lengths, else ""."""

    design: Design
    region: Region
    grid: WorkspaceGrid
    units: Mapping[str, str]
    text: str
    how: str
    slab: int = GRID_SLAB
    margin_unit: str = ""
    maps: Mapping[str, WorkspaceMap] = field(default_factory=dict)
    poses: QuestionOnGrid | None = None


def plan(design: Design, asked: Mapping[str, Any], witness: str | None = None) -> WorkspacePlan:
    """The plan for keys that are no parameters. Raises MechlabError, listing what can be given, where they fit
    nothing."""
    asked = in_si(design, asked)
    recipe = design.entry.workspace
    if recipe is not None and witness is None and set(asked) <= {*recipe.grid, *recipe.limits}:
        return _of_recipe(design, recipe, asked)
    ranges = [k for k, v in asked.items() if isinstance(v, Range)]
    if not ranges:
        raise MechlabError(f"{design.name}: no axis is given. {_what_to_give(design)}")
    question = _question(design, asked)
    return _of_question(design, question, asked, witness)


def _of_recipe(design: Design, recipe: WorkspaceRecipe, asked: Mapping[str, Any]) -> WorkspacePlan:
    limits: dict[str, float] = {}
    ranges: dict[str, Range] = {}
    fixed: dict[str, float] = {}
    for name, limit in recipe.limits.items():
        if name in asked:
            limits[name] = _scalar(design, name, asked[name], limit.unit)
    for name, usual in recipe.grid.items():
        value = asked.get(name, usual)
        if isinstance(value, Range):
            ranges[name] = value
        else:
            fixed[name] = _scalar(design, name, value, recipe.units[name])
    return WorkspacePlan(
        design, recipe.make(design.parameters, limits), grid_of(ranges, fixed), recipe.units, recipe.text, "closed form",
        margin_unit="m", maps=recipe.maps(design.parameters),
    )  # fmt: skip


def _scalar(design: Design, name: str, value: Any, unit: str) -> float:
    number = numeric(name, value)
    if not isinstance(number, float) or getattr(value, "unit", unit) != unit:
        raise MechlabError(f"{design.name}: {name}: expected a number{f' [{unit}]' if unit else ''}, got {value!r}.")
    return number


def _question(design: Design, asked: Mapping[str, Any]) -> Question:
    """The question whose keys are all given; every other given key must be a limit on one of its answers."""
    fits = []
    for q in design.entry.questions:
        known = {*q.given, *q.optional}
        axes = [k for k in asked if k in known and isinstance(asked[k], Range)]
        if set(q.given) <= set(asked) and set(asked) - known <= set(q.answers) and axes:
            fits.append(q)
    if fits:
        return max(fits, key=lambda q: len(q.given))
    touched = [q for q in design.entry.questions if {*q.given} & {*asked}]
    for q in touched:
        missing = [k for k in q.given if k not in asked]
        if missing and set(asked) <= {*q.given, *q.optional, *q.answers}:
            raise MechlabError(
                f"{design.name}: the question {q.name!r} also needs {', '.join(missing)}: give a number, or a range for an "
                f"axis. {_what_to_give(design)}"
            )
    counted = [k for k, v in asked.items() if isinstance(v, Range) and v.count is not None]
    inputs = [k for k, v in asked.items() if not isinstance(v, Range) or not counted or k in counted]
    try:
        return generic_question(design, dict.fromkeys(inputs, 0.0))
    except MechlabError as error:
        exists = keys_to_give(design) | {k for q in design.entry.questions for k in q.answers}
        strange = [k for k in asked if k not in exists]
        raise (unknown(f"{design.name}: quantity", strange[0], exists) if strange else error) from None


def _of_question(design: Design, question: Question, asked: Mapping[str, Any], witness: str | None) -> WorkspacePlan:
    name = chosen_witness(question, witness, design.name)
    inputs = {*question.given, *question.optional}
    axes = {k: v for k, v in asked.items() if k in inputs and isinstance(v, Range)}
    given = {k: _scalar(design, k, v, _unit(question, k)) for k, v in asked.items() if k in inputs and k not in axes}
    limits = _joint_ranges(design, question)
    for k, v in asked.items():
        if k not in inputs:
            if not isinstance(v, Range) or v.count is not None:
                raise MechlabError(f"{design.name}: {k} is an answer; limit it with a range, {k}=low:high, got {v!r}.")
            limits[k] = (float(v.low), float(v.high))
    grid = grid_of(axes)
    poses = QuestionOnGrid(design, question, given, limits, name)
    fixed = ", ".join(f"{k} = {v:.6g}" for k, v in given.items())
    text = f"{', '.join(axes)} of the question {question.name!r}" + (f", at {fixed}" if fixed else "")
    units = {k: _unit(question, k) for k in axes}
    return WorkspacePlan(design, poses.region(grid.names), grid, units, text, name, SLAB, poses=poses)


def _joint_ranges(design: Design, question: Question) -> dict[str, tuple[float | None, float | None]]:
    """Joint -> range, for joints that are answers of the question."""
    joints = asked_mechanism(design).joints
    return {j.name: j.range for j in joints if j.range is not None and j.name in question.answers}


def _unit(question: Question, name: str) -> str:
    """The unit of a quantity as the question states it; else rad for angles and m for others, per s or s2 by the
    suffix."""
    if name in question.units:
        return question.units[name]
    rates = {"_rate": "/s", "_accel": "/s2"}
    suffix = next((s for s in rates if name.endswith(s)), "")
    base = question.units.get(name.removesuffix(suffix), "rad" if name.removesuffix(suffix) in question.angles else "m")
    return base + rates.get(suffix, "")


def _what_to_give(design: Design) -> str:
    recipe = design.entry.workspace
    parts = [f"{' '.join(f'{a}=low:high:n' for a in recipe.grid)} [{' '.join(recipe.limits)}]"] if recipe else []
    parts += [" ".join(q.given) for q in design.entry.questions]
    return f"Give ranges key=low:high:n for one to three of: {'; '.join(parts) or 'joints and points'}."
