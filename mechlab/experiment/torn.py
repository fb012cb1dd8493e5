"""When a loop counts as torn: open by more than a thousandth of the smallest link. A run stops there."""

from __future__ import annotations

import numpy as np

from mechlab.experiment.health import Finding
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

TORN = 1e-3
"""Share of the smallest link."""
SHORTEST = 1e-6
"""Points of a body nearer than this [m] are one joint, not the ends of a link."""


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
    return min((x for x in lengths if x > SHORTEST), default=float("inf"))


def torn_finding(t: float, gap: float, limit: float, duration: float, row: str) -> Finding:
    """Finding "loop_open" (an error): when the run was stopped, how far which loop had opened."""
    text = (
        f"the loop {row} is torn open by {gap:.3g} m at t = {t:.6g} s of {duration:g} s, more than {TORN:g} of the smallest "
        f"link ({limit:.3g} m): the run was stopped. No assembly may exist where the drive goes; ask `solve` there, or take "
        "harder loops or a smaller timestep"
    )
    return Finding("loop_open", gap, limit, "m", "error", text)
