"""What a user asks for as goals: keys and tasks are read, checked and sampled at the times of the path."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.kit.quantities import quantities
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.model import Mechanism
from mechlab.studies.track.goals import CenterGoal, Goal, PositionGoal, RotationGoal, ValueGoal
from mechlab.studies.track.tasks import CenterOfMassTask, FrameTask, PostureTask, Target, Task

COUNT = 51
"""Times of a path whose targets are functions or constants, where no times are given."""
TOLERANCE = 1e-9
"""Largest error that counts as met: of the size of the mechanism, and in rad."""


@dataclass(frozen=True, eq=False)
class Wanted:
    """One target before it is sampled: the kind of its goal and the arguments of that, and the target."""

    name: str
    kind: type[Goal]
    of: tuple[Any, ...]
    target: Any
    task: Task
    length: bool

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of a position that count; empty for what is none."""
        return self.of[1] if self.kind is PositionGoal else self.of[0] if self.kind is CenterGoal else ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one sample as it is given: a number for one coordinate, else (k,) for the axes that count; (3, 3) of a rotation."""
        if self.kind is RotationGoal:
            return (3, 3)
        return (len(self.axes),) if len(self.axes) > 1 else ()


def tasks_of_keys(
    m: Mechanism, values: Mapping[str, Target], wishes: Sequence[str]
) -> tuple[list[Task], dict[str, Target]]:
    """Tasks from keys: a frame, FRAME_x, _y, _z, FRAME_rotation, a joint or shaft; and the start values, keys X_0, by X.

    Keys in `wishes` get the priority 1. Raises MechlabError, listing what exists, for another key.
    """
    frames = {f.name for f in m.frames}
    tasks: list[Task] = []
    start: dict[str, Target] = {}
    for key, target in values.items():
        priority = 1 if key in wishes else 0
        frame, _, part = key.rpartition("_")
        if key in m.scalar_names:
            tasks.append(PostureTask({key: target}, priority))
        elif key in frames:
            tasks.append(FrameTask(key, target, priority=priority))
        elif frame in frames and part in ("x", "y", "z"):
            tasks.append(FrameTask(frame, target, part, priority=priority))
        elif frame in frames and part == "rotation":
            tasks.append(FrameTask(frame, target, part="rotation", priority=priority))
        elif key.endswith("_0") and key.removesuffix("_0") in m.scalar_names:
            start[key.removesuffix("_0")] = target
        else:
            targets = [*(q for q in quantities(m) if not q.endswith(("_rate", "_accel", "_wx", "_wy", "_wz"))), *frames]
            raise unknown(f"{m.name}: the target", key, {*targets, *(f"{n}_0" for n in m.scalar_names)})
    if strange := [w for w in wishes if w not in values]:
        raise unknown(f"{m.name}: wishes: the target", strange[0], values)
    return tasks, start


def wanted_of(m: Mechanism, tasks: Sequence[Task]) -> list[Wanted]:
    """The targets of all tasks. Raises MechlabError for a task that asks for what does not exist, or for no targets at all."""
    out = [w for task in tasks for w in _wanted(m, task)]
    if not out:
        raise MechlabError(
            f"{m.name}: no target is given. Give frames, their coordinates, joints or shafts along a path: "
            + ", ".join([*(f.name for f in m.frames), *m.scalar_names]) + "."
        )  # fmt: skip
    return out


def _wanted(m: Mechanism, task: Task) -> list[Wanted]:
    if isinstance(task, PostureTask):
        for name in task.targets:
            m.row(name)
        return [Wanted(n, ValueGoal, (n,), x, task, is_length(m, n)) for n, x in task.targets.items()]
    if not isinstance(task, FrameTask | CenterOfMassTask):
        raise MechlabError(f"tasks: expected tasks and limits such as FrameTask or RateLimit, got {task!r}.")
    axes = tuple("xyz".find(a) for a in task.axes)
    if not axes or min(axes) < 0 or len(set(axes)) < len(axes):
        raise MechlabError(f"axes: expected some of x, y, z, each once, got {task.axes!r}.")
    if isinstance(task, CenterOfMassTask):
        masses = tuple((b.name, b.inertia.mass) for b in m.bodies if b.inertia.mass > 0)
        if not masses:
            raise MechlabError(f"{m.name}: no body has a mass; a centre of mass needs one.")
        return [Wanted("center_of_mass", CenterGoal, (axes, masses), task.target, task, True)]
    m.frame(task.frame)
    name = task.frame if len(axes) == 3 or task.part else f"{task.frame}_{task.axes}"
    turn = Wanted(f"{task.frame}_rotation", RotationGoal, (task.frame,), task.target, task, False)
    if task.part == "rotation":
        return [turn]
    place = Wanted(name, PositionGoal, (task.frame, axes), task.target, task, True)
    first = task.target(0.0) if callable(task.target) else task.target
    return [place, turn] if _array(name, first).shape[-2:] == (4, 4) else [place]


def times_of(m: Mechanism, wanted: Sequence[Wanted], times: object, duration: float) -> Array:
    """(n,) times [s]: as given; else even over `duration`, as many as the targets have values.

    Raises MechlabError for times that do not increase, and for targets with unlike numbers of values.
    """
    counts = {w.name: len(a) for w in wanted if (a := _along(w)) is not None}
    if times is not None:
        t = _array("times", times)
        if t.ndim != 1 or len(t) < 1 or np.any(np.diff(t) <= 0):
            raise MechlabError(f"times: expected increasing times (n,), got shape {t.shape}.")
    elif not duration > 0 or not math.isfinite(duration):
        raise MechlabError(f"duration: expected a positive time [s], got {duration:g}.")
    else:
        t = np.linspace(0.0, duration, max(counts.values(), default=COUNT))
    if wrong := {n: c for n, c in counts.items() if c != len(t)}:
        listing = ", ".join(f"{n} has {c}" for n, c in counts.items())
        whose = "the times are" if times is not None else "the longest target has"
        raise MechlabError(
            f"{m.name}: every target needs as many values as {whose} ({len(t)}), or one; {listing or wrong}."
        )
    return t


def _along(w: Wanted) -> Array | None:
    """The values of a target along the path; None for a constant or a function."""
    if callable(w.target):
        return None
    a = _array(w.name, w.target)
    one = 2 if a.shape[-2:] == (4, 4) and len(w.shape) else len(w.shape)
    return a if a.ndim > one else None


def goals_of(m: Mechanism, wanted: Sequence[Wanted], t: Array, tolerance: float | None, unit: float) -> list[Goal]:
    """The goals of all targets at the times t (n,), lengths in `unit` [m]. Raises MechlabError for a target of another shape."""
    size = m.size if m.size > 0 else 1.0
    out = []
    for w in wanted:
        task, samples = w.task, _samples(w, t)
        given = task.tolerance if task.tolerance is not None else tolerance
        usual = TOLERANCE * (size if w.length else 1.0)
        if not (isinstance(task.priority, int) and task.priority >= 0):
            raise MechlabError(f"{w.name}: priority: expected a whole number from 0, got {task.priority!r}.")
        if not (task.weight > 0 and math.isfinite(task.weight)):
            raise MechlabError(f"{w.name}: weight: expected a positive number, got {task.weight!r}.")
        if given is not None and not given > 0:
            raise MechlabError(f"{w.name}: tolerance: expected a positive number, got {given!r}.")
        goal = (w.name, samples / (unit if w.length else 1.0), task.priority, float(task.weight))
        out.append(w.kind(*goal, usual if given is None else given, "m" if w.length else "rad", *w.of))
    return out


def _samples(w: Wanted, t: Array) -> Array:
    """(n, ...) the target at the times."""
    raw = _array(w.name, [_array(w.name, w.target(x)) for x in t.tolist()] if callable(w.target) else w.target)
    n = len(t)
    if raw.shape[-2:] == (4, 4) and w.shape:
        raw = raw[..., :3, :3] if w.kind is RotationGoal else raw[..., :3, 3]
    axes, shape = w.axes, w.shape
    if axes and raw.shape[-1:] == (3,) and raw.ndim > (not shape):
        raw = raw[..., list(axes)] if shape else raw[..., axes[0]]
    if raw.shape not in (shape, (n, *shape)):
        words = "(n,)" if not shape else f"{shape} or (n, {', '.join(map(str, shape))})"
        more = " or poses (4, 4), (n, 4, 4)" if w.kind is PositionGoal else ""
        raise MechlabError(f"{w.name}: expected a target of shape {words}{more} with n = {n} times, got {raw.shape}.")
    out = np.broadcast_to(raw, (n, *shape)).copy()
    if w.kind is RotationGoal:
        _refuse_no_rotation(w.name, out)
    return out[:, None] if axes and not shape else out


def _refuse_no_rotation(name: str, rotations: Array) -> None:
    gap = float(np.max(np.abs(rotations @ np.swapaxes(rotations, -1, -2) - np.eye(3))))
    if not (gap < 1e-6 and np.all(np.linalg.det(rotations) > 0)):
        raise MechlabError(f"{name}: expected rotation matrices (orthonormal, determinant 1); one is off by {gap:.3g}.")


def _array(name: str, value: object) -> Array:
    """Finite numbers as an array; raises MechlabError that names the target."""
    if hasattr(value, "points"):  # a Range
        value = value.points(COUNT)
    try:
        out = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise MechlabError(f"{name}: expected numbers in an array, got {' '.join(repr(value).split())[:80]}.") from None
    if not np.all(np.isfinite(out)):
        raise MechlabError(f"{name}: expected finite numbers.")
    return out
