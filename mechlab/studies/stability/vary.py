"""A mechanism or scene with one property scaled, for the second axis of a stability map."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.laws import Law, OneSidedStop, Servo
from mechlab.experiment.scene import Scene
from mechlab.lab.design import Design
from mechlab.mechanism import Builder, Mechanism, Placement
from mechlab.mechanism.parts import GROUND, Coefficients, Joint, Loop, Shaft, Spring


def with_mechanism(design: Design, mechanism: Mechanism) -> Design:
    """The design with this mechanism at every fidelity, without its own equations, which would not include the
    change."""
    return replace(design, entry=replace(design.entry, build=lambda p, fidelity: mechanism, reference=None))


def scale_mass(mechanism: Mechanism, body: str, factor: float) -> Mechanism:
    """Mass and moments of a body times `factor`. Raises MechlabError for an unknown body."""
    old = mechanism.body(body).inertia
    tensor: Any = tuple(x * factor for x in old.tensor)
    new = replace(old, mass=old.mass * factor, tensor=tensor)
    bodies = tuple(replace(b, inertia=new) if b.name == body else b for b in mechanism.bodies)
    return replace(mechanism, bodies=bodies)


def scale_springs(mechanism: Mechanism, factor: float, only: Collection[str] | None = None) -> Mechanism:
    """Stiffness of springs, joints and shafts times `factor`, and their damping times its square root, so that the
    damping ratio stays. only: names of the scaled parts (default: all)."""

    def scaled(item: Any) -> Any:
        if not item.stiffness or (only is not None and item.name not in only):
            return item
        return replace(item, stiffness=item.stiffness * factor, damping=item.damping * factor**0.5)

    bodies = tuple(replace(b, joints=tuple(scaled(j) for j in b.joints)) for b in mechanism.bodies)
    shafts, springs = tuple(map(scaled, mechanism.shafts)), tuple(map(scaled, mechanism.springs))
    return replace(mechanism, bodies=bodies, shafts=shafts, springs=springs)


def scale_servos(scene: Scene, factor: float) -> Scene:
    """Gains of the servos and stops of a scene: stiffness times `factor`, damping times its square root."""

    def scaled(law: Law) -> Law:
        if not isinstance(law, Servo | OneSidedStop):
            return law
        return replace(law, stiffness=law.stiffness * factor, damping=law.damping * factor**0.5)

    return replace(scene, laws=tuple(scaled(law) for law in scene.laws))


def without_ranges(mechanism: Mechanism) -> Mechanism:
    """The mechanism without ranges of joints, shafts and springs: MuJoCo puts soft stops there, the reference runs have none."""
    parts: list[Joint | Shaft | Spring] = [*mechanism.joints, *mechanism.shafts, *mechanism.springs]
    if all(x.range is None for x in parts):
        return mechanism
    bodies = tuple(replace(b, joints=tuple(replace(j, range=None) for j in b.joints)) for b in mechanism.bodies)
    shafts = tuple(replace(s, range=None) for s in mechanism.shafts)
    springs = tuple(replace(s, range=None) for s in mechanism.springs)
    return replace(mechanism, bodies=bodies, shafts=shafts, springs=springs)


def rough_parts(mechanism: Mechanism) -> dict[str, float]:
    """Joint or shaft with dry friction -> its size [N m or N]."""
    out = {j.name: j.friction for j in mechanism.joints if j.friction}
    return out | {s.name: s.friction for s in mechanism.shafts if s.friction}


def scale_friction(mechanism: Mechanism, factor: float) -> Mechanism:
    """All dry friction of joints and shafts times `factor`."""

    def scaled(item: Any) -> Any:
        return replace(item, friction=item.friction * factor)

    bodies = tuple(replace(b, joints=tuple(scaled(j) for j in b.joints)) for b in mechanism.bodies)
    return replace(mechanism, bodies=bodies, shafts=tuple(scaled(s) for s in mechanism.shafts))


def faster_joint(mechanism: Mechanism, joint: str, ratio: float) -> Mechanism:
    """The mechanism with a joint that turns `ratio` times as fast in all of its relations; redundant relations stay
    redundant.

    Its coefficients are divided by the ratio, taken exactly as the decimal that it prints as.
    """
    mechanism.joint(joint)
    by = Fraction(str(float(ratio)))

    def changed(coefficients: Coefficients) -> Coefficients:
        return tuple((name, c / by if name == joint else c) for name, c in coefficients)

    relations = tuple(replace(r, coefficients=changed(r.coefficients)) for r in mechanism.relations)
    return replace(mechanism, relations=relations)


def shift_loops(mechanism: Mechanism, amount: float) -> Mechanism:
    """The mechanism with one link of every loop longer by `amount` [m], assembled again from the reference pose.

    Raises MechlabError when it cannot be assembled.
    """
    b = Builder(mechanism.name, mechanism.gravity, mechanism.summary)
    b.bodies, b.shafts, b.springs = list(mechanism.bodies), list(mechanism.shafts), list(mechanism.springs)
    b.drives, b.frames = list(mechanism.drives), list(mechanism.frames)
    b.ground_shapes, b.meshes = list(mechanism.ground_shapes), list(mechanism.relations)
    b.loops = [_longer(x, amount) for x in mechanism.loops]
    return b.assemble()


def _longer(loop: Loop, amount: float) -> Loop:
    """The loop with one end moved by `amount` [m] away from the origin of its body: the longer end on a moving body."""
    sides = [("placement_a", loop.body_a, loop.placement_a), ("placement_b", loop.body_b, loop.placement_b)]
    moving = [(field, place) for field, body, place in sides if body != GROUND]
    field, place = max(moving, key=lambda x: float(np.linalg.norm(x[1].translation)))
    size = float(np.linalg.norm(place.translation))
    if size < 1e-9:
        raise MechlabError(f"loop {loop.name!r} ends at the joints of its bodies: there is no length to change.")
    moved = Placement.of(place.rotation, place.translation * (1.0 + amount / size))
    changes: dict[str, Any] = {field: moved}
    return replace(loop, **changes)


def link_length(mechanism: Mechanism) -> float:
    """Shortest distance [m] of a loop end from the origin of its moving body; 0 where all ends lie at the origins."""
    ends = [(x.body_a, x.placement_a) for x in mechanism.loops] + [(x.body_b, x.placement_b) for x in mechanism.loops]
    sizes = [float(np.linalg.norm(place.translation)) for body, place in ends if body != GROUND]
    return min((x for x in sizes if x > 1e-9), default=0.0)
