"""A limit on the CPU time of a block, so that one hopeless run cannot hold up a whole study."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class OutOfTime(Exception):
    """The block used up its CPU time. No MechlabError: a run that catches those, as what ends it, must not catch this."""


@contextmanager
def cpu_limit(seconds: float) -> Iterator[None]:
    """Raises OutOfTime in the block once it has used `seconds` of CPU time. In other threads than the main one, and where
    the system has no such timer (Windows), there is no limit.

    While the timer runs, Linux counts `time.process_time()` in ticks of some milliseconds; clock what is inside the block
    with `time.thread_time()`."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        raise OutOfTime(f"stopped after {seconds:.3g} s of CPU")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
