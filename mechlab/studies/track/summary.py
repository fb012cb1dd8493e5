"""What was found along a path as a Track: errors, limits that stopped the motion, findings, rates, remarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.recording import Cost, Finding, Health, Recording, basic_channels, limit_finding
from mechlab.experiment.scene import Settings
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import idle_freedoms
from mechlab.studies.track.closed import Closed
from mechlab.studies.track.follow import Pose
from mechlab.studies.track.goals import Goal
from mechlab.studies.track.limits import Bound
from mechlab.studies.track.result import ActiveLimit, Track, Tracked, miss_sentence, runs
from mechlab.tables import counted, number

GAP = 1e-12
"""Largest residual of loops and gears of a pose, in sizes of the mechanism and rad."""
KEPT = 1e-9
"""A limit holds to this [sizes, rad, 1]."""


@dataclass(frozen=True, eq=False)
class FoundPose:
    """A pose and what it has: errors of the goals (SI), distances from singularity, gap, how far it is beyond a limit."""

    pose: Pose
    errors: tuple[float, ...]
    distances: tuple[float, ...]
    gap: float
    excess: tuple[float, Bound | None]


DISTANCES = ("closure", "drives", "targets")


def summary(
    m: Mechanism, closed: Closed, goals: tuple[Goal, ...], t: Array, poses: list[FoundPose], cpu_s: float, name: str,
    parameters: Mapping[str, Any] | None, versions: Mapping[str, str] | None, notes: Sequence[str],
) -> Track:  # fmt: skip
    """The Track of the poses found at the times t (n,); goals in the unit of length of `closed`."""
    q = np.array([p.pose.q for p in poses])
    errors = np.array([p.errors for p in poses])
    tracked = tuple(
        Tracked(g.name, errors[:, i], g.unit, g.tolerance, g.priority, g.priority == 0) for i, g in enumerate(goals)
    )
    stopped = _active(poses, closed.unit, m)
    settled = np.array([p.pose.settled or p.pose.nothing_to_gain for p in poses])
    gap, alone = max(p.gap for p in poses), sum(x.required for x in tracked) == 1
    findings = [_target_finding(x, t, stopped, settled, alone) for x in tracked if x.required]
    findings.append(limit_finding("closure", gap, GAP, "of the size", "loops and gears are open by"))
    findings += _limit_findings(m, poses, t, closed.unit)
    v = _rates(closed, q, t) * closed.rate_units
    q = q * closed.coordinate_units
    channels, units = basic_channels(m, q, v)
    channels |= {f"{x.name}_error": x.error for x in tracked}
    units |= {f"{x.name}_error": x.unit for x in tracked}
    distances = {of: np.array([p.distances[i] for p in poses]) for i, of in enumerate(DISTANCES) if _has(closed, of)}
    channels |= {f"distance_{of}": x for of, x in distances.items()}
    units |= dict.fromkeys((f"distance_{of}" for of in distances), "")
    steps = sum(p.pose.steps for p in poses)
    recording = Recording(
        m, t, q, v, channels, units, Health(tuple(findings)), Cost(cpu_s, steps), Settings(engine="analytic"), scene="track",
        name=name or m.name, parameters=dict(parameters or {}), versions=dict(versions or {}),
        acts="the targets lead the mechanism; no forces",
    )  # fmt: skip
    return Track(
        name or m.name,
        recording,
        tracked,
        stopped,
        distances,
        gap,
        steps,
        cpu_s,
        ~settled,
        (*notes, *_remarks(m, closed)),
    )


def _limit_findings(m: Mechanism, poses: list[FoundPose], t: Array, unit: float) -> list[Finding]:
    """The limit that is broken most, where one is: a start beyond it that no step could bring back."""
    k = int(np.argmax([p.excess[0] for p in poses]))
    by, bound = poses[k].excess
    if bound is None or by <= KEPT:
        return []
    length = bound.kind != "singularity" and is_length(m, bound.of)
    what = (
        f"the distance from singularity ({bound.of})"
        if bound.kind == "singularity"
        else f"{bound.of}, its {bound.kind},"
    )
    value, dimension = by * (unit if length else 1.0), "" if bound.kind == "singularity" else " m" if length else " rad"
    text = f"{what} is beyond its limit by {number(value)}{dimension} at {t[k]:g} s"
    return [Finding("limits", value, KEPT, dimension.strip(), "error", text)]


def _has(closed: Closed, of: str) -> bool:
    return bool({"closure": len(closed.rows), "drives": len(closed.m.drives), "targets": closed.target_rank}[of])


def _target_finding(
    x: Tracked, t: Array, limits: tuple[ActiveLimit, ...], settled: NDArray[np.bool_], alone: bool
) -> Finding:
    if not np.any(x.missed):
        text = f"{x.name} is met within {number(x.tolerance)} {x.unit}: largest error {number(x.largest)} {x.unit}"
        return Finding(f"target_{x.name}", x.largest, x.tolerance, x.unit, "ok", text)
    return Finding(
        f"target_{x.name}", x.largest, x.tolerance, x.unit, "error", miss_sentence(x, t, limits, settled, alone)
    )


def _active(poses: list[FoundPose], unit: float, m: Mechanism) -> tuple[ActiveLimit, ...]:
    """The limits that stopped the motion, each run of samples once."""
    masks: dict[tuple[str, str, bool], NDArray[np.bool_]] = {}
    ends: dict[tuple[str, str, bool], float] = {}
    for k, p in enumerate(poses):
        for bound, upper in p.pose.pressing:
            key = (bound.kind, bound.of, upper)
            masks.setdefault(key, np.zeros(len(poses), dtype=bool))[k] = True
            ends[key] = bound.high if upper else bound.low
    out = []
    for (kind, of, upper), mask in masks.items():
        sentence = _limit_sentence(m, kind, of, upper, ends[kind, of, upper], unit)
        out += [ActiveLimit(sentence, kind, of, a, b) for a, b in runs(mask)]
    return tuple(sorted(out, key=lambda x: x.first))


def _limit_sentence(m: Mechanism, kind: str, of: str, upper: bool, end: float, unit: float) -> str:
    if kind == "singularity":
        return f"the distance from singularity ({of}) at its least, {number(end)}"
    if kind == "rate":
        return f"{of} at its largest rate"
    length = is_length(m, of)
    return f"{of} at its {'upper' if upper else 'lower'} end {number(end * (unit if length else 1.0), 6)} {'m' if length else 'rad'}"


def _rates(closed: Closed, q: Array, t: Array) -> Array:
    """(n, nv) slopes of the parabolas through neighbouring poses, put on the motions that loops and relations allow."""
    n = len(t)
    out = np.zeros((n, closed.m.nv))
    for k in range(n if n > 1 else 0):
        first = min(max(k - 1, 0), max(n - 3, 0))
        others = [i for i in range(first, min(first + 3, n)) if i != k]
        basis = closed.set(q[k]).basis
        out[k] = basis @ (basis.T @ _slope(t[others] - t[k], [closed.between(q[k], q[i]) for i in others]))
    return out


def _slope(dt: Array, moved: list[Array]) -> Array:
    """Slope at 0 of the parabola through displacements at one or two other times; of the line for one."""
    if len(moved) == 1:
        return np.asarray(moved[0] / dt[0])
    a, b = dt
    return np.asarray((moved[0] * b**2 - moved[1] * a**2) / (a * b * (b - a)))


def _remarks(m: Mechanism, closed: Closed) -> tuple[str, ...]:
    if not m.drives:
        return ("it has no drives: the joints move as listed; what moves them is left open",)
    left = closed.undriven - len(idle_freedoms(m))
    if left > 0:
        return (f"with all drives held {counted(left, 'freedom')} is left: the drives alone do not make this motion",)
    return ()
