"""Counted work: what a computation costs by the evaluations that it makes, the same on every machine and under every load.

The unit is the second of work: about a second of CPU of the machine on which the prices were measured. Budgets and choices are
in this unit, so that what is run, refined or given up never hangs on how fast or busy the machine is; measured CPU time is
for information alone.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager

ADAPTIVE_STAGE = 1.5e-5
"""Price of an evaluation in scipy's DOP853 or Radau without the right-hand side itself: its share of a step in Python [s]."""
FIXED_STAGE = 5e-6
"""The same of a fixed-step Runge-Kutta method in numpy."""
LSODA_CALL = 3e-6
"""The same of LSODA, whose steps are compiled: the call of the right-hand side."""


class OutOfWork(Exception):
    """A block has used up its work. No MechlabError: a run that catches those, as what ends it, must not catch this."""


class _Account(threading.local):
    """Work done in this thread so far, and where it must stop."""

    spent = 0.0
    limit = math.inf


_mine = _Account()


def count_work(seconds: float) -> None:
    """Add work [s]; raises OutOfWork when that passes the limit of a `work_limit` block."""
    mine = _mine
    mine.spent += seconds
    if mine.spent > mine.limit:
        raise OutOfWork("the work of this block is used up")


def work_done() -> float:
    """Work that this thread has counted since it began [s]; differences are what counts."""
    return _mine.spent


@contextmanager
def work_limit(seconds: float) -> Iterator[None]:
    """Raises OutOfWork in the block once it has counted `seconds` of work, or what an outer block has left."""
    before = _mine.limit
    _mine.limit = min(before, _mine.spent + seconds)
    try:
        yield
    finally:
        _mine.limit = before
