"""What error control measures: the tracked quantities of a scene at many states at once, and what a computation costs.

The error of a run is the largest difference of its tracked quantities. Decisions are made by counted work
(`mechlab.integrate.work`), which is the same on every machine; CPU seconds are only reported.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording, frame_positions
from mechlab.integrate import work_done
from mechlab.lab.methods import Problem
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.batch_tree import CACHED, BatchTree, Poses
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length


@dataclass(frozen=True)
class States:
    """Coordinates q, rates v and accelerations a, each (n, nv), at given times; a is None unless it was asked for."""

    q: Array
    v: Array
    a: Array | None


class ContinuousMotion(Protocol):
    """A motion that is known at any time of its scene, not only at the ends of steps."""

    def states(self, t: Array, accelerations: bool = False) -> States:
        """The motion at times t (n,)."""
        ...

    def cruder(self) -> ContinuousMotion:
        """The same motion from fewer nodes, or with another rounding: their difference estimates the error."""
        ...


TRACKED_UNITS = ("m", "rad")
NAMED_AT_MOST = 4
"""A sentence names up to so many tracked things one by one."""


class _Channels(dict[str, Any]):
    """The basic channels of some states, each computed when it is first asked for."""

    def __init__(self, measure: ErrorMeasure, q: Array, v: Array) -> None:
        super().__init__()
        self.measure, self.states = measure, (q, v)
        self.frames: Array | None = None
        self.poses: Poses | None = None
        self.places: dict[int, Array] = {}

    def __contains__(self, name: object) -> bool:
        return name in self.measure.known

    def __missing__(self, name: str) -> Array:
        m, tree, (q, v) = self.measure.problem.mechanism, self.measure.tree, self.states
        found = self.measure.known[name]
        if isinstance(found, tuple):
            if self.measure.functions and tree is not None and 1 < tree.ground and tree.ground * len(q) <= CACHED:
                return self._place(tree, found[0])[:, found[1]]
            if self.frames is None:
                self.frames = frame_positions(m, q) if tree is None else tree.frame_positions(q)
            return np.asarray(self.frames[:, found[0], found[1]])
        return np.asarray(m.value(found, q) if found == name else v @ m.row(found))


    def _place(self, tree: BatchTree, frame: int) -> Array:
        """(n, 3) positions of one frame: named channels are of few of them."""
        if self.poses is None:
            self.poses = tree.at(self.states[0])
        if frame not in self.places:
            links, places = tree.frames
            self.places[frame] = tree.positions(self.poses, (links[frame : frame + 1], places[frame : frame + 1]))[0]
        return self.places[frame]


class ErrorMeasure:
    """The tracked quantities of a scene: its channels in m or rad; where it names none, all frames; without frames, all joints.

    `unit`: of the error; `known`: each basic channel as (frame, axis), or as the joint or shaft it belongs to.
    """

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
            units = {"m"} if frames else {"m" if is_length(m, n) else "rad" for n in self.names} or {"rad"}
        self.unit = " or ".join(sorted(units))
        self.known: dict[str, str | tuple[int, int]] = {
            f"{f.name}_{a}": (k, i) for k, f in enumerate(m.frames) for i, a in enumerate("xyz")
        }
        self.known |= {f"{n}_rate": n for n in m.scalar_names} | {n: n for n in m.scalar_names}

    @property
    def what(self) -> str:
        """The tracked quantities in words."""
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


def tracked_units(problem: Problem) -> tuple[str, ...]:
    """The units of the positions that error control of the problem measures."""
    return tuple(ErrorMeasure(problem, None).unit.split(" or "))


def largest(difference: Array) -> float:
    """Largest absolute value; 0 for an empty array."""
    return float(np.abs(difference).max(initial=0.0))


def tracked_and_change(measure: ErrorMeasure, t: Array, states: States, *shifts: Array) -> tuple[Array, float]:
    """The tracked quantities (n, names) of states, and their largest change when the poses move by any of `shifts` (n, nv)."""
    count = len(t)
    q = np.concatenate([states.q, *(states.q + x for x in shifts)])
    every = measure(np.concatenate([t] * (1 + len(shifts))), q, np.concatenate([states.v] * (1 + len(shifts))))
    tracked = every[:count]
    return tracked, max(largest(every[k * count : (k + 1) * count] - tracked) for k in range(1, 1 + len(shifts)))


@dataclass
class RunCost:
    """What runs report of themselves: CPU seconds of stepping, and work [s]."""

    cpu_s: float = 0.0
    work: float = 0.0


class CostCounter:
    """Counts work and CPU time of this thread since it was made; what runs in `building` blocks is left out."""

    def __init__(self) -> None:
        self._start, self._out = time.thread_time(), 0.0
        self._first, self._free = work_done(), 0.0

    @property
    def cpu_s(self) -> float:
        """CPU seconds so far; no decision depends on them."""
        return time.thread_time() - self._start - self._out

    @property
    def work(self) -> float:
        """Counted work so far [s]; decisions are made by it."""
        return work_done() - self._first - self._free

    @contextmanager
    def building(self) -> Iterator[None]:
        """A block in which models are built; its cost does not count."""
        with self.stepping():
            yield

    @contextmanager
    def stepping(self) -> Iterator[RunCost]:
        """A block of which only the CPU time and work of its runs count, as written into the RunCost."""
        began, first, cost = time.thread_time(), work_done(), RunCost()
        try:
            yield cost
        finally:
            self._out += time.thread_time() - began - cost.cpu_s
            self._free += work_done() - first - cost.work
