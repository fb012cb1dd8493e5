"""The three ways a solid is made here: extruding outlines, turning a profile, sweeping a section along a helix."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.shapes.polygon import circle
from mechlab.shapes.solid import Mesh, Shell

SEGMENTS = 48  # of a circle the eye rests on
SMALL = 24  # of a bore, a bolt hole, a thin rod


def require(condition: bool, message: str) -> None:
    """Raises MechlabError(message) unless the condition holds: how builders refuse sizes that make no solid."""
    if not condition:
        raise MechlabError(message)


def extrude(outer: ArrayLike, holes: Sequence[ArrayLike] = (), low: float = 0.0, high: float = 1.0) -> Mesh:
    """The prism over a counter-clockwise outline (n, 2), without its holes, from z = low to z = high [m]."""
    shell = Shell()
    bottom, top = shell.loop(outer, low), shell.loop(outer, high)
    shell.band(bottom, top)
    pairs = [(shell.loop(hole, low), shell.loop(hole, high)) for hole in holes]
    for lower, upper in pairs:
        shell.band(upper, lower)
    shell.cap(top, [upper for _, upper in pairs], up=True)
    shell.cap(bottom, [lower for lower, _ in pairs], up=False)
    return shell.mesh()


def revolve(profile: ArrayLike, segments: int = SEGMENTS) -> Mesh:
    """The solid that a profile of (radius, z) points sweeps about z; the profile runs upwards on the outside.

    A profile that starts and ends on the axis closes at poles; any other is closed from its last point to its first.
    """
    points = np.asarray(profile, dtype=float)
    shell = Shell()
    rings = [shell.loop([(0.0, 0.0)] if r == 0.0 else circle(r, segments), z) for r, z in points.tolist()]
    closed = points[0, 0] > 0.0
    for lower, upper in zip(rings, rings[1:] + rings[:1] if closed else rings[1:], strict=False):
        if len(lower) == 1:
            shell.fan(int(lower[0]), upper[::-1])
        elif len(upper) == 1:
            shell.fan(int(upper[0]), lower)
        else:
            shell.band(lower, upper)
    return shell.mesh()


def turned(radius: float, low: float, high: float, segments: int = SEGMENTS, chamfer: float = 0.0) -> Mesh:
    """A cylinder about z from `low` to `high`, its rims broken by `chamfer` [m]."""
    c = chamfer
    side = (
        [(radius, low), (radius, high)]
        if c <= 0.0
        else [(radius - c, low), (radius, low + c), (radius, high - c), (radius - c, high)]
    )
    return revolve([(0.0, low), *side, (0.0, high)], segments)


def hollow(outer: float, inner: float, low: float, high: float, segments: int = SEGMENTS) -> Mesh:
    """A tube about z from `low` to `high`."""
    require(inner < outer, f"tube: the inner radius {inner:g} m must be smaller than the outer radius {outer:g} m.")
    return revolve([(inner, low), (outer, low), (outer, high), (inner, high)], segments)


def arc(radius: float, z: float, start: float, stop: float, steps: int) -> list[tuple[float, float]]:
    """Profile points (radius cos t, z + radius sin t); a point at +-90 degrees lies exactly on the axis."""
    points = []
    for t in np.linspace(start, stop, steps + 1).tolist():
        on_axis = abs(abs(t) - 0.5 * math.pi) < 1e-12
        points.append((0.0 if on_axis else radius * math.cos(t), z + radius * math.sin(t)))
    return points


MOST_TURNS = 2000


def helix(section: ArrayLike, radius: float, low: float, pitch: float, turns: float, steps: int = 20) -> Mesh:
    """A right-handed helix of a closed section of (radial, axial) offsets, counter-clockwise, `steps` to the turn."""
    offsets = np.asarray(section, dtype=float)
    shell = Shell()
    require(turns <= MOST_TURNS, f"a helix of {turns:.3g} turns; at most {MOST_TURNS} are drawn.")
    count = max(2, round(turns * steps))
    rings: list[NDArray[np.int64]] = []
    for k in range(count + 1):
        t = 2.0 * math.pi * turns * k / count
        r, z = radius + offsets[:, 0], low + pitch * t / (2.0 * math.pi) + offsets[:, 1]
        rings.append(shell.loop(np.column_stack([r * math.cos(t), r * math.sin(t), z])))
    for here, there in zip(rings, rings[1:], strict=False):
        shell.band(there, here)
    n = len(offsets)
    fan = np.array([(0, i, i + 1) for i in range(1, n - 1)])
    shell.faces(rings[0][fan])
    shell.faces(rings[-1][fan][:, ::-1])
    return shell.mesh()
