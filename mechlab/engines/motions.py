"""Poses, rates and accelerations by one engine at many poses: its model, its rows and the choice among them are kept.

    rates          [J; G] v = [0; given],          accelerations   [J; G] a = [0; given] - dJ/dt v

J: rows of loops and relations, G: rows of the given quantities, both of the engine's own kinematics. Rows are gathered pose by pose
and solved together; where they contradict each other (a singular pose) the pose is handed back, and the engine's own functions
`rates` and `accelerations_of` say why.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_motion import ManyMotion, rows_of
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.many_rows import NewtonSteps
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.named_rows import LETTERS
from mechlab.mechanism.structure import generic

CONSISTENT = 1e-8
"""Largest share by which rates or accelerations may miss their rows; as in the functions of one pose."""
Mask = NDArray[np.bool_]


class KeptState(Protocol):
    """An engine's kinematics at one state, in coordinates and rates of its own."""

    mechanism: Mechanism

    def start(self, q: Array) -> Array:
        """The engine's coordinates of a pose q (nq,)."""
        ...

    def place(self, x: Array) -> None:
        """Move to coordinates at rest."""
        ...

    def move(self, x: Array, u: Array) -> None:
        """Move to coordinates and rates."""
        ...

    def rate_rows(self, names: Sequence[str]) -> Array:
        """(m, n) rows of loops and relations, then of the named quantities."""
        ...

    def accel_rows(self, names: Sequence[str]) -> tuple[Array, Array]:
        """(m, n) rows, and (m,) dJ/dt u."""
        ...

    def frame(self, name: str) -> tuple[Array, Array, Array, Array]:
        """Pose (4, 4), velocity (6,), Jacobian (6, n) and dJ/dt u (6,) of a Frame: linear at its origin, then angular, world axes."""
        ...

    def rates(self, u: Array) -> Array:
        """(..., nv) rates of the mechanism from the engine's."""
        ...


@dataclass(frozen=True)
class Motions:
    """Rates v and accelerations a (n, nv); of each frame its pose (n, 4, 4), velocity and acceleration (n, 6); solved (n,): where
    the given ones agree with the rows."""

    v: Array
    a: Array
    frames: Mapping[str, tuple[Array, Array, Array]] = field(default_factory=dict)
    solved: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))


class KeptMotions:
    """Rates, accelerations and the motion of frames by a state of an engine, with the choice of rows for each set of names."""

    def __init__(self, state: KeptState) -> None:
        self.state = state
        self._steps: dict[tuple[str, tuple[str, ...]], NewtonSteps] = {}
        self._seen: tuple[bytes, tuple[str, ...], list[Array]] = b"", (), []

    def at(
        self,
        q: Array,
        rate: Mapping[str, Any],
        accel: Mapping[str, Any],
        frames: Sequence[str] = (),
        moving: bool = True,
    ) -> Motions:
        """The motion at poses q (n, nq) with the given rates and accelerations (numbers or (n,)); at rest without `moving`."""
        state, m, count = self.state, self.state.mechanism, len(q)
        places = [state.start(x) for x in q]
        width = len(state.rate_rows(()).T)
        u, w, solved = np.zeros((count, width)), np.zeros((count, width)), np.ones(count, dtype=bool)
        if moving and rate:
            rows = self._rate_rows(q, places, tuple(rate))
            u, solved = self._meet("rate", rows, rate, [np.zeros(len(r)) for r in rows])
        seen: dict[str, list[tuple[Array, Array, Array, Array]]] = {name: [] for name in frames}
        both: list[tuple[Array, Array]] = []
        if moving or frames:
            for x, v in zip(places, u, strict=True):
                state.move(x, v)
                if moving and (rate or accel):
                    both.append(state.accel_rows(tuple(accel)))
                for name in frames:
                    seen[name].append(state.frame(name))
        if both:
            w, met = self._meet("accel", [r for r, _ in both], accel, [b for _, b in both])
            solved &= met
        told = {}
        for name, found in seen.items():
            pose, velocity, jacobian, bias = (np.array(x) for x in zip(*found, strict=True))
            told[name] = pose, velocity, bias + (jacobian @ w[:, :, None])[:, :, 0]
        return Motions(
            np.asarray(state.rates(u)).reshape(count, m.nv),
            np.asarray(state.rates(w)).reshape(count, m.nv),
            told,
            solved,
        )

    def _rate_rows(self, q: Array, places: Sequence[Array], names: tuple[str, ...]) -> list[Array]:
        """The rate rows at poses q (n, nq), which are kept: one rate after the other is given at the same poses."""
        key = q.tobytes(), names
        if self._seen[:2] != key:
            rows = []
            for x in places:
                self.state.place(x)
                rows.append(self.state.rate_rows(names))
            self._seen = *key, rows
        return self._seen[2]

    def _meet(
        self, what: str, rows: Sequence[Array] | Array, given: Mapping[str, Any], bias: Sequence[Array] | Array
    ) -> tuple[Array, Mask]:
        """The smallest (n, width) with rows @ x = [0; given] - bias, and where it exists."""
        steps = self._of(what, tuple(given))
        usual = np.array([len(r) == steps.count for r in rows])  # MuJoCo drops rows that no motion can violate
        if not usual.all():
            spare = next((k for k in range(len(rows)) if usual[k]), None)
            if spare is None:
                return np.zeros((len(rows), rows[0].shape[1])), usual
            rows = [r if fits else rows[spare] for r, fits in zip(rows, usual, strict=True)]
            bias = [b if fits else bias[spare] for b, fits in zip(bias, usual, strict=True)]
        matrices, right = np.array(rows), -np.array(bias)
        first = right.shape[1] - len(given)
        for k, value in enumerate(given.values()):
            right[:, first + k] += value
        with np.errstate(all="ignore"):
            inverse = steps.inverse(matrices)
            x = steps.step(inverse, -right)
            x = x + steps.step(
                inverse, (matrices @ x[:, :, None])[:, :, 0] - right
            )  # takes out what squaring the rows has cost
            missed = np.max(np.abs((matrices @ x[:, :, None])[:, :, 0] - right), axis=1, initial=0.0)
            met = usual & (missed <= CONSISTENT * np.maximum(1.0, np.max(np.abs(right), axis=1, initial=0.0)))
        return np.where(met[:, None], x, 0.0), met

    def _of(self, what: str, names: tuple[str, ...]) -> NewtonSteps:
        if (what, names) not in self._steps:
            state, x = self.state, self.state.start(generic(self.state.mechanism)[0])
            state.place(x)
            width = state.rate_rows(()).shape[1]
            if what == "rate":
                rows = state.rate_rows(names)
            else:
                state.move(x, np.zeros(width))
                rows = state.accel_rows(names)[0]
            self._steps[what, names] = NewtonSteps(rows, np.zeros((0, width)))
        return self._steps[what, names]


