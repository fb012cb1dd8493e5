"""The figure that goes with the claims of an entry."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.experiment.entry import Entry
from mechlab.files import unfinished

SUFFIXES = (".png", ".svg", ".pdf")


def write_figure(entries: Sequence[Entry], path: str | Path) -> Path:
    """Draw the figure of the one entry that has one to `path` (.png, .svg or .pdf).

    Raises MechlabError for another suffix, and when not exactly one of the entries has a figure.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise MechlabError(f"figure {target}: expected a name that ends in {', '.join(SUFFIXES)}.")
    able = [e for e in entries if e.figure is not None]
    if len(able) != 1 or able[0].figure is None:
        names = ", ".join(e.name for e in able) or "none"
        raise MechlabError(
            f"a figure is drawn for one mechanism; of {', '.join(e.name for e in entries)} these have one: {names}. "
            "Name that one."
        )
    with unfinished(target) as temporary:
        able[0].figure(temporary)
    return target
