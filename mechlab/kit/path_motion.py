"""The motion of a mechanism along its stated path, by one witness: quantities by name at even places of the path.

    motion = EngineMotion("mujoco", m, {"crank_angle": (0.0, 6.28)}, 25)
    motion["P_x"], motion["rocker_angle_rate"]          # (25,) each

The path is the time from 0 to 1 s; each drive moves evenly from its first value to its last. Quantities are those of the engines
(`mechlab.kit.quantities`): joints, shafts, NAME_x _y _z of frames, and their rates; NAME_accel of joints and shafts; DRIVE_force, the
force [N or N m] of a drive that holds the mechanism still against gravity and springs, and DRIVE_steady, the one that keeps it in even
motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np

from mechlab.engines.closer import Closer
from mechlab.engines.motions import Motions
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.newton import Status

M = TypeVar("M")
Path = Mapping[str, tuple[float, float]]
"""Joint or shaft -> its value at the beginning and at the end of the path."""


HALVINGS = 4
"""Most halvings of a step between two places."""
STEP, SIXTH = 1e-3, np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
"""Step in the time of the path and weights of the difference: for a turn its error is about 1e-13 of the rate, rounding included 1e-12."""


_KEPT: ContextVar[list[tuple[object, Any, Any]] | None] = ContextVar("_KEPT", default=None)
"""The last maker, its argument and what it made, inside `keeping`."""


@contextmanager
def keeping() -> Iterator[None]:
    """Inside, the motions of one mechanism after the other are computed once for all of its checks."""
    token = _KEPT.set([])
    try:
        yield
    finally:
        _KEPT.reset(token)


def kept(of: object, p: Any, make: Callable[[Any], M]) -> M:
    """make(p), or what it made last for the same `of` and p inside `keeping`."""
    last = _KEPT.get()
    if last is None:
        return make(p)
    if not (last and last[0][0] is of and last[0][1] == p):
        last[:] = [(of, p, make(p))]
    return cast(M, last[0][2])


class NotInClosedForm(MechlabError):
    """A closed form does not have this quantity."""


class ClosedMotion(dict[str, Array]):
    """The motion that a closed form has computed. Raises NotInClosedForm for a quantity that it does not have."""

    @classmethod
    def along(cls, path: Path, form: Callable[[Mapping[str, Array]], Mapping[str, Array]], places: int | Array) -> ClosedMotion:
        """Values of form(drives (n,)) at places of a path (see `EngineMotion`), angles continuous, and their rates by differences of sixth
        order, but those NAME_rate and NAME_accel that the form gives itself."""
        near = STEP * np.arange(-3, 4)
        shares = np.linspace(0.0, 1.0, places) if isinstance(places, int) else places
        times = (shares[:, None] + near).ravel()
        given = {n: a + (b - a) * times for n, (a, b) in path.items()}
        found = cls()
        for name, x in (given | dict(form(given))).items():
            rows = np.broadcast_to(x, times.shape)
            if name.endswith(("_rate", "_accel")):
                found[name] = rows.reshape(len(shares), len(near))[:, 3]
                continue
            rows = np.unwrap(rows).reshape(len(shares), len(near))
            found[name] = rows[:, 3]
            found.setdefault(f"{name}_rate", rows @ SIXTH / STEP)
        return found

    def __missing__(self, name: str) -> Array:
        raise NotInClosedForm(str(unknown("closed form: quantity", name, self)))


class EngineMotion(Mapping[str, Array]):
    """The motion by one engine, each pose closed from the one before, the first from the reference pose.

    Raises NoSolution where the mechanism does not close, MechlabError for an unknown quantity.
    """

    def __init__(self, witness: str, m: Mechanism, path: Path, places: int | Array) -> None:
        """places: a number of even ones, or all of them, rising from 0 to 1."""
        self.engine, self.m, self.path = engine(witness), m, path
        self.places = np.linspace(0.0, 1.0, places) if isinstance(places, int) else np.asarray(places, dtype=float)
        self._frames: dict[str, tuple[Array, Array]] = {}
        self._found: dict[str, Array] = {}
        self._bias: dict[bool, Array] = {}

    @cached_property
    def q(self) -> Array:
        """(n, nq) closed coordinates."""
        closer = Closer(self.m, tuple(self.path), self.engine.name)
        first, places = self._closed(closer, 0.0), self.places.tolist()
        return np.array([first, *(self._on(closer, s, t, HALVINGS) for s, t in zip(places[:-1], places[1:], strict=True))])

    def _on(self, closer: Closer, s: float, t: float, halvings: int) -> Array:
        """The pose at t from the one at s, through the middle where the way is too far for the solver to keep its mode."""
        try:
            return self._closed(closer, t)
        except NoSolution:
            if not halvings:
                raise
        middle = 0.5 * (s + t)
        self._on(closer, s, middle, halvings - 1)
        return self._on(closer, middle, t, halvings - 1)

    def _closed(self, closer: Closer, s: float) -> Array:
        """The pose at s, from the one where the closer stands."""
        given = {n: a + (b - a) * s for n, (a, b) in self.path.items()}
        found = closer(given)
        if not found.closed:
            assert isinstance(found.status, Status)  # of one pose
            where = ", ".join(f"{n} = {x:.6g}" for n, x in given.items())
            raise NoSolution(f"{self.m.name}: {self.engine.name}: {found.status.value}, at {where}.")
        return found.q

    @cached_property
    def v(self) -> Array:
        """(n, nv) rates."""
        return self._moving.v if self._moving.solved.all() else self._one_by_one(self._speeds)

    @cached_property
    def a(self) -> Array:
        """(n, nv) accelerations; those of the drives are 0."""
        if self._moving.solved.all():
            return self._moving.a
        still = dict.fromkeys(self.path, 0.0)
        return np.array([self.engine.accelerations_of(self.m, q, v, still) for q, v in zip(self.q, self.v, strict=True)])

    @cached_property
    def _moving(self) -> Motions:
        """Rates, accelerations and the motion of all frames at all places."""
        frames = [f.name for f in self.m.frames]
        return self.engine.motions(self.m).at(self.q, self._speeds, dict.fromkeys(self.path, 0.0), frames)

    @property
    def _speeds(self) -> dict[str, float]:
        return {n: b - a for n, (a, b) in self.path.items()}

    def _rates(self, given: Mapping[str, float]) -> Array:
        """(n, nv) rates with the given ones."""
        found = self.engine.motions(self.m).at(self.q, given, {})
        return found.v if found.solved.all() else self._one_by_one(given)

    def _one_by_one(self, given: Mapping[str, float]) -> Array:
        """The same by the function of one pose, which says where they contradict the closure."""
        return np.array([self.engine.rates(self.m, q, given) for q in self.q])

    def force(self, drive: str, moving: bool) -> Array:
        """(n,) force of a drive, by its power: h . v1 for the rates v1 of a unit rate of the drive, the others held; h the bias forces at
        rest, or at the rates of the path. Raises MechlabError for a motion that is not even: its accelerations would count too."""
        if moving and np.ptp(self.v, axis=0).max() > 1e-7 * (1.0 + np.abs(self.v).max()):
            raise MechlabError(f"{self.m.name}: {drive}_steady: the joints do not turn evenly along this path; ask for {drive}_force.")
        alone = {n: float(n == drive) for n in self.path}
        if moving not in self._bias:
            states = zip(self.q, self.v if moving else np.zeros(self.v.shape), strict=True)
            self._bias[moving] = np.array([self.engine.placed(self.m, q, v).bias() for q, v in states])
        return np.asarray((self._bias[moving] * self._rates(alone)).sum(axis=1))

    def __getitem__(self, key: str) -> Array:
        if key not in self._found:  # also asked by `in`
            self._found[key] = self._quantity(key)
        return self._found[key]

    def _quantity(self, key: str) -> Array:
        m, name = self.m, key.removesuffix("_rate")
        if name in m.scalar_names:
            if key != name:
                return np.asarray(self.v @ m.row(name))
            return np.array([float(m.value(name, q)) for q in self.q])
        if key.endswith("_accel") and key.removesuffix("_accel") in m.scalar_names:
            return np.asarray(self.a @ m.row(key.removesuffix("_accel")))
        drive, _, kind = key.rpartition("_")
        if drive in self.path and kind in ("force", "steady"):
            return self.force(drive, kind == "steady")
        frame, _, letter = name.rpartition("_")
        if letter not in ("x", "y", "z") or frame not in {f.name for f in m.frames}:
            raise unknown(f"{m.name}: quantity", key, self)
        if frame not in self._frames:
            if self._moving.solved.all():
                pose, velocity, _ = self._moving.frames[frame]
                self._frames[frame] = pose[:, :3, 3], velocity[:, :3]
            else:
                found = [self.engine.frame_motion(m, frame, q, v) for q, v in zip(self.q, self.v, strict=True)]
                self._frames[frame] = np.array([f[0][:3, 3] for f in found]), np.array([f[1][:3] for f in found])
        return self._frames[frame][key != name][:, "xyz".index(letter)]

    def __iter__(self) -> Iterator[str]:
        m = self.m
        names = (*m.scalar_names, *(f"{f.name}_{x}" for f in m.frames for x in "xyz"))
        return iter([*names, *(f"{n}_rate" for n in names), *(f"{n}_force" for n in self.path)])

    def __len__(self) -> int:
        return 2 * (len(self.m.scalar_names) + 3 * len(self.m.frames)) + len(self.path)
