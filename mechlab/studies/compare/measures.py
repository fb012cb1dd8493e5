"""What the comparisons measure: strips around paths, stretches that are straight, lengths of bars, periodic curves."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import GROUND
from mechlab.mechanism.tree import reference_poses

EXACT = 1e-9
"""Paths that leave a line by less than this part of their length are exactly straight: rounding of the solved poses."""


def strip(points: Array) -> tuple[float, float]:
    """Width and length [m] of the narrowest strip around (n, 3) points, in the plane in which they extend most.

    The narrowest strip has one side along an edge of the convex hull (Houle and Toussaint 1988). Points within EXACT of a line have
    width 0.
    """
    from scipy.spatial import ConvexHull

    centered = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centered, full_matrices=False)
    flat = centered @ axes[:2].T
    length = float(np.ptp(flat[:, 0]))
    if length == 0.0 or float(np.linalg.norm(centered @ axes[1:].T, axis=1).max()) <= EXACT * length:
        return 0.0, length
    corners = flat[ConvexHull(flat).vertices]
    edge = np.roll(corners, -1, axis=0) - corners
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    widths = np.ptp(corners @ np.column_stack([-edge[:, 1], edge[:, 0]]).T, axis=0)
    along = edge[int(widths.argmin())]
    return float(widths.min()), float(np.ptp(flat @ along))


def stretches(points: Array) -> tuple[Array, Array]:
    """Widths and lengths (n, n) of the strips around all stretches from point i to point j > i; NaN elsewhere."""
    n = len(points)
    width, length = np.full((n, n), np.nan), np.full((n, n), np.nan)
    for i in range(n - 2):
        for j in range(i + 2, n):
            width[i, j], length[i, j] = strip(points[i : j + 1])
    return width, length


def longest(width: Array, length: Array, share: float) -> tuple[int, int] | None:
    """The longest stretch (i, j) whose strip is no wider than `share` of its length; None where there is none."""
    fits = np.where(width <= share * length, length, -1.0)
    best = int(np.argmax(fits))
    i, j = divmod(best, len(width))
    return (i, j) if fits[i, j] > 0.0 else None


def bars(m: Mechanism, points: dict[str, Array]) -> list[float]:
    """Lengths [m] of the bars of a planar mechanism, the ground among them: the largest distance of the pins of each body, seen along
    the axes. points: place (3,) of a further pin on a body. Empty for other mechanisms and where gears share the work. Blocks that
    slide have no length."""
    if m.relations or not m.joints:
        return []
    poses = reference_poses(m.bodies)
    pins: dict[str, list[Array]] = {}
    axis = None
    for body in m.bodies:
        for joint in body.joints:
            if joint.kind == "revolute":
                turned = poses[body.name][0] @ np.array(joint.axis)
                if axis is not None and np.linalg.norm(np.cross(axis, turned)) > 1e-9:
                    return []
                axis = turned
                for owner in (body.parent, body.name):
                    pins.setdefault(owner, []).append(poses[body.name][1])
    if axis is None:
        return []
    for loop in m.loops:
        for owner, place in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
            rotation, origin = poses.get(owner, (np.eye(3), np.zeros(3))) if owner != GROUND else (np.eye(3), np.zeros(3))
            pins.setdefault(owner, []).append(rotation @ np.asarray(place.translation) + origin)
    for owner, pin in points.items():
        pins.setdefault(owner, []).append(pin)
    out = []
    for places in pins.values():
        flat = np.array(places)
        flat = flat - np.outer(flat @ axis, axis)
        size = max(float(np.linalg.norm(a - b)) for a in flat for b in flat)
        out.append(size)
    return [x for x in out if x > 1e-6 * max(out)]
