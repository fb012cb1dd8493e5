"""What finding a motion costs: counted work, by which decisions are made, and CPU seconds, which are told."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from mechlab.integrate import work_done


@dataclass
class Told:
    """What runs tell of themselves: CPU seconds of stepping, work."""

    cpu_s: float = 0.0
    work: float = 0.0


class Meter:
    """Counts work and CPU time of this thread from its making; `building` blocks do not count."""

    def __init__(self) -> None:
        self._start, self._out = time.thread_time(), 0.0
        self._first, self._free = work_done(), 0.0

    @property
    def cpu_s(self) -> float:
        """CPU seconds so far, for information."""
        return time.thread_time() - self._start - self._out

    @property
    def work(self) -> float:
        """Work so far [s]: what decisions hang on."""
        return work_done() - self._first - self._free

    @contextmanager
    def building(self) -> Iterator[None]:
        """What runs in this block builds models and does not count."""
        with self.stepping():
            yield

    @contextmanager
    def stepping(self) -> Iterator[Told]:
        """In this block only what is told counts: CPU time and work of the runs in it."""
        began, first, told = time.thread_time(), work_done(), Told()
        try:
            yield told
        finally:
            self._out += time.thread_time() - began - told.cpu_s
            self._free += work_done() - first - told.work
