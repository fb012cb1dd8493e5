"""The list of the catalog as a result, and the entries of a family or with given words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, get_args

from mechlab.catalog.table import Motion, Row
from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
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


def moving(rows: Sequence[Row], freedoms: int | None, motion: Motion | None) -> list[Row]:
    """The entries with so many freedoms and that kind of motion, all for None. Raises MechlabError that lists what exists."""
    counts = sorted({r.freedoms for r in rows})
    if freedoms is not None and freedoms not in counts:
        raise MechlabError(f"no mechanism here has {freedoms} freedoms; there are some with {', '.join(map(str, counts))}.")
    if motion is not None and motion not in get_args(Motion):
        raise unknown("motion", motion, get_args(Motion))
    return [r for r in rows if freedoms in (None, r.freedoms) and motion in (None, r.motion)]


def found_in(rows: Sequence[Row], words: str | None) -> list[Row]:
    """The entries that have every word in name, title, family, motion or summary, whatever its case."""
    wanted = (words or "").lower().split()
    return [r for r in rows if all(w in f"{r.name} {r.title} {r.family} {r.motion} {r.summary}".lower() for w in wanted)]
