"""A kept closer: a mechanism whose given quantities are named once, and whose poses then cost microseconds.

    closer = ml.load("fourbar").closer("crank_angle")
    pose = closer(crank_angle=1.2)                    # from the pose before, by Pinocchio's kinematics
    pose["rocker_angle"]
    poses = closer(crank_angle=np.linspace(0.0, 6.28, 360), crank_angle_rate=1.0)
    poses["rocker_angle_rate"]                        # (360,)

Model, rows, and the choice among redundant rows are made once. A pose is led from the one before by the tangent and Newton's method
(`mechlab.mechanism.warm_start`), an array of poses along straight paths of the given values from the one before, by numpy alone
(`mechlab.mechanism.closing`), which the engine then closes by its own kinematics. What is unusual (a singular position, a long way, a
path that ends) goes to the robust search of the engine, with its statuses; another assembly mode is never taken silently.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.engines.motions import Motions
from mechlab.engines.protocol import Engine, engine
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.closing import CLOSED, ManyClosed, close_many
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import coordinate_units, in_unit_of_length, is_length
from mechlab.mechanism.many_rows import ManyRows
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.named_rows import LETTERS
from mechlab.mechanism.newton import Assembly, Status
from mechlab.mechanism.warm_start import PoseEquations, TreeEquations, WarmStart, largest
from mechlab.values import in_unit, short

NEAR = 1e-9
"""Largest residual [m or rad] at a pose of numpy that an engine's own Newton step may start from."""
TOGETHER, MOST_STEPS = 500, 3
"""Poses that take such a step together, and the most steps of a pose."""
FLOATS = {float}
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class ClosedPoses:
    """One pose, or n of them: q (nq,) or (n, nq), coordinates as of the Mechanism; `status`, one or n; `residual`, the largest of all
    rows; rates v and accelerations a (nv,) or (n, nv), where any were given. Poses that are not closed are NaN.

    pose["NAME"]: a joint or shaft (physical value), NAME_rate, NAME_accel; FRAME_x, FRAME_y, FRAME_z and their rates.
    """

    mechanism: Mechanism
    q: Array
    status: Status | tuple[Status, ...]
    residual: float | Array
    v: Array | None = None
    a: Array | None = None
    frames: Mapping[str, tuple[Array, Array, Array]] = field(default_factory=dict, repr=False)

    @property
    def closed(self) -> bool | Mask:
        """True where the pose is an answer (closed, perhaps at a singular position)."""
        if isinstance(self.status, Status):
            return self.status.exit_code == 0
        return np.array([s.exit_code == 0 for s in self.status], dtype=bool)

    def __getitem__(self, name: str) -> Any:
        m = self.mechanism
        for order, suffix in ((2, "_accel"), (1, "_rate"), (0, "")):
            stem = name.removesuffix(suffix)
            if stem == name and suffix:
                continue
            if stem in m.scalar_names:
                if not order:
                    return m.value(stem, self.q)
                return self._motion(order, name) @ m.row(stem)
            frame, _, letter = stem.rpartition("_")
            if frame in self.frames and letter in LETTERS[:3]:
                if order:
                    self._motion(order, name)
                found = self.frames[frame][order]
                return found[..., LETTERS.index(letter), 3] if not order else found[..., LETTERS.index(letter)]
        raise unknown(
            f"{m.name}: quantity", name, [*m.scalar_names, *(f"{f}_{a}" for f in self.frames for a in LETTERS[:3])]
        )

    def _motion(self, order: int, name: str) -> Array:
        found = self.v if order == 1 else self.a
        if found is None:
            raise MechlabError(
                f"{self.mechanism.name}: {name}: give rates (X_rate=..., X_accel=...) to have rates and accelerations."
            )
        return found


