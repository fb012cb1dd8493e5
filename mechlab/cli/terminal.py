"""What only a terminal shows: tables that fit its width, and the progress of long work. Elsewhere text stays as it is."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Callable, Iterator

PATIENCE = 1.0
"""A bar appears after this many seconds; what is faster needs none."""
RULE = re.compile(r"-+(  -+)*")


def fitted(text: str, width: int) -> str:
    """The same text with its tables (`mechlab.tables.table`) laid out anew where they are wider than the terminal."""
    lines = text.split("\n")
    out: list[str] = []
    k = 0
    while k < len(lines):
        if k + 1 < len(lines) and RULE.fullmatch(lines[k + 1]) and len(lines[k]) <= len(lines[k + 1]):
            end = _end_of_table(lines, k + 2)
            block = lines[k:end]
            out += block if max(map(len, block)) <= width else _laid_out(block, width)
            k = end
        else:
            out.append(lines[k])
            k += 1
    return "\n".join(out)


def _columns(rule: str) -> list[slice]:
    """The columns below a rule; the last one is open."""
    found = [slice(m.start(), m.end()) for m in re.finditer("-+", rule)]
    return [*found[:-1], slice(found[-1].start, None)]


def _end_of_table(lines: list[str], first: int) -> int:
    """The first line behind a table: one that is longer than the rule, or has a word where a gap must be."""
    rule = lines[first - 1]
    gaps = [m.start() for m in re.finditer("  ", rule)]
    k = first
    while (
        k < len(lines)
        and lines[k]
        and len(lines[k]) <= len(rule)
        and all(not lines[k][g : g + 2].strip() for g in gaps)
    ):
        k += 1
    return k


def _laid_out(block: list[str], width: int) -> list[str]:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    cells = [[line[column].strip() for column in _columns(block[1])] for line in (block[0], *block[2:])]
    made = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, header_style="", padding=(0, 1))
    for head in cells[0]:
        made.add_column(Text(head), overflow="fold")
    for row in cells[1:]:
        made.add_row(*(Text(c) for c in row))
    console = Console(width=width, color_system=None, highlight=False)
    with console.capture() as captured:
        console.print(made)
    return [line.rstrip() for line in captured.get().rstrip("\n").split("\n")]


def width_of_stdout() -> int | None:
    """Columns of the terminal behind stdout; None where there is no terminal."""
    if sys.stdout is None or not sys.stdout.isatty():
        return None
    from shutil import get_terminal_size

    return get_terminal_size().columns


def _tenths(what: str) -> Callable[[int, int], None]:
    """Writes a line to stderr for every tenth of the work."""
    told = 0

    def report(done: int, total: int) -> None:
        nonlocal told
        if total > 0 and 10 * done // total > told:
            told = 10 * done // total
            with contextlib.suppress(OSError):
                print(f"{what}: {10 * told} %", file=sys.stderr, flush=True)

    return report


@contextlib.contextmanager
def bar(what: str, lines: bool = False) -> Iterator[Callable[[int, int], None]]:
    """A function of (done, total) to call while working: a bar with the time left on a terminal's stderr, else nothing, or,
    with `lines`, a line for every tenth."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield _tenths(what) if lines and sys.stderr is not None else lambda done, total: None
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
