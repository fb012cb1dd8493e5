"""Dry friction that an engine smooths about standstill: does it hide a stick?

Below a small rate smoothed friction is less than its bound. What is there and would not be accelerated by more than its friction
can hold stands in truth; here it creeps, by the integral of its rate.

When a loop counts as torn: open by more than a thousandth of the smallest link. A run stops there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.recording import Finding
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

Flags = NDArray[np.bool_]

BAND = 3.0
"""Widths of a tanh beyond which smoothed friction has all but its bound (.5 % less)."""


def stands(rates: Array, accelerations: Array, width: Array, able: Array) -> Flags:
    """(n, k) whether friction smoothed as able tanh(rate / width) hides a stick: the rate is in the band, and the acceleration
    without friction is less than what friction is able to (width, able: (k,))."""
    free = accelerations + able * np.tanh(rates / width)
    return np.asarray((np.abs(rates) < BAND * width) & (np.abs(free) < able))


def crept(t: Array, rates: Array, standing: Flags) -> Array:
    """(k,) ways [rad or m] made between samples at which something stands: t (n,), rates (n, k), standing (n, k)."""
    both = standing[1:] & standing[:-1]
    mean = 0.5 * (np.abs(rates[1:]) + np.abs(rates[:-1]))
    return np.asarray(np.sum(np.where(both, mean, 0.0) * np.diff(t)[:, None], axis=0))


def friction_finding(
    names: Sequence[str], t: Array, rates: Array, standing: Flags, tolerance: float, how: str
) -> Finding | None:
    """Finding "friction": the largest way crept, an error beyond the tolerance [rad or m] of the scene; None without dry
    friction. names (k,); `how` says what the engine does to it."""
    if not names:
        return None
    ways = crept(t, rates, standing)
    k = int(np.argmax(ways))
    value, text = float(ways[k]), f"dry friction of {', '.join(dict.fromkeys(names))} {how}"
    if not value > 0.0:
        return Finding("friction", 0.0, tolerance, "rad or m", "ok", f"{text}; nothing stood still for long")
    text += f": {names[k]} stands where the load cannot break it away, and creeps by {value:.2g} rad or m"
    if value <= tolerance:
        return Finding("friction", value, tolerance, "rad or m", "warning", f"{text} (tolerance {tolerance:g})")
    text += f", beyond the tolerance {tolerance:g} of the scene; --engine hybrid follows it exactly, a smaller timestep more closely"
    return Finding("friction", value, tolerance, "rad or m", "error", text)


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
