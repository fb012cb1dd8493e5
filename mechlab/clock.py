"""The CPU seconds of a run, from the call to the returned recording, by what they were spent on.

    with spent_on("integrate"): ...       # its CPU time counts as integration, what surrounds it goes on afterwards
    @costed                               # the result's `cost` holds the parts of the whole call, and their sum

Each second belongs to one part, that of the innermost `spent_on` block, so that the parts add up to the total. The clock is the
CPU time of the process: what libraries compute in threads of their own counts too, and so does what other threads of the caller
do meanwhile.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import fields, replace
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from mechlab.algebra_threads import one_algebra_thread
from mechlab.lazy_dataclass import dataclass

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class CostParts:
    """CPU seconds of a run. imports: of packages and modules that it is the first to need; build: of mechanisms and engine models;
    integrate: the steps of the motion that is returned; probe: runs that only choose a method or estimate an error; check: findings,
    energy, gaps; record: channels and poses."""

    imports: float = 0.0
    build: float = 0.0
    integrate: float = 0.0
    probe: float = 0.0
    check: float = 0.0
    record: float = 0.0

    @property
    def total(self) -> float:
        """Sum of the parts [s]."""
        return sum(getattr(self, name) for name in PARTS)

    def __sub__(self, other: CostParts) -> CostParts:
        return CostParts(*(getattr(self, name) - getattr(other, name) for name in PARTS))


PARTS = tuple(x.name for x in fields(CostParts))


class _Clock(threading.local):
    """CPU seconds of this thread's calls so far, by part; the present part, and when it was last looked at. depth: of `costed`."""

    def __init__(self) -> None:
        self.spent = dict.fromkeys(PARTS, 0.0)
        self.part, self.since, self.depth = "build", time.process_time(), 0

    def turn(self, part: str) -> str:
        """From now on time counts as `part`; returns the part before."""
        now, before = time.process_time(), self.part
        self.spent[before] += now - self.since
        self.part, self.since = part, now
        return before

    def read(self) -> CostParts:
        """The parts so far."""
        self.turn(self.part)
        return CostParts(**self.spent)


_mine = _Clock()


@contextmanager
def spent_on(part: str) -> Iterator[None]:
    """A block whose CPU time counts as one of the fields of `CostParts`. In a probe everything but imports is a part of the probe."""
    clock = _mine
    before = clock.turn("probe" if clock.part == "probe" and part != "imports" else part)
    try:
        yield
    finally:
        clock.turn(before)


def move_cost(source: str, target: str, seconds: float) -> None:
    """Count `seconds` that were spent on the part `source` as `target`: what was timed inside of it, or the one of several trials
    that is the run itself. Nothing moves within a probe."""
    clock = _mine
    if clock.part == "probe":
        return
    clock.turn(clock.part)
    clock.spent[source] -= seconds
    clock.spent[target] += seconds


def costed(run: Callable[P, R]) -> Callable[P, R]:
    """`run`, whose result, a frozen dataclass with a field `cost`, states the CPU seconds of the whole call: `cost.total_s` and
    `cost.parts`. What no block claims counts as "build"."""

    @wraps(run)
    def whole(*args: P.args, **kwargs: P.kwargs) -> R:
        clock = _mine
        if not clock.depth:
            clock.part, clock.since = "build", time.process_time()
        clock.depth += 1
        try:
            first = clock.read()
            with one_algebra_thread() if clock.depth == 1 else nullcontext():
                made: Any = run(*args, **kwargs)
            parts = clock.read() - first
            result: R = replace(made, cost=replace(made.cost, total_s=parts.total, parts=parts))
        finally:
            clock.depth -= 1
        return result

    return whole
