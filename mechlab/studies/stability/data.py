"""Data of a stability study: outcomes, axes, cells, theory, maps."""

from __future__ import annotations

import math
from dataclasses import field
from enum import Enum
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.results import Result


class RunOutcome(Enum):
    """The outcome of one run."""

    RIGHT = "stable and right"
    DRIFTING = "drifting"
    WRONG = "wrong"
    BLOWN_UP = "blown up"
    REFUSED = "refused"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class StabilityAxis:
    """The quantity that is varied: `values` (n,) in `unit`, `text` in words, `nominal`: value of the mechanism as
    given."""

    name: str
    unit: str
    values: tuple[float, ...]
    text: str = ""
    nominal: float | None = None

    @property
    def log(self) -> bool:
        """Whether the values span more than a decade, all of them positive."""
        return min(self.values) > 0 and max(self.values) > 10.0 * min(self.values)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        head = {"name": self.name, "unit": self.unit, "values": list(self.values)}
        return head | {"text": self.text, "nominal": self.nominal}


@dataclass(frozen=True)
class StabilityCell:
    """One run: its outcome, its value for the map (nan where there is none), and the reason of a failure."""

    outcome: RunOutcome
    value: float = math.nan
    reason: str = ""


@dataclass(frozen=True)
class Theory:
    """A theoretical boundary: the points (x, y), its name and formula; `methods`: the methods that it holds for."""

    name: str
    formula: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    methods: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        head = {"name": self.name, "formula": self.formula, "x": list(self.x), "y": list(self.y)}
        return head | {"methods": list(self.methods)}


@dataclass(frozen=True)
class MethodPanel:
    """One method over the grid: cells[y][x]."""

    method: str
    cells: tuple[tuple[StabilityCell, ...], ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; a number that is missing is null."""
        return {
            "method": self.method,
            "status": [[c.outcome.value for c in row] for row in self.cells],
            "value": [[c.value if math.isfinite(c.value) else None for c in row] for row in self.cells],
            "reasons": sorted({c.reason for row in self.cells for c in row if c.reason})[:5],
        }

    def limit(self, row: int, x: tuple[float, ...], fails: frozenset[RunOutcome]) -> tuple[float, float]:
        """Measured boundary in a row: the largest x below the first run with an outcome in `fails`, and the x of that
        run; 0 and infinity where there is none. Cells that were not run count for neither."""
        good, bad = 0.0, math.inf
        for value, cell in sorted(zip(x, self.cells[row], strict=True), key=lambda pair: pair[0]):
            if cell.outcome in fails:
                bad = value
                break
            if cell.outcome is not RunOutcome.NOT_RUN:
                good = value
        return good, bad


@dataclass(frozen=True)
class StabilityMap:
    """One map: x is the timestep [s], y the varied quantity. `value_name` names the measured value; up to `right` a run
    is right, above `wrong` it is wrong."""

    kind: str
    title: str
    x: StabilityAxis
    y: StabilityAxis
    panels: tuple[MethodPanel, ...]
    theory: tuple[Theory, ...]
    value_name: str
    right: float
    wrong: float
    fidelity: str
    duration: float
    sentences: tuple[str, ...] = ()
    skipped: dict[str, str] = field(default_factory=dict)

    def panel(self, method: str) -> MethodPanel:
        """The panel of a method."""
        return next(p for p in self.panels if p.method == method)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "kind": self.kind, "title": self.title, "x": self.x.to_dict(), "y": self.y.to_dict(),
            "methods": [p.to_dict() for p in self.panels], "theory": [t.to_dict() for t in self.theory],
            "value": {"name": self.value_name, "right": self.right, "wrong": self.wrong}, "fidelity": self.fidelity,
            "duration": self.duration, "sentence": " ".join(self.sentences), "sentences": list(self.sentences),
            "skipped": dict(self.skipped),
        }  # fmt: skip


@dataclass(frozen=True, repr=False)
class Stability(Result[dict[str, Path]]):
    """All maps of a mechanism; without: kind of map -> why it is missing."""

    name: str
    title: str
    scene: str
    maps: tuple[StabilityMap, ...]
    without: dict[str, str]
    versions: dict[str, str]
    cpu_s: float
    warnings: tuple[str, ...] = ()
    acts: str = ""

    @property
    def exit_code(self) -> int:
        """0, or 4 when there is no map to draw."""
        return 0 if self.maps else 4

    def map(self, kind: str) -> StabilityMap:
        """The map of a kind; raises MechlabError with the reason why it is missing, or with the kinds that exist."""
        for found in self.maps:
            if found.kind == kind:
                return found
        if kind in self.without:
            raise MechlabError(f"{self.name}: no map {kind!r}: {self.without[kind]}.")
        raise unknown(f"{self.name}: map", kind, [m.kind for m in self.maps])

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        message = " ".join(s for m in self.maps for s in m.sentences[:1])
        if not self.maps:
            message = f"{self.name}: no map: " + "; ".join(f"{k}: {why}" for k, why in self.without.items())
        return {
            "name": self.name, "scene": self.scene, "acts": self.acts,
            "maps": [m.to_dict() for m in self.maps], "without": dict(self.without),
            "cpu_s": self.cpu_s, "versions": self.versions, "warnings": list(self.warnings),
            "status": "answered" if self.maps else "nothing to map", "message": message,
        }  # fmt: skip
