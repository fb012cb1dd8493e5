"""What a motion found as a whole, not step by step, can be asked.

In what an error is measured: the tracked quantities of the scene, at many states at once.

What finding a motion costs: counted work, by which decisions are made, and CPU seconds, which are told.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording, frame_positions
from mechlab.integrate import work_done
from mechlab.lab.accuracy.batch import BatchTree
from mechlab.lab.methods import Problem
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class States:
    """q, v, a (n, nv) at asked times; a where it was asked for."""

    q: Array
    v: Array
    a: Array | None


class ContinuousMotion(Protocol):
    """A motion at any times of its scene."""

    def states(self, t: Array, accelerations: bool = False) -> States:
        """The motion at times t (n,)."""
        ...

    def cruder(self) -> ContinuousMotion:
        """The same motion as less work, or other rounding, gives it: what the error is estimated from."""
        ...


TRACKED_UNITS = ("m", "rad")
NAMED_AT_MOST = 4
"""Tracked things that a sentence names one by one."""


class _Channels(dict[str, Any]):
    """Basic channels of states, computed when they are asked for."""

    def __init__(self, measure: ErrorMeasure, q: Array, v: Array) -> None:
        super().__init__()
        self.measure, self.states = measure, (q, v)
        self.frames: Array | None = None

    def __contains__(self, name: object) -> bool:
        return name in self.measure.known

    def __missing__(self, name: str) -> Array:
        m, tree, (q, v) = self.measure.problem.mechanism, self.measure.tree, self.states
        found = self.measure.known[name]
        if isinstance(found, tuple):
            if self.frames is None:
                self.frames = frame_positions(m, q) if tree is None else tree.frame_positions(q)
            return np.asarray(self.frames[:, found[0], found[1]])
        return np.asarray(m.value(found, q) if found == name else v @ m.row(found))


class ErrorMeasure:
    """The tracked quantities: channels of the scene in m or rad, else all frames, else all joints. `unit`: of the error;
    `known`: basic channels, as (frame, axis) or the joint or shaft that they tell of."""

    def __init__(self, problem: Problem, tree: BatchTree | None) -> None:
        entry, m = problem.design.entry, problem.mechanism
        self.problem, self.tree = problem, tree
        named = [n for n in problem.scene.channels if n in entry.channels and entry.channels[n][0] in TRACKED_UNITS]
        self.functions = [entry.channels[n][1] for n in named]
        self.names = tuple(named)
        units = {entry.channels[n][0] for n in named}
        if not named:
            frames = tuple(f"{f.name}_{a}" for f in m.frames for a in "xyz")
            self.names = frames or m.scalar_names
            slides = all(j.kind == "prismatic" for j in m.joints)
            units = {"m"} if frames or slides else {"rad"}
            if not frames and not slides and any(j.kind == "prismatic" for j in m.joints):
                units = {"m", "rad"}
        self.unit = " or ".join(sorted(units))
        self.known: dict[str, str | tuple[int, int]] = {
            f"{f.name}_{a}": (k, i) for k, f in enumerate(m.frames) for i, a in enumerate("xyz")
        }
        self.known |= {f"{n}_rate": n for n in m.scalar_names} | {n: n for n in m.scalar_names}

    @property
    def what(self) -> str:
        """The tracked quantities in words; all other channels follow with errors of their own."""
        if self.functions:
            return ", ".join(self.names)
        frames = self.problem.mechanism.frames
        names = [f.name for f in frames] if frames else list(self.names)
        shown = ", ".join(names) if len(names) <= NAMED_AT_MOST else f"all {len(names)}"
        return f"the position of {shown}{' frames' if frames and len(names) > NAMED_AT_MOST else ''}"

    def __call__(self, t: Array, q: Array, v: Array) -> Array:
        """(n, names) tracked quantities of states at times t (n,). Raises MechlabError when a channel needs more."""
        m = self.problem.mechanism
        channels = _Channels(self, q, v)
        if not self.functions:
            return np.array([channels[n] for n in self.names]).T
        bare = Recording(m, t, q, v, channels)
        p = self.problem.design.parameters
        try:
            return np.array([f(p, bare) for f in self.functions]).T
        except KeyError as missing:
            raise MechlabError(
                f"{m.name}: a tracked channel needs {missing}, which states alone do not tell."
            ) from None


def largest(difference: Array) -> float:
    """Largest absolute value; 0 of nothing."""
    return float(np.abs(difference).max(initial=0.0))


def tracked_and_change(measure: ErrorMeasure, t: Array, states: States, *away: Array) -> tuple[Array, float]:
    """The tracked quantities of states, and their largest change when the poses move by `away`."""
    count = len(t)
    q = np.concatenate([states.q, *(states.q + x for x in away)])
    every = measure(np.concatenate([t] * (1 + len(away))), q, np.concatenate([states.v] * (1 + len(away))))
    tracked = every[:count]
    return tracked, max(largest(every[k * count : (k + 1) * count] - tracked) for k in range(1, 1 + len(away)))


@dataclass
class RunCost:
    """What runs tell of themselves: CPU seconds of stepping, work."""

    cpu_s: float = 0.0
    work: float = 0.0


class CostMeter:
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
    def stepping(self) -> Iterator[RunCost]:
        """In this block only what is told counts: CPU time and work of the runs in it."""
        began, first, told = time.thread_time(), work_done(), RunCost()
        try:
            yield told
        finally:
            self._out += time.thread_time() - began - told.cpu_s
            self._free += work_done() - first - told.work
