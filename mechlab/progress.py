"""How long work says how far it is: a function that is called with (done, total)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")


def silent(*_: object) -> None:
    """The progress that nobody looks at."""


def part(progress: Callable[[int, int], None], begin: int, end: int) -> Callable[[int, int], None]:
    """The progress of a part of the work, which is told as the way from `begin` to `end` percent of the whole."""
    return lambda done, total: progress(round(10.0 * (begin + (end - begin) * done / max(total, 1))), 1000)


def counted(items: Sequence[T], progress: Callable[[int, int], None]) -> Iterator[T]:
    """The items one after the other; before each, and behind the last, `progress` hears how many are done, and of how many."""
    for k, item in enumerate(items):
        progress(k, len(items))
        yield item
    progress(len(items), len(items))
