"""From where a planar mechanism is seen face on."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.tree import reference_poses
from mechlab.viewer.framing import THREE_QUARTER, Framing
from mechlab.viewer.story import Story

PARALLEL = 1e-6
"""Largest sine of the angle between axes that count as parallel."""


def plane_normal(mechanism: Mechanism) -> Array | None:
    """Unit normal (3,) of the plane in which every body moves, on the side of the three-quarter view: the common direction of all
    axes of turning, where every slide runs across it. None for a spatial mechanism, and where nothing turns."""
    poses = reference_poses(mechanism.bodies)
    turns: list[Array] = []
    slides: list[Array] = []
    for body in mechanism.bodies:
        rotation, _ = poses[body.name]
        for joint in body.joints:
            if joint.kind == "spherical":
                return None
            (turns if joint.kind == "revolute" else slides).append(rotation @ np.array(joint.axis))
    if not turns:
        return None
    normal = turns[0] / np.linalg.norm(turns[0])
    if any(np.linalg.norm(np.cross(normal, axis)) > PARALLEL for axis in turns) or any(
        abs(normal @ axis) > PARALLEL for axis in slides
    ):
        return None
    normal = np.where(np.abs(normal) < 1e-12, 0.0, normal)
    return normal if normal @ THREE_QUARTER > 0 else -normal


DEEPEST = 0.5
"""Largest depth of a mechanism that is shown face on, relative to its larger side in the plane."""


def faced_from(story: Story, framing: Framing) -> Array | None:
    """The direction (3,) from which the page opens: that of a planar mechanism that is not too deep for it, else None."""
    normal = None if story.model is None else plane_normal(story.model)
    if normal is None:
        return None
    across = framing.points - np.outer(framing.points @ normal, normal)
    depth, side = float(np.ptp(framing.points @ normal)), float(np.ptp(across, axis=0).max())
    return normal if depth <= DEEPEST * side else None
