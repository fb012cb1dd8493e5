"""A sweep for each drive, which the page moves by hand; and the forces on the parts while one drive turns steadily."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from mechlab.errors import EngineMissing, MechlabError
from mechlab.mechanism import Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.viewer.explore.continuation import END, FOLD, MEET, Closing, Lane, follow_lanes
from mechlab.viewer.explore.curve import Curve, arcs, curve, uncrossed
from mechlab.viewer.explore.sweep import Exploration, Load, Sweep, blend_error

FASTEST = 40.0
"""Rates of a joint per rate of the drive beyond which no forces are drawn: at a fold they have no bound."""
NOTHING = 1e-9  # [N, N m] a load that never exceeds this is left out
NEAREST = 0.01
"""Closeness to a singularity below which no forces are drawn."""


def cycle_loads(mechanism: Mechanism, sweep: Sweep, rate: float) -> tuple[Load, ...]:
    """Reactions of joints and loops, weights and the drive along a sweep at the constant `rate` [rad/s or m/s] of its
    drive, by Pinocchio; those that stay zero are left out. Empty unless the mechanism has exactly one freedom, a mass,
    and Pinocchio is installed."""
    m = mechanism
    if structure(m).freedoms != 1 or m.total_mass <= 0.0:
        return ()
    from mechlab.studies.cycle.quantities import reactions

    fine = np.flatnonzero(
        np.all(np.isfinite(sweep.rates), axis=1)
        & (np.abs(sweep.rates).max(axis=1) < FASTEST)
        & (sweep.closeness > NEAREST)
    )
    if len(fine) < 2:
        return ()
    try:
        found = reactions(m, sweep.name, 0.0, sweep.q[fine], rate * sweep.rates[fine], np.zeros(m.nv))
    except EngineMissing:
        return ()
    tree = TreeKinematics(m)
    points = {name: np.full((len(sweep.q), 3), np.nan) for name in (*found.forces, *(b.name for b in m.bodies), "")}
    axes = np.full((len(sweep.q), 3), np.nan)
    joints = {j.name: (b, m.v_slice[j.name].start) for b in m.bodies for j in b.joints}
    for k in fine:
        tree.set(sweep.q[k])
        for body in m.bodies:
            points[body.name][k] = (tree.matrix(body.name) @ np.append(body.inertia.com, 1.0))[:3]
        for loop in m.loops:
            points[loop.name][k] = (tree.matrix(loop.body_b) @ np.append(loop.placement_b.translation, 1.0))[:3]
        for name, (_, column) in joints.items():
            points[name][k] = tree.anchors[column]
            if name == sweep.name:
                axes[k], points[""][k] = tree.axes[column], tree.anchors[column]

    def spread(values: Array) -> Array:
        out = np.full((len(sweep.q), 3), np.nan)
        out[fine] = values
        return out

    loads = [
        Load(x.name, "force", "N", x.body_b, x.body_a, points[x.name], spread(found.forces[x.name][:, :3]))
        for x in m.loops
    ]
    for name, (body, _) in joints.items():
        if name == body.joints[-1].name:
            force = spread(found.forces[name][:, :3])
            loads.append(Load(name, "force", "N", body.name, body.parent, points[name], force))
    gravity = np.array(m.gravity)
    for body in m.bodies:
        weight = np.tile(body.inertia.mass * gravity, (len(fine), 1))
        loads.append(Load(f"weight of {body.name}", "force", "N", body.name, "", points[body.name], spread(weight)))
    if sweep.name in joints:
        body = joints[sweep.name][0]
        kind, unit = ("force", "N") if sweep.unit == "m" else ("torque", "N m")
        driving = axes * spread(np.repeat(found.drive[:, None], 3, axis=1))
        loads.append(Load(f"{sweep.name} (drive)", kind, unit, body.name, body.parent, points[""], driving))
    return tuple(x for x in loads if float(np.nanmax(np.abs(x.vectors))) > NOTHING)


MOST_SWEEPS = 8
TOLERANCE = 1e-7
"""Largest error of the blend, in sizes of the mechanism (and in radians)."""
FEWEST, MOST = 17, 2049  # samples of a sweep
MARGIN = 0.06  # share of the range by which a slider goes on beyond a fold or a crossing

Poses = Callable[[Array], Array]


def explore(
    mechanism: Mechanism, names: tuple[str, ...], poses_of: Poses, size: float, rates: Mapping[str, float] | None = None
) -> Exploration:
    """Sweeps of every drive (without drives: of the independent joints) of a mechanism about its reference pose.

    names: bodies as drawn; poses_of(q (n, nq)) -> (n, len(names), 4, 4); rates: of the drives, at which their forces are
    computed (default 1). Raises MechlabError when nothing can be moved.
    """
    free = structure(mechanism).independent
    drives = tuple(n for n in dict.fromkeys(d.on for d in mechanism.drives) if n in free)
    drives = drives or tuple(n for n in free if n in mechanism.scalar_names)
    if not drives:
        raise MechlabError(f"{mechanism.name}: it has no drive, joint or shaft that could be moved in the page.")
    closing = Closing(mechanism, drives, size)
    lanes = [_lane(closing, k, way, size) for k in range(min(len(drives), MOST_SWEEPS)) for way in (-1.0, 1.0)]
    follow_lanes(closing, lanes)
    sweeps = [_sweep(closing, lanes[k], lanes[k + 1], poses_of, size) for k in range(0, len(lanes), 2)]
    for k, sweep in enumerate(sweeps):
        rate = abs((rates or {}).get(sweep.name, 0.0)) or 1.0
        sweeps[k] = replace(sweep, loads=cycle_loads(mechanism, sweep, rate), rate=rate)
    return Exploration(tuple(sweeps), size, "that of the reference pose", mechanism.loops, names)


def _joint_range(closing: Closing, drive: int) -> tuple[bool, tuple[float, float] | None]:
    """Whether the drive is a slide, and its limits [rad or m] or None."""
    name = closing.drives[drive]
    joint = next((j for j in closing.mechanism.joints if j.name == name), None)
    return joint is not None and joint.kind == "prismatic", None if joint is None else joint.range


def _lane(closing: Closing, drive: int, way: float, size: float) -> Lane:
    slides, limits = _joint_range(closing, drive)
    last = float(closing.home_values[drive]) + way * (0.5 * size if slides else math.pi)
    if limits is not None:
        last = max(last, limits[0]) if way < 0 else min(last, limits[1])
    return Lane(drive, way, last, [closing.home], [])


def _sweep(closing: Closing, back: Lane, forth: Lane, poses_of: Poses, size: float) -> Sweep:
    m, name = closing.mechanism, closing.drives[forth.drive]
    slides, limits = _joint_range(closing, forth.drive)
    if len(back.q) + len(forth.q) < 4:
        raise MechlabError(f"{m.name}: {name} cannot be moved from the reference pose; the other drives hold it there.")
    path, *cut = uncrossed(curve(closing, back, forth))
    ends = [MEET if crossed else lane.ended for crossed, lane in zip(cut, (back, forth), strict=True)]
    found, error = _refined(path, poses_of, size)
    values = closing.values(found.q)[:, forth.drive]
    along = found.tangent @ closing.drive_rows[forth.drive]
    rates = found.tangent / np.where(np.abs(along) > 1e-9, along, np.nan)[:, None]
    distances = closing.distances(found.q)
    margin = MARGIN * float(values[-1] - values[0])
    reasons = []
    for ended, word in zip(ends, ("lower", "higher"), strict=True):
        edge = f"the end of the range of {name}" if limits else f"the end of the slider: {name} goes on"
        fold = f"no assembly exists with {name} {word}: the mechanism is stretched or folded there"
        meet = f"assembly modes meet where {name} is {word}: the way on cannot be told"
        reasons.append({END: edge, FOLD: fold}.get(ended, meet))
    return Sweep(
        name, "m" if slides else "rad", found.arc, values, found.q, rates, poses_of(found.q),
        distances / max(float(distances.max()), 1e-300),
        float(values[0]) - margin * (ends[0] != END), float(values[-1]) + margin * (ends[1] != END),
        reasons[0], reasons[1], float(closing.home_values[forth.drive]), error,
    )  # fmt: skip


def _refined(path: Curve, poses_of: Poses, size: float) -> tuple[Curve, float]:
    """Samples of a curve, doubled until the blend agrees with the poses between them; and the remaining error."""
    closing, count = path.closing, FEWEST
    total = float(path.arc[-1])
    coarse = path.sample(np.linspace(0.0, total, count))
    poses = poses_of(coarse.q)
    while True:
        between = path.sample((np.arange(count - 1) + 0.5) * total / (count - 1))
        if len(coarse.q) != count or len(between.q) != count - 1:
            raise MechlabError(
                f"{closing.mechanism.name}: its poses along {closing.drives[path.drive]} could not be closed everywhere."
            )
        middle = poses_of(between.q)
        order = np.argsort(np.concatenate([np.arange(count), np.arange(count - 1) + 0.5]))
        q, tangent, both = (np.concatenate(x)[order] for x in (
            (coarse.q, between.q), (coarse.tangent, between.tangent), (poses, middle)
        ))  # fmt: skip
        arc = arcs(closing, q, tangent)
        error = blend_error(arc[0::2], poses, arc[1::2], middle, size)
        if error < TOLERANCE or 2 * count - 1 > MOST:
            return Curve(closing, path.drive, coarse.q, coarse.tangent, arc[0::2]), error
        count = 2 * count - 1
        coarse, poses = Curve(closing, path.drive, q, tangent, arc), both