class TreeMotions(KeptMotions):
    """The same by numpy alone, all poses at once."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.poses = ManyPoses(mechanism)
        self._steps = {}

    def at(
        self, q: Array, rate: Mapping[str, Any], accel: Mapping[str, Any], frames: Sequence[str] = (), moving: bool = True
    ) -> Motions:
        """The motion at poses q (n, nq); see `KeptMotions.at`."""
        poses, m, count = self.poses.set(q), self.poses.mechanism, len(q)
        v, a, solved = np.zeros((count, m.nv)), np.zeros((count, m.nv)), np.ones(count, dtype=bool)
        closure = poses.residual_and_jacobian()[1] if moving else np.zeros((count, 0, m.nv))
        if moving and rate:
            rows = np.concatenate([closure, rows_of(poses, tuple(rate))], axis=1)
            v, solved = self._meet("rate", rows, rate, np.zeros(rows.shape[:2]))
        motion = ManyMotion(poses, v)
        if moving and (rate or accel):
            rows = np.concatenate([closure, rows_of(poses, tuple(accel))], axis=1)
            a, met = self._meet("accel", rows, accel, np.concatenate([motion.bias(), motion.bias_of(tuple(accel))], axis=1))
            solved = solved & met
        told = {}
        for name in frames:
            place = m.frame(name)
            rotation, origin = poses.frame(place.body)
            point = origin + rotation @ place.placement.translation
            pose = np.zeros((count, 4, 4))
            pose[:, :3, :3], pose[:, :3, 3], pose[:, 3, 3] = rotation @ place.placement.rotation, point, 1.0
            velocity, bias = motion.point(place.body, point)
            rows = rows_of(poses, [f"{name}_{letter}" for letter in LETTERS])
            told[name] = pose, velocity, bias + (rows @ a[:, :, None])[:, :, 0]
        return Motions(v, a, told, solved)

    def _of(self, what: str, names: tuple[str, ...]) -> NewtonSteps:
        if (what, names) not in self._steps:
            m = self.poses.mechanism
            there = ManyPoses(m).set(generic(m)[0][None])
            rows = np.concatenate([there.residual_and_jacobian()[1], rows_of(there, names)], axis=1)[0]
            self._steps[what, names] = NewtonSteps(rows, np.zeros((0, m.nv)))
        return self._steps[what, names]
