"""Sources of the numbers of a design: its parameters, a question, its workspace, a cycle, a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mechlab.errors import MechlabError, NoSolution, Untrustworthy, unknown
from mechlab.experiment.question import Answer, Question
from mechlab.lab.ask import ask, generic_question
from mechlab.lab.design import Design
from mechlab.lab.run import run_scene
from mechlab.mechanism.geometry import Array
from mechlab.studies.cycle.cycle import CycleResult, run_cycle
from mechlab.studies.named import witness_answer
from mechlab.studies.optimize.reach import RAYS, least_within, plane_of, reach
from mechlab.studies.workspace.study import workspace

REDUCE = ("least", "largest", "peak", "mean", "span", "final")
DEXTERITY = "inverse_condition"
COUNTED = ("voxels", "volume", "columns", "margin")
STATISTICS = ("smallest", "median", "largest")
POLE = 1e3
"""A column of a cycle has a pole where a value between positions exceeds every value at a position by this factor."""


class QuantitySource(Protocol):
    """Computes quantities of a design by name; raises MechlabError where the design has no value."""

    def numbers(self, design: Design) -> dict[str, float]:
        """Quantity -> value in SI."""

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Quantity -> other way of computing it -> value in SI."""


@dataclass(frozen=True)
class ParameterSource:
    """Parameters of the design."""

    names: tuple[str, ...]

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values."""
        return {n: float(getattr(design.parameters, n)) for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Nothing to check."""
        return {}


