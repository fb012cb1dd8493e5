"""Sources of the numbers of a design: its parameters, a question, its workspace, a cycle, a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from mechlab.errors import MechlabError, NoSolution, Untrustworthy
from mechlab.experiment.question import Question
from mechlab.lab.ask import ask, generic_question
from mechlab.lab.design import Design
from mechlab.lab.run import run_scene
from mechlab.lazy_dataclass import dataclass
from mechlab.studies.cycle.cycle import run_cycle
from mechlab.studies.named.answers import single_number, witness_answer
from mechlab.studies.named.number import NamedNumber, reduced_finite
from mechlab.studies.named.runs import channel, distrust, finding, number_of_cycle
from mechlab.studies.workspace.reach import RAYS, least_within, plane_of, reach
from mechlab.studies.workspace.study import workspace

DEXTERITY = "inverse_condition"
COUNTED = ("voxels", "volume", "columns", "margin")
WITHOUT_GRID = {"reach", "dexterity"}
STATISTICS = ("smallest", "median", "largest")


class QuantitySource(Protocol):
    """Computes numbers of a design; raises MechlabError where the design has no value."""

    def numbers(self, design: Design) -> dict[str, float]:
        """Quantity -> value in SI."""

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Quantity -> other way of computing it -> value in SI."""


@dataclass(frozen=True)
class ParameterSource:
    """Parameters of the design."""

    names: tuple[NamedNumber, ...]

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values."""
        return {n.label: float(getattr(design.parameters, n.name)) for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Nothing to check."""
        return {}


@dataclass(frozen=True)
class AnswerSource:
    """Answers of a question (None: the generic one) by its first witness; the other witnesses check it."""

    names: tuple[NamedNumber, ...]
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
        return {n.label: single_number(design, n.name, answer) for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Answer -> witness -> value."""
        found = ask(design, self.given)
        answers = {w: a for w, a in found.answers.items() if not a.cannot and not a.status.exit_code}
        return {
            n.label: {w: float(a.values[n.name]) for w, a in answers.items() if np.size(a.values.get(n.name, ())) == 1}
            for n in self.names
        }

    def _question(self, design: Design) -> Question:
        if self.question is None:
            return generic_question(design, self.given)
        return next(q for q in design.entry.questions if q.name == self.question)


@dataclass(frozen=True)
class WorkspaceSource:
    """Workspace quantities on a grid (`COUNTED`, MAP_smallest ..), and reach and dexterity without a grid.

    asked: axes, fixed coordinates, limits, as `mechlab.studies.workspace.workspace` takes them."""

    names: tuple[NamedNumber, ...]
    asked: Mapping[str, Any]
    rays: int = RAYS

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values; quantities of the grid are 0 where no node is inside."""
        out: dict[str, float] = {}
        asked = {n.name for n in self.names}
        if WITHOUT_GRID & asked:
            out |= self._without_grid(design)
        if asked - WITHOUT_GRID:
            out |= self._on_grid(design)
        return {n.label: out[n.name] for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Reach and dexterity with five times as many rays."""
        names = tuple(n for n in self.names if n.name in WITHOUT_GRID)
        finer = replace(self, names=names, rays=5 * self.rays + 1).numbers(design) if names else {}
        return {n: {"finer": v} for n, v in finer.items()}

    def _without_grid(self, design: Design) -> dict[str, float]:
        recipe = design.entry.workspace
        if recipe is None:
            raise MechlabError(f"{design.name}: it brings no workspace of its own, so that it has no reach.")
        limits = {k: float(v) for k, v in self.asked.items() if k in recipe.limits}
        plane = plane_of(recipe.make(design.parameters, limits), recipe, design.name)
        out = {"reach": reach(plane, self.rays)}
        if any(n.name == "dexterity" for n in self.names):
            out["dexterity"] = least_within(recipe.maps(design.parameters)[DEXTERITY], out["reach"], self.rays)
        return out

    def _on_grid(self, design: Design) -> dict[str, float]:
        found = workspace(design, dict(self.asked))
        s = found.survey
        out = {"voxels": float(s.voxels), "volume": s.volume, "margin": float(s.margin)}
        out["columns"] = float(s.columns or 0)
        for number in self.names:
            stem, _, what = number.name.rpartition("_")
            if what in STATISTICS:
                out[number.name] = float(getattr(found.maps[stem], what)) if stem in found.maps else 0.0
        return out


@dataclass(frozen=True)
class CycleSource:
    """Quantities cycle.REDUCE.COLUMN of a cycle; least, largest, peak and span cover the path between positions too."""

    names: tuple[NamedNumber, ...]
    motion: Mapping[str, float]
    points: int = 72

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values."""
        found = run_cycle(design.mechanism(None), design.name, self.motion, points=self.points, only=[n.name for n in self.names])
        return {n.label: number_of_cycle(n, found) for n in self.names}

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """The values with three times as many positions."""
        finer = replace(self, points=3 * self.points)
        return {n: {"finer": v} for n, v in finer.numbers(design).items()}


@dataclass(frozen=True)
class RunSource:
    """Quantities of a run of the default scene: run.REDUCE.CHANNEL, and run.health.FINDING."""

    names: tuple[NamedNumber, ...]
    extra: Mapping[str, float]

    def numbers(self, design: Design) -> dict[str, float]:
        """Their values. Raises Untrustworthy for a run with a finding of severity "error"."""
        run = run_scene(design, None, extra=dict(self.extra), estimate=False)
        if not run.health.trusted:
            raise Untrustworthy(f"{design.name}: {'; '.join(distrust(run))}")
        out = {}
        for n in self.names:
            if n.kind == "finding":
                out[n.label] = finding(run, n.name)
            else:
                out[n.label] = reduced_finite(n.reduce, run.t, channel(design, run, n.name))
        return out

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Nothing: the health of the run is its check."""
        return {}
