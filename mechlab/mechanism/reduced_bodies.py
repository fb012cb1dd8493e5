"""The parts of a reduced train: nested bodies for the independent joints, a Shaft for every other joint and shaft.

First `without_welds` merges bodies without joints into the body that carries them. Then `chains` puts independent
joints that share inertia or damping on one path, and relates the coordinates of the reduced tree to the original
joints.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.angle_basis import AngleBasis, Row, positive
from mechlab.mechanism.geometry import IDENTITY, Array, Placement, cross, frame_along
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Coefficients, Shaft, Shape


def placed(shapes: tuple[Shape, ...], by: Placement) -> tuple[Shape, ...]:
    """The shapes seen from the frame in which their own stands at `by`."""
    return shapes if by == IDENTITY else tuple(replace(s, placement=by @ s.placement) for s in shapes)


def without_welds(m: Mechanism) -> Mechanism:
    """The same mechanism with every jointless body merged into its parent: inertia, shapes, children, frames, ends of
    loops and springs. A body welded to the ground leaves only its shapes."""
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


@dataclass(frozen=True)
class ChainLink:
    """One independent joint in the reduced tree. `under`: the body it is nested in; `joint`: the name of the coordinate,
    which is that of the original joint where the coordinate means the same, else JOINT_on_OTHER."""

    body: Body
    original: str
    under: str
    joint: str

    @property
    def nested(self) -> bool:
        """True for a part that turned on another part of the chain in the original too."""
        return self.body.parent != GROUND


@dataclass(frozen=True)
class Chain:
    """All links, depth-first. `turn[i][j]`: the original joint of link i = sum over j of turn[i][j] x coordinate of link j."""

    links: tuple[ChainLink, ...]
    order: tuple[int, ...]
    turn: tuple[tuple[Fraction, ...], ...]

    def row(self, row: Row) -> tuple[Fraction, ...]:
        """A row over the independent joints as one over the coordinates of the reduced tree."""
        out = [Fraction(0)] * len(self.links)
        for i, link_row in enumerate(self.turn):
            c = row[self.order[i]]
            out = [o + c * t for o, t in zip(out, link_row, strict=True)]
        return tuple(out)

    def coefficients(self, row: Row) -> Coefficients:
        """The same row as coefficients of joints of the reduced mechanism."""
        return tuple((k.joint, c) for k, c in zip(self.links, self.row(row), strict=True) if c)

    @property
    def to_independent(self) -> Array:
        """(f, f) y = S x: the independent joints (in the order of the basis) from the coordinates of the tree."""
        out = np.zeros((len(self.links), len(self.links)))
        for i, link_row in enumerate(self.turn):
            out[self.order[i]] = [float(x) for x in link_row]
        return out


def coaxial(m: Mechanism, a: Body, b: Body) -> bool:
    """True when the joints of two bodies on the ground turn about one line (either sense)."""
    tree = TreeKinematics(m)
    i, j = (m.v_slice[x.joints[0].name].start for x in (a, b))
    u, w, arm = tree.axes[i], tree.axes[j], tree.anchors[j] - tree.anchors[i]
    size = 1.0 + float(np.linalg.norm(arm))
    return float(np.linalg.norm(cross(u, w))) < 1e-12 and float(np.linalg.norm(cross(u, arm))) < 1e-12 * size


def chains(m: Mechanism, basis: AngleBasis, coupled: Iterable[Row]) -> Chain:
    """The reduced tree: independent joints that share a row of inertia or damping nested on one path.

    Raises MechlabError that names two joints which are coupled but cannot be put on one path.
    """
    home = {b.joints[0].name: b for b in m.bodies}
    groups = _groups(len(basis.independent), coupled)
    links: list[ChainLink] = []
    order: list[int] = []
    turn: list[dict[int, Fraction]] = []
    tree = TreeKinematics(m)
    for group in groups:
        members = [(i, home[basis.independent[i]]) for i in group]
        grounded = [x for x in members if x[1].parent == GROUND]
        nested = [x for x in members if x[1].parent != GROUND]
        carriers = {x[1].parent for x in nested}
        grounded.sort(key=lambda x: x[1].name in carriers)  # a carrier of an independent part stands last
        previous: tuple[Body, int] | None = None
        for i, body in grounded:
            joint = body.joints[0].name
            if previous is None:
                links.append(ChainLink(body, joint, GROUND, joint))
                turn.append({len(links) - 1: Fraction(1)})
            else:
                above, at = previous
                if not coaxial(m, above, body):
                    raise _no_path(m, above, body)
                u, w = (tree.axes[m.v_slice[x.joints[0].name].start] for x in (above, body))
                sign = Fraction(1 if float(u @ w) > 0 else -1)
                links.append(ChainLink(body, joint, above.name, f"{joint}_on_{above.joints[0].name}"))
                turn.append({k: sign * c for k, c in turn[at].items()} | {len(links) - 1: Fraction(1)})
            order.append(i)
            previous = (body, len(links) - 1)
        for i, body in nested:
            if previous is None or body.parent != previous[0].name:
                raise _no_path(m, previous[0] if previous else m.body(body.parent), body)
            links.append(ChainLink(body, body.joints[0].name, body.parent, body.joints[0].name))
            turn.append({len(links) - 1: Fraction(1)})
            order.append(i)
            previous = (body, len(links) - 1)
    n = len(links)
    rows = tuple(tuple(t.get(k, Fraction(0)) for k in range(n)) for t in turn)
    return Chain(tuple(links), tuple(order), rows)


def _groups(n: int, coupled: Iterable[Row]) -> list[list[int]]:
    """Indices of the n independent joints in groups; a row of `coupled` joins its joints in one group."""
    label = list(range(n))
    for row in coupled:
        inside = [i for i, c in enumerate(row) if c]
        for i in inside[1:]:
            old, new = label[i], label[inside[0]]
            label = [new if x == old else x for x in label]
    return [[i for i in range(n) if label[i] == g] for g in dict.fromkeys(label)]


def _no_path(m: Mechanism, a: Body, b: Body) -> MechlabError:
    return MechlabError(
        f"{m.name}: the independent joints {a.joints[0].name!r} and {b.joints[0].name!r} are coupled by inertia or damping "
        "but do not turn about one line, so they cannot be put on one path; the coupling would be lost. Choose others with "
        f"independent=, among {', '.join(j.name for j in m.joints)}, or keep the fidelity with bodies."
    )


DUMMY = 1e-14
"""Inertia of a chain body that has none of its own, in units of the largest inertia: engines refuse massless bodies."""


def chain_bodies(m: Mechanism, chain: Chain, inertia: dict[Row, float]) -> list[Body]:
    """A body for each link; the inertia [kg m2] that turns with it is taken out of `inertia`."""
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


def _relative(tree: TreeKinematics, link: ChainLink, body: Body) -> Placement:
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
    """A Shaft for every joint that is not a coordinate of the reduced tree, and for every shaft of the original."""
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
