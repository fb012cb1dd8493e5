"""CPU seconds spent on finding a motion: everything but what is marked as building of models."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Meter:
    """Counts CPU time of this thread from its making; `building` blocks and `leave_out` do not count."""

    def __init__(self) -> None:
        self._start, self._out = time.thread_time(), 0.0

    @property
    def spent(self) -> float:
        """CPU seconds so far."""
        return time.thread_time() - self._start - self._out

    @contextmanager
    def building(self) -> Iterator[None]:
        """What runs in this block builds models and does not count."""
        began = time.thread_time()
        try:
            yield
        finally:
            self._out += time.thread_time() - began

    @contextmanager
    def stepping(self) -> Iterator[list[float]]:
        """In this block only the seconds that are put into the list count: those of stepping as the runs tell them."""
        began, told = time.thread_time(), list[float]()
        try:
            yield told
        finally:
            self._out += time.thread_time() - began - sum(told)