class Closer:
    """See the module. names: joints, shafts, FRAME_x, FRAME_y, FRAME_z, FRAME_rotation; engine_name: "numpy", "pinocchio" or
    "mujoco"; frames: Frames whose motion is computed as well. Raises MechlabError for an unknown name, EngineMissing.

    A closer belongs to one thread. It starts from the reference pose; `start_from` puts it elsewhere.
    """

    def __init__(
        self, mechanism: Mechanism, names: Sequence[str], engine_name: str = "numpy", frames: Sequence[str] = ()
    ) -> None:
        self.mechanism, self.names, self.frames = mechanism, tuple(dict.fromkeys(map(str, names))), tuple(frames)
        for name in self.frames:
            mechanism.frame(name)
        self.engine: Engine = engine(engine_name)
        self.unit = mechanism.length_scale
        self._m = mechanism if self.unit == 1.0 else in_unit_of_length(mechanism, self.unit)
        self._q_units = coordinate_units(mechanism, self.unit)
        self._v_units = np.array([self.unit if j.kind == "prismatic" else 1.0 for j in mechanism.joint_of_rate])
        self._lengths = {n: self.unit if is_length(mechanism, n) else 1.0 for n in self.names}
        self._many = ManyRows(self._m, self.names)
        self._equations = self.engine.pose_equations(self._m, self.names)
        self._warm = WarmStart(self._equations)
        self.start_from(mechanism.reference())

    def __repr__(self) -> str:
        given = ", ".join(self.names)
        frames = f", frames {', '.join(self.frames)}" if self.frames else ""
        return f"Closer of {self.mechanism.name} by {self.engine.name}, given {given}{frames}"

    def start_from(self, q: ArrayLike) -> Closer:
        """Go on from the closed pose q (nq,). Raises MechlabError where it does not close."""
        q = np.asarray(q, dtype=float)
        if q.shape != (self.mechanism.nq,):
            raise MechlabError(
                f"{self.mechanism.name}: coordinates have shape {q.shape}, expected ({self.mechanism.nq},)."
            )
        placed = self._many.at(q[None] / self._q_units)
        gap = float(np.max(np.abs(placed.gap), initial=0.0))
        if not gap < NEAR:
            raise MechlabError(f"{self.mechanism.name}: the pose to start from is open by {gap:.3g}; close it first.")
        self._put(q / self._q_units, [x[0] for x in placed.values])
        return self

    def __call__(self, values: Mapping[str, Any] | None = None, /, **given: Any) -> ClosedPoses:
        """The pose with the given values, or n poses where values are arrays (n,); X_rate and X_accel give rates and accelerations
        (an acceleration that is not given is 0).

        Raises MechlabError for names that the closer was not made for, NoSolution for rates that contradict the closure.
        """
        if values is not None and not isinstance(values, Mapping):
            raise MechlabError(f"{self.mechanism.name}: expected a mapping of names to values, got {short(values)}.")
        asked = given if values is None else dict(values) | given
        if not self.frames and len(asked) == len(self.names):  # the short way of a loop of poses
            targets: list[Any] = [asked.get(n) for n in self.names]
            if {*map(type, targets)} == FLOATS:
                if self.unit != 1.0:
                    targets = [x / self._lengths[n] for n, x in zip(self.names, targets, strict=True)]
                return self._plain(self._one(targets))
        asked = dict(asked)
        position = {n: self._number(n, asked.pop(n)) for n in self.names if n in asked}
        if missing := [n for n in self.names if n not in position]:
            raise MechlabError(f"{self.mechanism.name}: the closer needs {', '.join(missing)}.")
        rate, accel = self._rates(asked)
        shapes = [*(np.shape(x) for x in (*rate.values(), *accel.values())), *self._shapes(position)]
        try:
            shape = np.broadcast_shapes(*shapes)
        except ValueError:
            sizes = ", ".join(str(s) for s in dict.fromkeys(shapes) if s)
            raise MechlabError(f"{self.mechanism.name}: expected arrays of one length, got the shapes {sizes}.") from None
        if len(shape) > 1:
            raise MechlabError(f"{self.mechanism.name}: expected numbers or arrays of one axis, got the shape {shape}.")
        one = not shape
        count = 1 if one else shape[0]
        scaled = {n: x / self._lengths[n] if self._lengths[n] != 1.0 else x for n, x in position.items()}
        if one:
            found = self._one([x if type(x := scaled[n]) is float or np.ndim(x) else float(x) for n in self.names])
            q, residual, statuses = found.q[None], np.array([found.residual]), [found.status]
        else:
            q, residual, statuses = self._many_poses(scaled, count)
        closed = np.array([s.exit_code == 0 for s in statuses], dtype=bool)
        moving = bool(rate or accel)
        told = self._moved(q, closed, rate, accel, moving) if (moving or self.frames) else None
        q = np.where(closed[:, None], q * self._q_units, np.nan)
        pick: Any = 0 if one else slice(None)
        return ClosedPoses(
            self.mechanism, q[pick], statuses[0] if one else tuple(statuses), float(residual[0]) if one else residual,
            None if told is None or not moving else told.v[pick], None if told is None or not moving else told.a[pick],
            {} if told is None else {n: (p[pick], v[pick], a[pick]) for n, (p, v, a) in told.frames.items()},
        )  # fmt: skip

    def _number(self, key: str, value: Any) -> Any:
        """What is given for `key`: a float, or an array of floats; text is read as on the command line."""
        m = self.mechanism
        if isinstance(value, str):
            name = key.removesuffix("_rate").removesuffix("_accel")
            per = {"_rate": "/s", "_accel": "/s2"}.get(key.removeprefix(name), "")
            value = in_unit(key, value, f"{'m' if is_length(m, name) else 'rad'}{per}")
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise MechlabError(f"{m.name}: {key}: expected numbers, got {short(value)}.") from None
        if not np.isfinite(array).all():
            raise MechlabError(f"{m.name}: {key}: expected finite numbers, got {short(value)}.")
        if key.endswith("_rotation") and key not in m.scalar_names and not _are_rotations(array):
            raise MechlabError(f"{m.name}: {key}: expected rotation matrices (3, 3), frame axes to world.")
        return array if array.ndim else float(array)

    def _plain(self, found: Assembly) -> ClosedPoses:
        """One pose without motion."""
        closed = found.status is Status.SOLVED or found.status.exit_code == 0
        q = found.q * self._q_units if closed else np.full(len(found.q), np.nan)
        return ClosedPoses(self.mechanism, q, found.status, found.residual)

    # -- positions ---------------------------------------------------------------------------------------------------

    def _one(self, targets: list[Any]) -> Assembly:
        """One pose: by the warm start, else by the robust search from the pose before."""
        if not all(math.isfinite(t) if type(t) is float else np.all(np.isfinite(t)) for t in targets):
            raise MechlabError(f"{self.mechanism.name}: expected finite numbers, got {dict(zip(self.names, targets, strict=True))!r}.")
        found = self._warm.lead(targets)
        if found is not None:
            self._q = found.q
            return found
        found = self.engine.assemble(self._m, dict(zip(self.names, targets, strict=True)), start=self._q)
        if found.status.exit_code == 0:
            self._put(found.q, targets)
        return found

    def _many_poses(self, given: Mapping[str, Any], count: int) -> tuple[Array, Array, list[Status]]:
        """Poses (count, nq), residuals, statuses."""
        if not count:
            return np.zeros((0, self._m.nq)), np.zeros(0), []
        targets = self._many.targets(given, count)
        led = close_many(self._many, self._q, targets)
        q, residual, sure = confirmed(self._equations, led, targets)
        statuses = [Status.SOLVED] * count
        begin = self._q
        for k in np.flatnonzero(~sure).tolist():
            one = self.engine.assemble(
                self._m, {n: t[k] for n, t in zip(self.names, targets, strict=True)}, start=begin
            )
            q[k], residual[k], statuses[k] = one.q, one.residual, one.status
        last = next((k for k in range(count - 1, -1, -1) if statuses[k].exit_code == 0), None)
        if last is not None:
            self._put(q[last], [t[last] for t in targets])
        return q, residual, statuses

    def _put(self, q: Array, values: Sequence[Any]) -> None:
        self._q = np.array(q, dtype=float)
        self._warm.put(self._q, [x if np.ndim(x) else float(x) for x in values])

    # -- rates -------------------------------------------------------------------------------------------------------

    @cached_property
    def _rate_names(self) -> frozenset[str]:
        m = self.mechanism
        return frozenset({*m.scalar_names, *(f"{f.name}_{a}" for f in m.frames for a in LETTERS[:3])})

    def _rates(self, asked: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Given rates and accelerations by name; an acceleration that is not given is 0."""
        rate: dict[str, Any] = {}
        accel: dict[str, Any] = {}
        for key, value in asked.items():
            name, _, order = key.rpartition("_")
            if order not in ("rate", "accel") or name not in self._rate_names:
                known = [*self.names, *(f"{n}_{s}" for n in sorted(self._rate_names) for s in ("rate", "accel"))]
                raise unknown(f"{self.mechanism.name}: quantity", key, known)
            scale = self.unit if is_length(self.mechanism, name) else 1.0
            (rate if order == "rate" else accel)[name] = np.asarray(self._number(key, value)) / scale
        return rate, dict.fromkeys((*rate, *accel), 0.0) | accel

    def _moved(
        self, q: Array, closed: Mask, rate: Mapping[str, Any], accel: Mapping[str, Any], moving: bool
    ) -> Motions:
        count, m = len(q), self._m
        v, a = np.full((count, m.nv), np.nan), np.full((count, m.nv), np.nan)
        told = {
            n: (np.full((count, 4, 4), np.nan), np.full((count, 6), np.nan), np.full((count, 6), np.nan))
            for n in self.frames
        }
        if not closed.any():
            return Motions(v, a, told)

        def there(given: Mapping[str, Any]) -> dict[str, Any]:
            return {n: np.broadcast_to(x, count)[closed] if np.ndim(x) else x for n, x in given.items()}

        found = self.engine.motions(m).at(q[closed], there(rate), there(accel), self.frames, moving)
        if not found.solved.all():
            k = int(np.flatnonzero(~found.solved)[0])
            names = ", ".join(dict.fromkeys((*rate, *accel)))
            raise NoSolution(
                f"{m.name}: the rates of {names} contradict the closure at pose {np.flatnonzero(closed)[k]}: "
                "give as many as there are freedoms, away from singular poses."
            )
        v[closed], a[closed] = found.v * self._v_units, found.a * self._v_units
        for name, parts in found.frames.items():
            for whole, part, first in zip(told[name], parts, ((slice(0, 3), 3), slice(0, 3), slice(0, 3)), strict=True):
                whole[closed] = part
                whole[(slice(None), *first) if isinstance(first, tuple) else (slice(None), first)] *= self.unit
        return Motions(v, a, told)

    @staticmethod
    def _shapes(position: Mapping[str, Any]) -> list[tuple[int, ...]]:
        return [
            np.shape(x)[: np.ndim(x) - (2 if n.endswith("_rotation") and np.ndim(x) > 1 else 0)]
            for n, x in position.items()
        ]


def _are_rotations(matrices: Array) -> bool:
    """True for a rotation matrix (3, 3), or n of them, to 1e-9."""
    if matrices.ndim not in (2, 3) or matrices.shape[-2:] != (3, 3):
        return False
    off = matrices @ np.swapaxes(matrices, -1, -2) - np.eye(3)
    return bool(np.abs(off).max(initial=0.0) <= 1e-9 and np.all(np.linalg.det(matrices) > 0.0))


def confirmed(equations: PoseEquations, led: ManyClosed, targets: Sequence[Array]) -> tuple[Array, Array, Mask]:
    """The poses of numpy closed by an engine's own kinematics: one Newton step of its equations each, more where the residual is not
    at rounding. Returns q (n, nq), the residual that the engine found (n,), and which it confirms (n,)."""
    if isinstance(equations, TreeEquations):
        return led.q, led.residual, led.closed
    q, residual, sure = led.q.copy(), led.residual.copy(), np.zeros(len(led.q), dtype=bool)
    closed = np.flatnonzero(led.closed)
    with np.errstate(all="ignore"):
        for first in range(0, len(closed), TOGETHER):
            left = {k: equations.start(led.q[k]) for k in closed[first : first + TOGETHER].tolist()}
            for _ in range(MOST_STEPS):
                left = _stepped(equations, left, targets, q, residual, sure)
    return q, residual, sure


def _stepped(
    equations: PoseEquations, left: dict[int, Array], targets: Sequence[Array], q: Array, residual: Array, sure: Mask
) -> dict[int, Array]:
    """One Newton step of each pose that is left, of all together; puts those that were closed before it into q, and returns the others.
    A pose is dropped that is far open, or has other rows than the steps are made for."""
    steps, points = equations.newton_steps, list[Array]()
    numbers, off, rows = list[int](), np.empty((len(left), steps.count)), list[Array]()
    for k, x in left.items():
        gap, jacobian = equations.evaluate(x, [t[k] for t in targets])
        residual[k] = largest(gap)
        if len(gap) == steps.count and residual[k] < NEAR:
            off[len(numbers)] = gap
            numbers.append(k)
            points.append(x)
            rows.append(jacobian.copy())
    if not numbers:
        return {}
    moves = steps.step(steps.inverse(np.array(rows)), off[: len(numbers)])
    more = {k: equations.step(x, dv) for k, x, dv in zip(numbers, points, moves, strict=True) if np.isfinite(dv).all()}
    for k in [k for k in more if residual[k] < CLOSED]:
        q[k], sure[k] = equations.coordinates(more.pop(k)), True
    return more
