"""Massless links that only carry the joint of a closure: the loop takes their place.

A URDF closes a pin by a link of no mass that turns on one side and coincides with the other side. A Mechanism has a loop with
the freedom of that joint, and no body without mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Array, Placement, frame_along
from mechlab.mechanism.parts import Body, Frame, Joint, Loop


@dataclass
class Folded:
    """Bodies, loops and frames without the fillers; `notes`: a sentence for each loop that took joints; `lost`: frames between the
    two joints of a loop, which no body holds."""

    bodies: list[Body]
    loops: list[Loop]
    frames: list[Frame]
    notes: list[str]
    lost: list[str]


def without_fillers(bodies: Sequence[Body], loops: Sequence[Loop], frames: Sequence[Frame], used: Sequence[str]) -> Folded:
    """The mechanism without its fillers. A frame on the link that a loop held fixed stands on the other side of the loop from then on,
    unless it only marked that end of the loop. `used`: joints that motors and relations need."""
    out = Folded(list(bodies), [], list(frames), [], [])
    for given in loops:
        ways = ((way, _chain(way, out.bodies, loops, used)) for way in (given, _turned_round(given)))
        loop, chain, made = next(((way, chain, made) for way, chain in ways if (made := _in_place_of(way, chain))), (given, [], None))
        out.loops.append(made or given)
        if made is None:
            continue
        joints = ", ".join(j.name for b in chain for j in b.joints)
        out.notes.append(f"{joints} of a link without mass is the freedom of the {made.kind} loop {made.name}")
        out.bodies = [b for b in out.bodies if b not in chain]
        out.lost += [f.name for f in out.frames for b in chain[:-1] if f.body == b.name]
        out.frames = [x for f in out.frames for x in _kept(f, loop, chain)]
    return out


def _kept(frame: Frame, loop: Loop, chain: Sequence[Body]) -> list[Frame]:
    """The frame where it stands without the links of the chain; none for one that falls away."""
    if frame.body not in {b.name for b in chain}:
        return [frame]
    if frame.body != chain[-1].name or frame.placement == loop.placement_a:
        return []
    return [replace(frame, body=loop.body_b, placement=_across(loop) @ frame.placement)]


def _across(loop: Loop) -> Placement:
    """Where the body at end a of a fixed loop stands in the body at end b."""
    return loop.placement_b @ loop.placement_a.inverse()


def _turned_round(loop: Loop) -> Loop:
    return replace(loop, body_a=loop.body_b, body_b=loop.body_a, placement_a=loop.placement_b, placement_b=loop.placement_a)


def _chain(loop: Loop, bodies: Sequence[Body], loops: Sequence[Loop], used: Sequence[str]) -> list[Body]:
    """The massless links that nothing but end a of the loop needs, at most two, the last one at that end."""
    by_name = {b.name: b for b in bodies}
    chain: list[Body] = []
    at = loop.body_a
    while at in by_name and len(chain) < 2:
        body = by_name[at]
        massless = body.inertia.mass == 0.0 and len(body.joints) == 1 and not body.shapes
        lonely = [b for b in bodies if b.parent == at] == chain[:1]
        others = [x for x in loops if x.name != loop.name and at in (x.body_a, x.body_b)]
        if not massless or not lonely or others or body.joints[0].name in used:
            break
        chain.insert(0, body)
        at = body.parent
    return chain


def _in_place_of(loop: Loop, chain: Sequence[Body]) -> Loop | None:
    """The fixed loop with the joints of the chain in it; None where no kind of loop has their freedoms."""
    if loop.kind != "fixed" or not chain or (len(chain) == 2 and chain[1].placement != IDENTITY):
        return None
    made = _kind([b.joints[0] for b in chain])
    if made is None:
        return None
    turn = Placement.of(made[1], np.zeros(3))
    return Loop(loop.name, made[0], chain[0].parent, loop.body_b, chain[0].placement @ turn, _across(loop) @ turn)


def _kind(joints: Sequence[Joint]) -> tuple[str, Array] | None:
    """The kind of loop with the freedoms of these joints, and the axes of its ends in the frame of the joints."""
    kinds = [j.kind for j in joints]
    axes = [np.array(j.axis) for j in joints]
    if len(joints) == 1 and kinds[0] in ("revolute", "prismatic"):
        return kinds[0], frame_along(axes[0])
    if sorted(kinds) == ["prismatic", "revolute"] and np.array_equal(np.abs(axes[0]), np.abs(axes[1])):
        return "cylindrical", frame_along(axes[0])
    if kinds == ["revolute", "revolute"] and abs(float(axes[0] @ axes[1])) < 1e-12:
        return "universal", np.column_stack([axes[0], axes[1], np.cross(axes[0], axes[1])])
    return None