@dataclass(frozen=True)
class AnswerSource:
    """Answers of a question (None: the generic one) by its first witness; the other witnesses check it."""

    names: tuple[str, ...]
    question: str | None
    given: Mapping[str, Any]

    def numbers(self, design: Design) -> dict[str, float]:
        """The answers. Raises NoSolution with the status where there is no solution."""
        answer = witness_answer(self._question(design), design, self.given)
        if answer.cannot:
            raise MechlabError(f"{design.name}: {answer.cannot}")
        if answer.status.exit_code:
            notes = f" ({'; '.join(answer.notes)})" if answer.notes else ""
            raise NoSolution(f"{design.name}: {answer.status.value}{notes}")
        return {n: _single(design, n, answer) for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Answer -> witness -> value."""
        found = ask(design, self.given)
        answers = {w: a for w, a in found.answers.items() if not a.cannot and not a.status.exit_code}
        return {
            n: {w: float(a.values[n]) for w, a in answers.items() if np.size(a.values.get(n, ())) == 1}
            for n in self.names
        }

    def _question(self, design: Design) -> Question:
        if self.question is None:
            return generic_question(design, self.given)
        return next(q for q in design.entry.questions if q.name == self.question)


def _single(design: Design, name: str, answer: Answer) -> float:
    if name not in answer.values:
        raise unknown(f"{design.name}: answer", name, answer.values)
    value = np.asarray(answer.values[name], dtype=float)
    if value.size != 1 or not np.all(np.isfinite(value)):
        raise MechlabError(f"{design.name}: {name} is not one finite number: {value!r}.")
    return float(value.ravel()[0])


@dataclass(frozen=True)
class WorkspaceSource:
    """Workspace quantities on a grid (`COUNTED`, MAP_smallest ..), and reach and dexterity without a grid.

    asked: axes, fixed coordinates, limits, as `mechlab.studies.workspace.workspace` takes them."""

    names: tuple[str, ...]
    asked: Mapping[str, Any]
    rays: int = RAYS

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values; quantities of the grid are 0 where no node is inside."""
        out: dict[str, float] = {}
        if {"reach", "dexterity"} & {*self.names}:
            out |= self._without_grid(design)
        if set(self.names) - {"reach", "dexterity"}:
            out |= self._on_grid(design)
        return {n: out[n] for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Reach and dexterity with five times as many rays."""
        names = tuple(n for n in self.names if n in ("reach", "dexterity"))
        finer = replace(self, names=names, rays=5 * self.rays + 1).numbers(design) if names else {}
        return {n: {"finer": v} for n, v in finer.items()}

    def _without_grid(self, design: Design) -> dict[str, float]:
        recipe = design.entry.workspace
        if recipe is None:
            raise MechlabError(f"{design.name}: it brings no workspace of its own, so that it has no reach.")
        limits = {k: float(v) for k, v in self.asked.items() if k in recipe.limits}
        plane = plane_of(recipe.make(design.parameters, limits), recipe, design.name)
        out = {"reach": reach(plane, self.rays)}
        if "dexterity" in self.names:
            out["dexterity"] = least_within(recipe.maps(design.parameters)[DEXTERITY], out["reach"], self.rays)
        return out

    def _on_grid(self, design: Design) -> dict[str, float]:
        found = workspace(design, dict(self.asked))
        s = found.survey
        out = {"voxels": float(s.voxels), "volume": s.volume, "margin": float(s.margin)}
        out["columns"] = float(s.columns or 0)
        for name in self.names:
            stem, _, what = name.rpartition("_")
            if what in STATISTICS:
                out[name] = float(getattr(found.maps[stem], what)) if stem in found.maps else 0.0
        return out


@dataclass(frozen=True)
class CycleSource:
    """Quantities cycle.REDUCE.COLUMN of a cycle; least, largest, peak and span cover the path between positions too."""

    names: tuple[str, ...]
    motion: Mapping[str, float]
    points: int = 72

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values."""
        found = run_cycle(design.mechanism(None), design.name, self.motion, points=self.points)
        return {n: _of_cycle(found, n.split(".")[1], n.split(".", 2)[2]) for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """The values with three times as many positions."""
        finer = replace(self, points=3 * self.points)
        return {n: {"finer": v} for n, v in finer.numbers(design).items()}


def _of_cycle(found: CycleResult, how: str, column: str) -> float:
    """One number of a column, with extrema of the curve between positions. Raises NoSolution where the curve has a
    pole."""
    values = found[column]
    if how in ("mean", "final"):
        return reduced(how, values, found[found.drive])
    low, high = found.extremum(column, -1), found.extremum(column, 1)
    if low is None or high is None:
        raise MechlabError(f"{found.name}: {column}: no finite value in the column.")
    for end in (low, high):
        if abs(end.value) > POLE * float(np.nanmax(np.abs(values))):
            raise NoSolution(
                f"{found.name}: {column} has no least and largest value: it grows without bound at {found.drive} = {end.at:.6g}."
            )
    return {
        "least": low.value, "largest": high.value, "peak": max(abs(low.value), abs(high.value)),
        "span": high.value - low.value,
    }[how]  # fmt: skip


@dataclass(frozen=True)
class RunSource:
    """Quantities of a run of the default scene: run.REDUCE.CHANNEL, and run.health.FINDING."""

    names: tuple[str, ...]
    extra: Mapping[str, float]

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values. Raises Untrustworthy for a run with a finding of severity "error"."""

        r = run_scene(design, None, extra=dict(self.extra), estimate=False)
        if not r.health.trusted:
            bad = "; ".join(f.sentence for f in r.health.findings if f.severity == "error")
            raise Untrustworthy(f"{design.name}: {bad}")
        out = {}
        for n in self.names:
            _, how, what = n.split(".", 2)
            if how == "health":
                findings = {f.name: f for f in r.health.findings}
                if what not in findings:
                    raise unknown(f"{design.name}: finding", what, findings)
                out[n] = float(findings[what].value)
            else:
                out[n] = reduced(how, r.channel(what), r.t)
        return out

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Nothing: the health of the run is its check."""
        return {}


def reduced(how: str, values: Array, at: Array) -> float:
    """One number of samples (n,) at times or positions (n,): least, largest, peak (largest size), mean (trapezoidal rule), span
    (largest less least), final."""
    x = np.asarray(values, dtype=float)
    fine = np.isfinite(x)
    if not fine.any():
        raise MechlabError("no finite value in the column.")
    x, t = x[fine], np.asarray(at, dtype=float)[fine]
    if how == "mean":
        return float(np.trapezoid(x, t) / np.ptp(t)) if np.ptp(t) > 0.0 else float(x.mean())
    return float(
        {"least": x.min(), "largest": x.max(), "peak": np.abs(x).max(), "span": np.ptp(x), "final": x[-1]}[how]
    )
