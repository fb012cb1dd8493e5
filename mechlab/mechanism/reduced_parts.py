"""The parts of a reduced train: bodies of the chain, and a Shaft for every other joint and shaft of the original."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.angle_basis import AngleBasis, Row, positive
from mechlab.mechanism.geometry import Placement, frame_along
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Shaft
from mechlab.mechanism.reduced_chain import Chain, Link
from mechlab.mechanism.welds import placed

DUMMY = 1e-14
"""Inertia of a chain body that has none of its own, in units of the largest inertia: engines refuse massless bodies."""


def chain_bodies(m: Mechanism, chain: Chain, inertia: dict[Row, float]) -> list[Body]:
    """A body for each link; takes from `inertia` what turns with it."""
    tree = TreeKinematics(m)
    largest = max(inertia.values(), default=1.0)
    out = []
    for k, link in enumerate(chain.links):
        body = link.body
        own: Row = tuple(Fraction(int(i == chain.order[k])) for i in range(len(chain.links)))
        share = inertia.pop(positive(own), 0.0)
        if link.nested:
            out.append(replace(body, joints=(replace(body.joints[0], armature=share),)))
            continue
        moment = share if share > 0.0 else DUMMY * largest
        mass = sum(b.inertia.mass for b in m.bodies if _carries(m, body.name, b)) if share > 0.0 else 0.0
        mass = mass or moment / max(1e-4, float(np.sum(np.square(body.inertia.com))))
        axis = body.joints[0].axis
        joint = replace(body.joints[0], name=link.joint, armature=0.0)
        if link.joint != link.original:
            joint = replace(joint, zero=0.0, range=None, damping=0.0, friction=0.0, stiffness=0.0, spring_rest=0.0)
            if body.joints[0].range is not None:
                raise _range(m, link.original)
        place = body.placement if link.under == body.parent else _relative(tree, link, body)
        part = Inertia.axial(mass, moment, 0.5 * moment, axis)
        out.append(replace(body, parent=link.under, placement=place, joints=(joint,), inertia=part))
    return out


def _carries(m: Mechanism, name: str, body: Body) -> bool:
    at = body.name
    while at != GROUND:
        if at == name:
            return True
        at = m.body(at).parent
    return False


def _relative(tree: TreeKinematics, link: Link, body: Body) -> Placement:
    """Placement of a body of the ground in the body that it is nested in, in the reference pose."""
    r, p = tree.pose(link.under)
    own_r, own_p = tree.pose(body.name)
    return Placement.of(r.T @ own_r, r.T @ (own_p - p))


def _range(m: Mechanism, name: str) -> MechlabError:
    return MechlabError(
        f"{m.name}: joint {name!r} has a range and becomes a shaft, which has none. Keep it as a coordinate with "
        f"independent=({name!r}, …), or move the range to a joint that stays one."
    )


def part_shafts(m: Mechanism, basis: AngleBasis, chain: Chain, inertia: dict[Row, float]) -> list[Shaft]:
    """A Shaft for every joint that is no coordinate any more and for every shaft of the original."""
    direct = {link.joint for link in chain.links if link.joint == link.original}
    bodies = {link.body.name for link in chain.links}
    out = []
    for body in m.bodies:
        joint = body.joints[0]
        if joint.name in direct:
            continue
        row = basis.rows[joint.name]
        if joint.range is not None:
            raise _range(m, joint.name)
        if not any(row):
            raise MechlabError(
                f"{m.name}: joint {joint.name!r} cannot move; weld its body (leave the joint out) first."
            )
        drawn = body.name not in bodies and body.parent in bodies | {GROUND}
        frame = np.eye(3) if joint.axis == (0.0, 0.0, 1.0) else frame_along(joint.axis)
        turned = Placement.of(frame, (0.0, 0.0, 0.0))
        back = Placement.of(frame.T, (0.0, 0.0, 0.0))
        out.append(Shaft(
            joint.name, chain.coefficients(row), joint.zero, inertia.pop(positive(row), 0.0), joint.damping, joint.friction,
            joint.stiffness, joint.spring_rest, body.parent if drawn else GROUND,
            body.placement @ turned if drawn else Placement(), placed(body.shapes, back) if drawn else (),
        ))  # fmt: skip
    for shaft in m.shafts:
        row = basis.combine(shaft.coefficients)
        if not any(row):
            raise MechlabError(f"{m.name}: shaft {shaft.name!r} cannot move; leave it out of the mechanism first.")
        seen = shaft.body in bodies | {GROUND}
        out.append(replace(
            shaft, coefficients=chain.coefficients(row), inertia=inertia.pop(positive(row), 0.0),
            body=shaft.body if seen else GROUND, shapes=shaft.shapes if seen else (),
        ))  # fmt: skip
    return out
