"""How long work says how far it is: a function that is called with (done, total)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")


def silent(*_: object) -> None:
    """The progress that nobody looks at."""


def counted(items: Sequence[T], progress: Callable[[int, int], None]) -> Iterator[T]:
    """The items one after the other; before each, and behind the last, `progress` hears how many are done, and of how many."""
    for k, item in enumerate(items):
        progress(k, len(items))
        yield item
    progress(len(items), len(items))
