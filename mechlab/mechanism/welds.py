"""Bodies without joints, taken into what carries them: one rigid part, one body."""

from __future__ import annotations

from dataclasses import replace

from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body
from mechlab.mechanism.shape import Shape


def placed(shapes: tuple[Shape, ...], by: Placement) -> tuple[Shape, ...]:
    """The shapes seen from the frame in which their own stands at `by`."""
    return shapes if by == IDENTITY else tuple(replace(s, placement=by @ s.placement) for s in shapes)


def without_welds(m: Mechanism) -> Mechanism:
    """The same mechanism with every jointless body merged into its parent: inertia, shapes, children, frames, ends of
    loops and springs. Welded to the ground it leaves its shapes there; its inertia never moves."""
    if all(b.joints for b in m.bodies):
        return m
    home: dict[str, tuple[str, Placement]] = {GROUND: (GROUND, IDENTITY)}
    bodies: dict[str, Body] = {}
    ground = m.ground_shapes
    for body in m.bodies:
        parent, offset = home[body.parent]
        place = offset @ body.placement
        if body.joints:
            home[body.name] = (body.name, IDENTITY)
            bodies[body.name] = replace(body, parent=parent, placement=place)
            continue
        home[body.name] = (parent, place)
        shapes = placed(body.shapes, place)
        if parent == GROUND:
            ground += shapes
            continue
        carrier = bodies[parent]
        moved: Inertia = body.inertia.at(place.position, place.rotation)
        bodies[parent] = replace(carrier, inertia=carrier.inertia + moved, shapes=carrier.shapes + shapes)

    def at(name: str, placement: Placement) -> tuple[str, Placement]:
        host, offset = home[name]
        return host, offset @ placement

    frames = []
    for frame in m.frames:
        host, place = at(frame.body, frame.placement)
        frames.append(replace(frame, body=host, placement=place))
    shafts = []
    for shaft in m.shafts:
        host, place = at(shaft.body, shaft.placement)
        shafts.append(replace(shaft, body=host, placement=place))
    loops = []
    for loop in m.loops:
        (a, pa), (b, pb) = at(loop.body_a, loop.placement_a), at(loop.body_b, loop.placement_b)
        loops.append(replace(loop, body_a=a, body_b=b, placement_a=pa, placement_b=pb))
    springs = []
    for spring in m.springs:
        (a, pa), (b, pb) = at(spring.body_a, Placement(spring.point_a)), at(spring.body_b, Placement(spring.point_b))
        springs.append(replace(spring, body_a=a, body_b=b, point_a=pa.position, point_b=pb.position))
    return replace(
        m, bodies=tuple(bodies.values()), frames=tuple(frames), shafts=tuple(shafts), loops=tuple(loops),
        springs=tuple(springs), ground_shapes=ground,
    )  # fmt: skip
