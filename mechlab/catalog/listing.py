"""The list of the catalog as a result, and the entries of a family or with given words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mechlab.catalog.table import Row
from mechlab.errors import unknown
from mechlab.results import Shown


@dataclass(frozen=True, repr=False)
class TableResult(Shown):
    """A table, and `data`, which a program reads in its place."""

    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    data: Mapping[str, Any] = field(default_factory=dict)
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return dict(self.data)


def one_family(rows: Sequence[Row], family: str | None) -> list[Row]:
    """The entries of a family, all for None. Raises MechlabError that lists the families."""
    families = dict.fromkeys(r.family for r in rows)
    if family is not None and family not in families:
        raise unknown("family", family, families)
    return [r for r in rows if family in (None, r.family)]


def found_in(rows: Sequence[Row], words: str | None) -> list[Row]:
    """The entries that have every word in name, title, family or summary, whatever its case."""
    wanted = (words or "").lower().split()
    return [r for r in rows if all(w in f"{r.name} {r.title} {r.family} {r.summary}".lower() for w in wanted)]
