"""The comparisons by name, and which entries each of them looks at."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from mechlab.errors import unknown
from mechlab.experiment.entry import Entry
from mechlab.progress import counted, silent
from mechlab.studies.compare import quick_return, straight_line, walking
from mechlab.studies.compare.result import Comparison

KINDS: Mapping[str, tuple[str, Callable[[Iterable[Entry]], Comparison]]] = {
    "straight-line": (straight_line.FAMILY, straight_line.straight_lines),
    "quick-return": (quick_return.FAMILY, quick_return.quick_returns),
    "walking": (walking.FAMILY, walking.legs),
}
"""Kind -> the family of entries that it compares, and the function that does."""


def family_of(kind: str) -> str:
    """The family that a kind compares. Raises MechlabError for an unknown kind, listing those that exist."""
    if kind not in KINDS:
        raise unknown("the comparison", kind, KINDS)
    return KINDS[kind][0]


def compare(kind: str, entries: Iterable[Entry], progress: Callable[[int, int], None] = silent) -> Comparison:
    """Compare those of the entries that are of the family of the kind; progress: called with (done, total). Raises
    MechlabError as `family_of`."""
    family = family_of(kind)
    return KINDS[kind][1](counted([e for e in entries if e.family == family], progress))
