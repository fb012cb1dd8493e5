"""The workspace of any mechanism: a question is asked at every node, and its answer is held to limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechlab.analytic.regions import Clause, Region, all_of
from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.question import Answer, Question, Witness
from mechlab.experiment.workspace import Coordinates
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.study.design import Design

BLOCK = 4096
"""Nodes that a closed form is asked at once."""
PARTS = 4
"""Where one of them has no answer they are asked again in so many parts, down to single nodes."""
SLAB = 200_000
WITNESSES = ("analytic", "pinocchio", "mujoco")
SOLVED = "solved"


@dataclass
class AskedPoses:
    """Asks one witness. limits: answer -> (low, high), either may be None. `statuses` counts what was said of the nodes."""

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
        """SOLVED, or an answer (NaN where there is none); the last nodes asked are remembered."""
        arrays = tuple(points.values())
        if self._last is None or any(a is not b for a, b in zip(arrays, self._last[0], strict=True)):
            self._last = (arrays, self._ask_all(points))
        return self._last[1][name]

    def _ask_all(self, points: Coordinates) -> dict[str, Array]:
        shape = np.broadcast_shapes(*(np.shape(v) for v in points.values()))
        flat = {k: np.broadcast_to(v, shape).ravel() for k, v in points.items()}
        count = int(np.prod(shape))
        out = {SOLVED: np.full(count, -np.inf)} | {n: np.full(count, np.nan) for n in self.limits}
        size = BLOCK if self.witness == "analytic" else 1
        for i in range(0, count, size):
            self._ask(flat, i, min(i + size, count), out)
        return {k: v.reshape(shape) for k, v in out.items()}

    def _ask(self, flat: Mapping[str, Array], i: int, j: int, out: dict[str, Array]) -> None:
        """Nodes i to j - 1. A closed form answers many at once when all have an answer; else in parts."""
        nodes = {k: float(v[i]) if j - i == 1 else v[i:j] for k, v in flat.items()}
        said = self._answer(nodes)
        if said.cannot:
            raise EngineMissing(f"{self.design.name}: {self.witness} cannot answer: {said.cannot}")
        good = said.status.exit_code == 0 and bool(said.values)
        if not good and j - i > 1:
            part = -(-(j - i) // PARTS)
            for k in range(i, j, part):
                self._ask(flat, k, min(k + part, j), out)
            return
        self.statuses[said.status] = self.statuses.get(said.status, 0) + j - i
        if not good:
            return
        out[SOLVED][i:j] = np.inf
        for name in self.limits:
            if name not in said.values:
                raise MechlabError(
                    f"{self.design.name}: {self.witness} does not answer {name}, on which there is a limit; "
                    f"it answers {', '.join(said.values)}."
                )
            out[name][i:j] = said.values[name]

    def _answer(self, nodes: Mapping[str, Any]) -> Answer:
        optional = {k: v for k, v in self.question.optional.items() if v is not None}
        ask: Witness = self.question.witnesses[self.witness]
        return ask(self.design.parameters, optional | dict(self.given) | dict(nodes))
