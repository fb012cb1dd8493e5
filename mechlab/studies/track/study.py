"""A closed mechanism along the targets of a path: pose by pose, with a record of what was met and what stopped it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.mechanism.assembly import close
from mechlab.mechanism.geometry import Array, Placement
from mechlab.mechanism.given import si
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Frame
from mechlab.studies.track.closed import Closed, unit_near, usual_engine
from mechlab.studies.track.follow import Follower, Pose
from mechlab.studies.track.goals import CENTRE, CenterGoal, Goal
from mechlab.studies.track.limits import Bound, Limits, excess
from mechlab.studies.track.result import Track
from mechlab.studies.track.summary import DISTANCES, FoundPose, summary
from mechlab.studies.track.tasks import Limit, RangeLimit, RateLimit, SingularityLimit

APPROACH = 12
"""Steps from the start to the first targets."""
TRIES, NUDGE = 3, 0.05
"""Searches from nearby poses where a target is missed for the first time, and how far these are [rad, sizes]: a stretched
arm cannot tell on which side to bend."""


def track(
    m: Mechanism,
    goals: Callable[[float], Sequence[Goal]],
    t: Array,
    limits: Sequence[Limit] = (),
    start: Mapping[str, float] | None = None,
    *,
    engine: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    name: str = "",
    parameters: Mapping[str, Any] | None = None,
    versions: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> Track:
    """Lead the mechanism along the goals at the times t (n,).

    goals: from the unit of length [m] in which their samples shall be. start: values of joints or shafts of the pose from
    which the first targets are approached, the others follow by the loops; default the reference pose. engine: whose
    kinematics, "pinocchio" or "numpy". Raises NoSolution where the start does not close.
    """
    began = time.process_time()
    asked = tuple(goals(unit_near(m.size)))
    closed = Closed(_with_centres(m, asked), engine or usual_engine())
    kept = limits_of(m, limits, closed.unit)
    poses = _poses(closed, asked, t, kept, start_pose(m, start or {}) / closed.coordinate_units, progress)
    return summary(m, closed, asked, t, poses, time.process_time() - began, name, parameters, versions, notes)


def start_pose(m: Mechanism, start: Mapping[str, float]) -> Array:
    """(nq,) the closed pose with these values of joints or shafts. Raises NoSolution where there is none."""
    for name in start:
        m.row(name)
    found = close(m, None, dict(start), steps=10 if start else 1)
    if not found.closed:
        given = ", ".join(f"{n}_0={x:g}" for n, x in start.items()) or "the reference pose"
        raise NoSolution(f"{m.name}: the start does not close ({given}): {found.status.value}.")
    return found.q


def limits_of(m: Mechanism, limits: Sequence[Limit], unit: float) -> Limits:
    """The ranges of the joints and the given limits. Raises MechlabError for a limit that makes no sense."""
    ranges = {j.name: j.range for j in m.joints if j.range is not None and j.nv == 1}
    rates: dict[str, float] = {}
    distances: dict[str, float] = {}
    for limit in limits:
        if isinstance(limit, SingularityLimit):
            if limit.of not in ("closure", "drives", "targets"):
                raise unknown("SingularityLimit: of", limit.of, ("closure", "drives", "targets"))
            distances[limit.of] = si(limit.at_least, "SingularityLimit: at_least")
        elif isinstance(limit, RateLimit):
            rates |= {n: _positive(m, n, x) for n, x in _by_name("RateLimit: rates", limit.rates).items()}
        elif isinstance(limit, RangeLimit):
            ranges |= {n: _ends(m, n, x) for n, x in _by_name("RangeLimit: ranges", limit.ranges).items()}

    def scale(n: str) -> float:
        return unit if is_length(m, n) else 1.0

    return Limits(
        {n: (a / scale(n), b / scale(n)) for n, (a, b) in ranges.items()},
        {n: r / scale(n) for n, r in rates.items()},
        distances,
    )


def _by_name(what: str, given: Mapping[str, Any]) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        raise MechlabError(f"{what}: expected names of joints or shafts with their values, got {given!r}.")
    return given


def _positive(m: Mechanism, name: str, rate: Any) -> float:
    m.row(name)
    try:
        largest = float(rate)
    except (TypeError, ValueError):
        raise MechlabError(f"{m.name}: the largest rate of {name!r}: expected a number, got {rate!r}.") from None
    if not largest > 0:
        raise MechlabError(f"{m.name}: the largest rate of {name!r} must be positive, got {rate!r}.")
    return largest


def _ends(m: Mechanism, name: str, ends: Any) -> tuple[float, float]:
    m.row(name)
    try:
        low, high = (float(x) for x in ends)
    except (TypeError, ValueError):
        raise MechlabError(f"{m.name}: the range of {name!r}: expected two numbers (low, high), got {ends!r}.") from None
    if not low < high:
        raise MechlabError(f"{m.name}: the range of {name!r} must go from low to high, got {ends!r}.")
    return low, high


def _with_centres(m: Mechanism, goals: Sequence[Goal]) -> Mechanism:
    """The mechanism with a frame at the centre of mass of each body that a goal asks for."""
    asked = {body for g in goals if isinstance(g, CenterGoal) for body, _ in g.masses}
    frames = [Frame(CENTRE + b.name, b.name, Placement(b.inertia.com)) for b in m.bodies if b.name in asked]
    return replace(m, frames=m.frames + tuple(frames)) if frames else m


def _poses(
    closed: Closed,
    goals: tuple[Goal, ...],
    t: Array,
    limits: Limits,
    start: Array,
    progress: Callable[[int, int], None],
) -> list[FoundPose]:
    follower = Follower(closed, goals)
    q = start
    closed.set(q)
    begin, met, out = follower.values(), True, []
    for k in range(len(t)):
        end = [g.samples[k] for g in goals]
        closed.set(q)
        before = {n: closed.plant.value(n) for n in limits.rates} if k else {}
        bounds = limits.bounds(before, float(t[k] - t[k - 1]) if k else 0.0)
        if k:
            pose = follower.lead(q, begin, end, bounds)
        else:
            pose = _approach(follower, q, begin, end, bounds)
        found = _found(closed, goals, end, pose, bounds)
        if not _meets(goals, found) and met:
            found = _from_nearby(follower, q, end, bounds, found)
        out.append(found)
        q, begin, met = found.pose.q, end, _meets(goals, found)
        progress(k + 1, len(t))
    return out


def _approach(
    follower: Follower, q: Array, begin: Sequence[Array], end: Sequence[Array], bounds: tuple[Bound, ...]
) -> Pose:
    """From the start to the first targets in even steps, which keeps the assembly mode."""
    pose, last = Pose(q, (), 0, True), list(begin)
    for k in range(1, APPROACH + 1):
        here = [g.blend(a, b, k / APPROACH) for g, a, b in zip(follower.goals, begin, end, strict=True)]
        moved = follower.lead(pose.q, last, here, bounds)
        pose, last = replace(moved, steps=pose.steps + moved.steps), here
    return pose


def _from_nearby(
    follower: Follower, q: Array, end: Sequence[Array], bounds: tuple[Bound, ...], found: FoundPose
) -> FoundPose:
    """The best of a few more searches, from poses near q; `found` unless one of them comes a tenth nearer."""
    closed, rng = follower.closed, np.random.default_rng(0)
    for _ in range(TRIES):
        closed.set(q)
        basis = closed.basis
        start = closed.close(closed.moved(q, NUDGE * basis @ rng.standard_normal(basis.shape[1])))
        if not start.closed:
            continue
        closed.set(start.q)
        pose = follower.lead(start.q, follower.values(), end, bounds)
        trial = _found(closed, follower.goals, end, pose, bounds)
        if _required_error(follower.goals, trial) < 0.9 * _required_error(follower.goals, found):
            found = trial
    return found


def _found(
    closed: Closed, goals: Sequence[Goal], targets: Sequence[Array], pose: Pose, bounds: tuple[Bound, ...]
) -> FoundPose:
    closed.set(pose.q)
    errors = []
    for g, target in zip(goals, targets, strict=True):
        missing = float(np.linalg.norm(g.missing(g.value(closed.plant), target)))
        errors.append(missing * (closed.unit if g.unit == "m" else 1.0))
    return FoundPose(
        pose, tuple(errors), tuple(closed.distance(of) for of in DISTANCES), closed.gap, excess(closed, bounds)
    )


def _meets(goals: Sequence[Goal], found: FoundPose) -> bool:
    return _required_error(goals, found) <= 1.0


def _required_error(goals: Sequence[Goal], found: FoundPose) -> float:
    """Largest error of a required goal, in its tolerance."""
    return max((e / g.tolerance for g, e in zip(goals, found.errors, strict=True) if g.priority == 0), default=0.0)
