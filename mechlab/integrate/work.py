"""Counted work: the cost of a computation by the number of its evaluations, the same on every machine under every load.

The unit is the second of work: about one second of CPU time of the machine on which the prices were measured. Budgets
and choices use this unit, so that no decision depends on how fast or busy the machine is. Measured CPU time is for
information.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager

ADAPTIVE_STAGE = 1.5e-5
"""Price [s] of an evaluation in scipy's DOP853 or Radau: the Python part of a step, without the right-hand side."""
FIXED_STAGE = 5e-6
"""Price [s] of a stage of a fixed-step Runge-Kutta method in numpy, without the right-hand side."""
LSODA_CALL = 3e-6
"""Price [s] of a call by LSODA, whose steps are compiled, without the right-hand side."""


class OutOfWork(Exception):
    """A block has used up its work. It is no MechlabError, because a run may catch those as its end, but not this."""


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
    """Work that this thread has counted since it began [s]; only differences have a meaning."""
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
