"""In what an error is measured: the tracked quantities of the scene, at many states at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording, frame_positions
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.error_control.motion import States
from mechlab.study.methods import Problem

TRACKED_UNITS = ("m", "rad")
MOST_NAMED = 4
"""Tracked things that a sentence names one by one."""


class _Channels(dict[str, Any]):
    """Basic channels of states, computed when they are asked for."""

    def __init__(self, measure: Measure, q: Array, v: Array) -> None:
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


class Measure:
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
        shown = ", ".join(names) if len(names) <= MOST_NAMED else f"all {len(names)}"
        return f"the position of {shown}{' frames' if frames and len(names) > MOST_NAMED else ''}"

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


def most(difference: Array) -> float:
    """Largest absolute value; 0 of nothing."""
    return float(np.abs(difference).max(initial=0.0))


def compared(measure: Measure, t: Array, states: States, *away: Array) -> tuple[Array, float]:
    """The tracked quantities of states, and their largest change when the poses move by `away`."""
    count = len(t)
    q = np.concatenate([states.q, *(states.q + x for x in away)])
    every = measure(np.concatenate([t] * (1 + len(away))), q, np.concatenate([states.v] * (1 + len(away))))
    tracked = every[:count]
    return tracked, max(most(every[k * count : (k + 1) * count] - tracked) for k in range(1, 1 + len(away)))
