"""Progress of long work: a bar with the time left on a terminal's stderr, nothing elsewhere."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

PATIENCE = 1.0
"""A bar appears after this many seconds; what is faster needs none."""


@contextlib.contextmanager
def bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A function of (done, total) to call while working."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda done, total: None
        return
    import time

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    began = time.monotonic()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:.0f} %"),
        TimeRemainingColumn(),
    )
    shown = Progress(*columns, console=Console(stderr=True), transient=True)
    task = shown.add_task(what, total=None)

    def report(done: int, total: int) -> None:
        if not shown.live.is_started and time.monotonic() - began > PATIENCE:
            shown.start()
        shown.update(task, completed=done, total=total)

    try:
        yield report
    finally:
        shown.stop()
