"""The result of a comparison: a table with a row for each mechanism, and curves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.results import Result


@dataclass(frozen=True)
class Column:
    """A number of every mechanism: its key, heading, unit, one sentence on it, and whether more (1) or less (-1) of it is better."""

    key: str
    heading: str
    unit: str
    text: str
    better: int = 0


@dataclass(frozen=True)
class Row:
    """One design: the name of the mechanism, what it is called here, the parameters that differ from the defaults, its numbers (None
    where it has none) and the witnesses' largest difference on the way there."""

    name: str
    title: str
    values: Mapping[str, float | None]
    changed: Mapping[str, float] = field(default_factory=dict)
    difference: float = 0.0


@dataclass(frozen=True, eq=False)
class Panel:
    """A chart: curves title -> (x, y), its words, and which axes are logarithmic ("", "x", "y", "xy"). equal: one scale for both."""

    title: str
    x: str
    y: str
    curves: Mapping[str, tuple[Array, Array]]
    log: str = ""
    equal: bool = False


@dataclass(frozen=True, repr=False)
class Comparison(Result[Path]):
    """A question, what is compared and how, the table and the charts. `skipped`: mechanisms of the family without such numbers."""

    kind: str
    question: str
    about: tuple[str, ...]
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    panels: tuple[Panel, ...]
    skipped: tuple[str, ...] = ()
    exit_code: int = 0

    def __getitem__(self, title: str) -> Mapping[str, float | None]:
        """The numbers of a mechanism by its name (the first design of it) or title."""
        return next(r.values for r in self.rows if title in (r.name, r.title))

    def best(self, column: Column) -> float | None:
        """The best value of a column; None where neither more nor less is better."""
        found = [x for r in self.rows if (x := r.values[column.key]) is not None]
        return None if not column.better or not found else column.better * max(column.better * x for x in found)

    @property
    def message(self) -> str:
        """One sentence: the question, and how many designs are compared."""
        return f"{self.question} {len(self.rows)} designs compared"

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "kind": self.kind, "question": self.question, "about": list(self.about),
            "units": {c.key: c.unit for c in self.columns}, "meaning": {c.key: c.text for c in self.columns},
            "mechanisms": [
                {"name": r.name, "title": r.title, "changed": dict(r.changed), "max_difference": r.difference, **r.values}
                for r in self.rows
            ],
            "skipped": list(self.skipped), "message": self.message,
        }  # fmt: skip
