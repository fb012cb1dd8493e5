"""A straight uniform bar: how it looks, and its inertia."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.joints import X, Z
from mechlab.mechanism.parts import Joint
from mechlab.mechanism.shape import Color, Shape, shape

PIN: Color = (0.28, 0.31, 0.36, 1.0)


def uniform_bar(
    name: str, joint: Joint, length: float, mass: float | None, width: float | None, color: Color, layer: float
) -> tuple[Inertia, tuple[Shape, ...]]:
    """Inertia and shapes of the bar along its local x, from its joint to `length` [m]; see `Builder.bar`."""
    w = 0.08 * length if width is None else width
    m = length if mass is None else mass
    axis = np.array(joint.axis) if joint.kind == "revolute" and abs(joint.axis[0]) < 0.5 else np.array(Z)
    facing = np.column_stack([np.array(X), np.cross(axis, X), axis])
    place = Placement.of(facing, layer * axis)
    looks = shape("link", place, color, name, length=length, width=w, thickness=0.4 * w, bore=0.18 * w)
    ends = (layer * axis, layer * axis + np.array([length, 0.0, 0.0]))
    pins = [
        shape("cylinder", Placement.of(facing, p), PIN, f"pin_{k}", radius=0.18 * w, length=0.9 * w)
        for k, p in enumerate(ends)
    ]
    rod = Inertia.rod(m, (0.0, 0.0, 0.0), (length, 0.0, 0.0), w / 4)
    return rod, (looks, *pins)
