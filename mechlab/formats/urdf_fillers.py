"""Massless links that only carry the joint of a closure: the loop takes their place.

A URDF closes a pin by a link of no mass that turns on one side and coincides with the other side. A Mechanism has a loop with
the freedom of that joint, and no body without mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechlab.mechanism.geometry import Array, Placement, frame_along
from mechlab.mechanism.parts import Body, Frame, Joint, Loop


def inverse(placement: Placement) -> Placement:
    """The placement of the outer frame in the placed one."""
    rotation = placement.rotation.T
    return Placement.of(rotation, -rotation @ placement.translation)


def without_fillers(
    bodies: Sequence[Body], loops: Sequence[Loop], frames: Sequence[Frame], used: Sequence[str]
) -> tuple[list[Body], list[Loop], list[Frame], list[str]]:
    """Bodies, loops and frames without the fillers, and a sentence for each joint that became part of a loop. `used`: joints
    that motors and relations need."""
    left, out, said = list(bodies), [], []
    for loop in loops:
        found = _folded(loop, left, loops, used) or _folded(_turned_round(loop), left, loops, used)
        if found is None:
            out.append(loop)
            continue
        folded, gone = found
        out.append(folded)
        joints = ", ".join(j.name for b in gone for j in b.joints)
        said.append(f"{joints} of a link without mass is the freedom of the {folded.kind} loop {loop.name}")
        left = [b for b in left if b not in gone]
    names = {b.name for b in left}
    return left, out, [f for f in frames if f.body in names or f.body not in {b.name for b in bodies}], said


def _turned_round(loop: Loop) -> Loop:
    return replace(loop, body_a=loop.body_b, body_b=loop.body_a, placement_a=loop.placement_b, placement_b=loop.placement_a)


def _folded(loop: Loop, bodies: Sequence[Body], loops: Sequence[Loop], used: Sequence[str]) -> tuple[Loop, list[Body]] | None:
    """The loop with the joints of the massless links at its end a in it, and these links; None without such links."""
    by_name = {b.name: b for b in bodies}
    parents = {b.parent for b in bodies}
    chain: list[Body] = []
    at = loop.body_a
    while at in by_name and len(chain) < 2:
        body = by_name[at]
        massless = body.inertia.mass == 0.0 and len(body.joints) == 1 and not body.shapes
        lonely = at not in parents or [b for b in bodies if b.parent == at] == chain[:1]
        others = [x for x in loops if x.name != loop.name and at in (x.body_a, x.body_b)]
        if not massless or not lonely or others or body.joints[0].name in used:
            break
        chain.insert(0, body)
        at = body.parent
    if loop.kind != "fixed" or not chain:
        return None
    made = _kind([b.joints[0] for b in chain])
    if made is None or (len(chain) == 2 and chain[1].placement != Placement()):
        return None
    kind, align = made
    turn = Placement.of(align, np.zeros(3))
    start = chain[0].placement @ turn
    end = loop.placement_b @ inverse(loop.placement_a) @ turn
    return Loop(loop.name, kind, chain[0].parent, loop.body_b, start, end), chain


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
