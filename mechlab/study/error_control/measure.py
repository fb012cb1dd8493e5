"""In what an error is measured: the tracked quantities of the scene, at many states at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording, frame_positions
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.methods import Problem

TRACKED_UNITS = ("m", "rad")


class _Channels(dict[str, Any]):
    """Basic channels of states, computed when they are asked for."""

    def __init__(self, mechanism: Mechanism, tree: BatchTree | None, q: Array, v: Array) -> None:
        super().__init__()
        self.mechanism, self.tree, self.states = mechanism, tree, (q, v)
        self.frames: Array | None = None

    def __contains__(self, name: object) -> bool:
        return self._known(str(name))

    def _known(self, name: str) -> bool:
        m = self.mechanism
        frame, _, letter = name.rpartition("_")
        known = name in m._rows or name.removesuffix("_rate") in m._rows
        return known or (letter in ("x", "y", "z") and any(f.name == frame for f in m.frames))

    def __missing__(self, name: str) -> Array:
        m, (q, v) = self.mechanism, self.states
        if name in m._rows:
            return np.asarray(m.value(name, q))
        if name.endswith("_rate") and name.removesuffix("_rate") in m._rows:
            return np.asarray(v @ m.row(name.removesuffix("_rate")))
        frame, _, letter = name.rpartition("_")
        if self.frames is None:
            self.frames = frame_positions(m, q) if self.tree is None else self.tree.frame_positions(q)
        k = [f.name for f in m.frames].index(frame)
        return np.asarray(self.frames[:, k, "xyz".index(letter)])


class Measure:
    """The tracked quantities: channels of the scene in m or rad, else all frames, else all joints. `unit`: of the error."""

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

    def __call__(self, t: Array, q: Array, v: Array) -> Array:
        """(n, names) tracked quantities of states at times t (n,). Raises MechlabError when a channel needs more."""
        m = self.problem.mechanism
        channels = _Channels(m, self.tree, q, v)
        if not self.functions:
            return np.column_stack([channels[n] for n in self.names])
        bare = Recording(m, t, q, v, channels)
        p = self.problem.design.parameters
        try:
            return np.column_stack([f(p, bare) for f in self.functions])
        except KeyError as missing:
            raise MechlabError(
                f"{m.name}: a tracked channel needs {missing}, which states alone do not tell."
            ) from None


def most(difference: Array) -> float:
    """Largest absolute value; 0 of nothing."""
    return float(np.abs(difference).max(initial=0.0))
