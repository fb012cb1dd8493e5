"""What is drawn of a body without shapes: thin rods from its joint to the joints, loop ends, springs and frames that it
carries. Only pictures have them; the mechanism and its files stay as they are."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism import Body, Mechanism, Placement, Shape
from mechlab.mechanism.geometry import IDENTITY, Array, frame_along
from mechlab.mechanism.parts import FLOOR, shape
from mechlab.mechanism.tree import reference_poses

THICKNESS = 0.006
"""Radius of a rod, relative to the diagonal of the mechanism."""
SHORTEST = 1e-3
"""Points closer than this, relative to the diagonal, are one point."""
ROD = (0.36, 0.45, 0.58, 1.0)
JOINT = (0.85, 0.52, 0.2, 1.0)


def lines(m: Mechanism) -> dict[str, tuple[Shape, ...]]:
    """Body -> the rods and joints that stand for it, for every body without shapes that has an extent; for all of them where
    nothing else of the mechanism would be seen."""
    bare = [b for b in m.bodies if not b.shapes]
    if not bare:
        return {}
    carried = {b.name: _carried(m, b, len(bare) == len(m.bodies)) for b in m.bodies}
    poses = reference_poses(m.bodies)
    cloud = [poses[name][1] + poses[name][0] @ p for name, points in carried.items() for p in (np.zeros(3), *points)]
    diagonal = float(np.linalg.norm(np.ptp(np.array(cloud), axis=0))) or 0.2 * m.length_scale
    drawn = {b.name: _drawn(b, carried[b.name], diagonal) for b in bare}
    nothing = len(bare) == len(m.bodies) and all(s.kind == FLOOR for s in m.ground_shapes) and not any(s.shapes for s in m.shafts)
    if nothing and not any(drawn.values()):
        return {b.name: (_joint(b, diagonal * 5.0 * THICKNESS),) for b in bare}
    return {name: shapes for name, shapes in drawn.items() if shapes}


def _carried(m: Mechanism, body: Body, centre: bool) -> list[Array]:
    """Points (3,) [m] of a body at which something acts or that have a name; with `centre` its centre of mass where there
    is none."""
    points = [b.placement.translation for b in m.bodies if b.parent == body.name]
    for loop in m.loops:
        points += [loop.placement_a.translation] if loop.body_a == body.name else []
        points += [loop.placement_b.translation] if loop.body_b == body.name else []
    for spring in m.springs:
        points += [np.array(spring.point_a)] if spring.body_a == body.name else []
        points += [np.array(spring.point_b)] if spring.body_b == body.name else []
    points += [f.placement.translation for f in m.frames if f.body == body.name]
    return [np.array(body.inertia.com)] if centre and not any(np.any(p) for p in points) else points


def _drawn(body: Body, points: list[Array], diagonal: float) -> tuple[Shape, ...]:
    radius, shortest = THICKNESS * diagonal, SHORTEST * diagonal
    ends: list[Array] = []
    for p in points:
        if np.linalg.norm(p) > shortest and all(np.linalg.norm(p - other) > shortest for other in ends):
            ends.append(p)
    if not ends:
        return ()
    rods = [_rod(p, radius, f"line_{k}") for k, p in enumerate(ends)]
    return (*rods, _joint(body, 2.2 * radius)) if body.joints else tuple(rods)


def _rod(end: Array, radius: float, name: str) -> Shape:
    long = float(np.linalg.norm(end))
    return shape("rod", Placement.of(frame_along(end / long), np.zeros(3)), ROD, name, length=long, radius=radius)


def _joint(body: Body, size: float) -> Shape:
    """A cylinder along the axis of the last joint that turns, a cube for a slide, a ball for any other or none."""
    turns = [j for j in body.joints if j.kind == "revolute"]
    if turns:
        place = Placement.of(frame_along(turns[-1].axis), np.zeros(3))
        return shape("cylinder", place, JOINT, "joint", radius=size, length=2.5 * size)
    if body.joints and body.joints[-1].kind == "prismatic":
        place = Placement.of(frame_along(body.joints[-1].axis), np.zeros(3))
        return shape("box", place, JOINT, "joint", x=2.0 * size, y=2.0 * size, z=2.0 * size)
    return shape("sphere", IDENTITY, JOINT, "joint", radius=size)
