"""Findings on a run that every engine reports: closure, assembly mode, saturation, finite values, restarts, dry friction.

Dry friction that an engine smooths about standstill may hide a stick: below a small rate the smoothed friction is less than its
bound. A part that friction could hold then creeps by the integral of its rate, and that distance is the finding.

A loop that opens by more than a thousandth of the smallest link counts as torn open; the run stops there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.assembly_modes import UNWATCHED, mode_finding
from mechlab.experiment.laws import Law
from mechlab.experiment.recording import Finding, limit_finding
from mechlab.mechanism.constraints import ConstraintSet, LoopConstraint
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import FORCES, MOMENTS
from mechlab.mechanism.state_rows import state_rows
from mechlab.mechanism.structure import redundancies, shared_loads

GAP_LIMIT = 1e-4
SHARED = (
    "the rows of {} repeat each other: how they share a load hangs on elasticity and tolerances, of which rigid bodies know nothing; the "
    "smallest loads are given"
)
VOID = (
    "no motion of the joints would open {} in the direction of a part of its load: whether that part passes there or through the joints "
    "hangs on elasticity, and is the engine's choice"
)
VOID_SHARE = 1e-6
"""Share of the largest load of a loop beyond which a part of it is more than rounding."""
RESTART_JUMP = 0.5
"""Share of the largest distance from the reference so far: a step back of more than that may be a restart."""


def kinematic_findings(
    mechanism: Mechanism,
    q: Array,
    v: Array,
    held: Sequence[str] = (),
    limit: float = GAP_LIMIT,
    keep_mode: Sequence[str] = (),
) -> tuple[Finding, ...]:
    """Findings "finite", "loop_gap" [m], "loop_angle" [rad], "relation_residual" [rad or m] and "assembly_mode".

    q (n, nq), v (n, nv) along the run; states that are not finite are counted, and left out of the other findings.
    `held`: names of the driven joints or shafts, default those of the drives; they define the assembly mode
    (see `mode_signs`). A gap is an error above `limit` (for lengths times the mechanism's `length_scale`), a warning
    above a tenth of it. A change of the assembly mode is a warning; with respect to `keep_mode`, an error.
    """
    q, v = np.atleast_2d(q), np.atleast_2d(v)
    out = [finite_finding(q, v)]
    q = q[np.all(np.isfinite(q), axis=1)]
    if not len(q):
        return tuple(out)
    constraints = ConstraintSet(mechanism)
    states, rows = ManyStates(mechanism, q), state_rows(mechanism)
    residual = rows.residual(states)
    offset, angle, relation = row_kinds(mechanism, constraints)
    for name, kind, unit, what in (
        ("loop_gap", offset, "m", "the loops open by up to"),
        ("loop_angle", angle, "rad", "the loops tilt by up to"),
        ("relation_residual", relation, "rad or m", "the gears and relations slip by up to"),
    ):
        if kind:
            worst = _largest(residual[:, kind])
            bound = limit * (mechanism.length_scale if unit == "m" else 1.0)
            culprit = constraints.rows[kind[int(np.argmax(np.max(np.abs(residual[:, kind]), axis=0)))]]
            out.append(limit_finding(name, worst, bound, unit, f"{what} (at {culprit})", 0.1 * bound))
    if len(constraints):
        watched = keep_mode or held or [d.on for d in mechanism.drives]
        out.append(mode_finding(mechanism, rows.jacobian(states), watched, bool(keep_mode)) if watched else UNWATCHED)
    return tuple(out)


def saturation_finding(laws: Sequence[Law], forces: Mapping[str, Array]) -> Finding | None:
    """Finding "saturation": share of samples at which the force of a law is at its limit; None when no law has a limit.

    forces: joint or shaft -> (n,) force of all laws on it [N m or N]. A law at its limit is a warning: it cannot follow
    its command.
    """
    shares = {}
    for law in laws:
        bound = getattr(law, "limit", np.inf)
        on = str(getattr(law, "on", ""))
        if on in forces and np.isfinite(bound) and sum(on in other.targets() for other in laws) == 1:
            shares[on] = float(np.mean(np.abs(forces[on]) >= bound * (1 - 1e-12)))
    if not shares:
        return None
    name, worst = max(shares.items(), key=lambda item: item[1])
    if worst > 0:
        text = f"the force on {name} stands at its limit in {100 * worst:.3g} % of the samples"
        return Finding("saturation", worst, 0.0, "of the samples", "warning", text)
    return Finding("saturation", 0.0, 0.0, "of the samples", "ok", "no law reached its limit")


def finite_finding(q: Array, v: Array) -> Finding:
    """Finding "finite": the number of values that are not finite; any is an error."""
    bad = int(np.count_nonzero(~np.isfinite(q))) + int(np.count_nonzero(~np.isfinite(v)))
    severity = "error" if bad else "ok"
    text = f"{bad} values are not finite; do not trust this run" if bad else "all values are finite"
    return Finding("finite", float(bad), 0.0, "values", severity, text)


def restart_finding(mechanism: Mechanism, t: Array, q: Array, v: Array) -> Finding | None:
    """Finding "restart" (an error): the sample at which a run goes on from the reference pose, as an engine does that resets
    itself after a blow-up; None when there is no such sample. With d the largest distance from the
    reference so far, a step is such a jump when it is longer than RESTART_JUMP d and than twice the usual speed allows, when it
    ends within a tenth of d from the reference, and when the speed is lower after it than before."""
    home, columns = mechanism.reference(), mechanism.q_columns
    if len(t) < 3 or not len(columns) or not np.all(np.isfinite(q)):
        return None
    distance = np.max(np.abs(q - home)[:, columns], axis=1)
    step = np.diff(q[:, columns], axis=0)
    size = np.max(np.abs(step), axis=1)
    speed = np.max(np.abs(v), axis=1, initial=0.0)
    usual = np.diff(t) * float(np.median(speed))
    reach = np.maximum.accumulate(distance)[:-1]
    back = (size > RESTART_JUMP * reach) & (size > 2.0 * usual) & (distance[1:] < 0.1 * reach) & (reach > 1e-9)
    back &= speed[1:] < speed[:-1]
    if not np.any(back):
        return None
    k = int(np.argmax(back)) + 1
    text = (
        f"at t = {t[k]:.6g} s the state jumps back by {size[k - 1]:.3g} rad or m to the reference pose, faster than the run "
        "ever moves: the engine has restarted itself after a blow-up. Do not trust this run; switch autoreset off"
    )
    return Finding("restart", float(t[k]), float(t[-1]), "s", "error", text)


def shared_finding(mechanism: Mechanism, q: Array, channels: Mapping[str, Array]) -> Finding | None:
    """Finding "shared_loads" (a warning): the loads among the channels that rigid bodies leave undetermined, because the rows of their
    loops or relations repeat each other, or because it is open whether a load passes through a loop or through the joints; None where
    every recorded load is determined. q (n, nq)."""
    if not any(name.endswith(("_load", "_fx")) for name in channels):
        return None
    shared = [n for n in shared_loads(mechanism) if f"{n}_load" in channels or f"{n}_fx" in channels]
    void = [n for n in _void_loads(mechanism, q, channels) if n not in shared]
    parts = [text.format(", ".join(names)) for text, names in ((SHARED, shared), (VOID, void)) if names]
    if not parts:
        return None
    text = f"{'; '.join(parts)}; the errors beside them are those of this share"
    return Finding("shared_loads", float(len(shared) + len(void)), 0.0, "loads", "warning", text)


def _void_loads(mechanism: Mechanism, q: Array, channels: Mapping[str, Array]) -> list[str]:
    """Loops whose recorded load has a part along rows that no motion of the joints violates; a point on a point has none in any engine."""
    void = {r.row for r in redundancies(mechanism) if not r.combination}
    found = []
    for item in ConstraintSet(mechanism).items if void else ():
        idle = [row in void for row in item.rows]
        if not isinstance(item, LoopConstraint) or item.loop.kind == "spherical" or f"{item.name}_fx" not in channels or not any(idle):
            continue
        for k in (k for k in {0, len(q) // 2, len(q) - 1} if np.all(np.isfinite(q[k]))):
            load = np.array([channels[n][k] if (n := f"{item.name}_{x}") in channels else 0.0 for x in (*FORCES, *MOMENTS)])
            wrenches = item.wrenches(TreeKinematics(mechanism, q[k]))
            along = np.abs(np.linalg.lstsq(wrenches.T, load, rcond=None)[0])
            if np.max(along, where=idle, initial=0.0) > VOID_SHARE * np.max(along):
                found.append(item.name)
                break
    return found


def row_kinds(mechanism: Mechanism, constraints: ConstraintSet) -> tuple[list[int], list[int], list[int]]:
    """The rows of a closure that are lengths [m], sines of angles, and sums of relations and curves [rad or m]."""
    relations = {r.name for r in mechanism.couplings}
    offset: list[int] = []
    angle: list[int] = []
    relation: list[int] = []
    for item in constraints.items:
        rows = range(constraints.slices[item.name].start, constraints.slices[item.name].stop)
        for i in rows:
            if item.name in relations:
                relation.append(i)
            else:
                (angle if "_" in constraints.rows[i].removeprefix(item.name) else offset).append(i)
    return offset, angle, relation


def _largest(values: Array) -> float:
    """Largest absolute value; NaN anywhere counts as infinite."""
    return float(np.max(np.abs(values))) if np.all(np.isfinite(values)) else float("inf")


Flags = NDArray[np.bool_]

SMOOTHING_BAND = 3.0
"""Width of the tanh times this: beyond such a rate smoothed friction is within 0.5 % of its bound."""


def sticks(rates: Array, accelerations: Array, width: Array, able: Array) -> Flags:
    """(n, k) whether friction smoothed as able tanh(rate / width) hides a stick: the rate is in the band, and friction could hold
    the acceleration. able (k,): acceleration by the bound of friction; width (k,) [rad/s or m/s]."""
    free = accelerations + able * np.tanh(rates / width)
    return np.asarray((np.abs(rates) < SMOOTHING_BAND * width) & (np.abs(free) < able))


def creep_distance(t: Array, rates: Array, standing: Flags) -> Array:
    """(k,) distances [rad or m] crept between samples at which friction sticks: t (n,), rates (n, k), standing (n, k)."""
    both = standing[1:] & standing[:-1]
    mean = 0.5 * (np.abs(rates[1:]) + np.abs(rates[:-1]))
    return np.asarray(np.sum(np.where(both, mean, 0.0) * np.diff(t)[:, None], axis=0))


def friction_finding(
    names: Sequence[str], t: Array, rates: Array, standing: Flags, tolerance: float, how: str
) -> Finding | None:
    """Finding "friction": the largest distance crept, an error beyond the tolerance [rad or m] of the scene; None without dry
    friction. names (k,); `how` says what the engine does to it."""
    if not names:
        return None
    ways = creep_distance(t, rates, standing)
    k = int(np.argmax(ways))
    value, text = float(ways[k]), f"dry friction of {', '.join(dict.fromkeys(names))} {how}"
    if not value > 0.0:
        return Finding("friction", 0.0, tolerance, "rad or m", "ok", f"{text}; nothing stood still for long")
    text += f": {names[k]} stands where the load cannot break it away, and creeps by {value:.2g} rad or m"
    if value <= tolerance:
        return Finding("friction", value, tolerance, "rad or m", "warning", f"{text} (tolerance {tolerance:g})")
    text += f", beyond the tolerance {tolerance:g} of the scene; --engine hybrid follows it exactly, a smaller timestep more closely"
    return Finding("friction", value, tolerance, "rad or m", "error", text)


def stopped_finding(t: float, duration: float, reason: str) -> Finding:
    """Finding "blow_up" (an error): the time t [s] at which a run could not go on, and why."""
    text = f"the run stopped at t = {t:.6g} s of {duration:g} s: {reason}"
    return Finding("blow_up", t, duration, "s", "error", text)


OPEN_LOOP = 1e-3
"""A loop is torn open beyond this share of the smallest link."""
SAME_JOINT = 1e-3
"""Points of a body closer than this share of the longest link count as one joint, not as the ends of a link: the axes of a
cross that miss each other by a rounding of the drawing."""


def smallest_link(mechanism: Mechanism) -> float:
    """Shortest distance [m] between two joints of one moving body: its own, those of its children, its loops. Infinite for
    a mechanism without loops or with bodies of one joint only."""
    points: dict[str, list[Array]] = {b.name: [np.zeros(3)] for b in mechanism.bodies if b.joints}
    for body in mechanism.bodies:
        if body.parent in points and body.joints:
            points[body.parent].append(body.placement.translation)
    for loop in mechanism.loops:
        for name, place in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
            if name in points:
                points[name].append(place.translation)
    lengths = [float(np.linalg.norm(a - b)) for own in points.values() for i, a in enumerate(own) for b in own[i + 1 :]]
    least = SAME_JOINT * max(lengths, default=0.0)
    return min((x for x in lengths if x > least), default=float("inf"))


def open_loop_finding(t: float, gap: float, limit: float, duration: float, row: str) -> Finding:
    """Finding "loop_open" (an error): the time t [s] at which the run was stopped, the row that was open and its gap
    [m]."""
    text = (
        f"the loop {row} is torn open by {gap:.3g} m at t = {t:.6g} s of {duration:g} s, more than {OPEN_LOOP:g} of the smallest "
        f"link ({limit:.3g} m): the run was stopped. No assembly may exist where the drive goes; ask `solve` there, or take "
        "harder loops or a smaller timestep"
    )
    return Finding("loop_open", gap, limit, "m", "error", text)
