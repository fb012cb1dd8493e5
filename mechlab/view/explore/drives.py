"""Moving the drives of a mechanism by hand in the page: a sweep for each of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism import Mechanism, structure
from mechlab.mechanism.geometry import Array
from mechlab.view.explore.closing import Closing
from mechlab.view.explore.curve import Curve, arcs, curve, uncrossed
from mechlab.view.explore.loads import cycle_loads
from mechlab.view.explore.march import END, FOLD, MEET, Lane, march
from mechlab.view.explore.sweep import Exploration, Sweep, blend_error

MOST_SWEEPS = 8
TOLERANCE = 1e-7
"""Largest error of the blend, in sizes of the mechanism (and in radians)."""
FEWEST, MOST = 17, 2049
MARGIN = 0.06

Poses = Callable[[Array], Array]


def explore(
    mechanism: Mechanism,
    names: tuple[str, ...],
    poses_of: Poses,
    size: float,
    rates: Mapping[str, float] | None = None,
) -> Exploration:
    """Sweeps of every drive (without drives: of the independent joints) of a mechanism about its reference pose.

    names: bodies as drawn; poses_of(q (n, nq)) -> (n, len(names), 4, 4); rates: of the drives, at which their forces are
    told (default 1). Raises MechlabError when nothing can be moved.
    """
    free = structure(mechanism).independent
    drives = tuple(n for n in dict.fromkeys(d.on for d in mechanism.drives) if n in free)
    drives = drives or tuple(n for n in free if n in mechanism.scalar_names)
    if not drives:
        raise MechlabError(f"{mechanism.name}: it has no drive, joint or shaft that could be moved in the page.")
    closing = Closing(mechanism, drives, size)
    lanes = [_lane(closing, k, way, size) for k in range(min(len(drives), MOST_SWEEPS)) for way in (-1.0, 1.0)]
    march(closing, lanes)
    sweeps = [_sweep(closing, lanes[k], lanes[k + 1], poses_of, size) for k in range(0, len(lanes), 2)]
    for k, sweep in enumerate(sweeps):
        rate = abs((rates or {}).get(sweep.name, 0.0)) or 1.0
        sweeps[k] = replace(sweep, loads=cycle_loads(mechanism, sweep, rate), rate=rate)
    return Exploration(tuple(sweeps), size, "that of the reference pose", mechanism.loops, names)


def _joint_range(closing: Closing, drive: int) -> tuple[bool, tuple[float, float] | None]:
    """Is it a slide, and its limits."""
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
    """Samples of a curve, doubled until the blend meets the poses between them; and the error that is left."""
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
