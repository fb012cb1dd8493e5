"""Loops in MJCF: which equality stands for which kind, where a loop needs a connector body, and the names.

What mechlab adds to a file has a ':' in its name, which no name of a Mechanism may have: nothing collides.

    spherical    connect of two sites                                             3 rows
    fixed        weld of two sites                                                6 rows
    revolute     connect at the point, and another one along the axis             6 rows, 5 of them independent
    distance     spatial tendon held at its length                                1 row; positions only, see below
    universal, cylindrical, prismatic
                 a connector body with the joints of that kind, welded            6 rows, 2, 2, 1 more joints
    curve        joint equality with a polynomial of degree 4                     1 row; near the reference pose only

Reactions of a revolute loop: force = f_point + f_axis, moment = d z x f_axis, with d = `spread(m)`.

MuJoCo's tendon equality ignores the term of the acceleration that is quadratic in the rates, so that a distance loop is
correct in positions only.

**Connector bodies.** MuJoCo has no equality for some joints. Such a loop is cut one body further: the body at one end is
split in equal shares, its own and one for each connector; a connector hangs on the other end by the joint and is welded to
the body (as Simbody's MultibodyGraphMaker does). The dynamics is the same. A connector of negligible mass is no
substitute: MuJoCo scales the softness of a row by the inverse mass of both bodies, and the weld becomes soft.
All coordinates of a connector are 0 in the reference pose. A pin between masses that stand still has an end in a welded body NAME:holder
without mass: see `holders`.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Settings
from mechlab.formats.xml_text import add
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.curve import CurveRelation
from mechlab.mechanism.geometry import IDENTITY, Placement, Vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Loop

BASE = "base"
"""The one fixed body around everything (some readers of MJCF keep only the first child of the world)."""


def body_name(name: str) -> str:
    """MJCF name of a body: its own, but `base` for the ground; bodies called base or world get a suffix."""
    if name == GROUND:
        return BASE
    return f"{name}:body" if name in (BASE, "world") else name


def site_names(loop: str) -> tuple[str, str]:
    """Sites at the ends a and b of a loop or spring."""
    return f"{loop}:a", f"{loop}:b"


def axis_site_names(loop: str) -> tuple[str, str]:
    """Second pair of sites of a revolute loop, along its axis."""
    return f"{loop}:axis_a", f"{loop}:axis_b"


def axis_name(loop: str) -> str:
    """Second connect of a revolute loop."""
    return f"{loop}:axis"


def connector_name(loop: str) -> str:
    """Connector body of a universal, cylindrical or prismatic loop; its joints are NAME:1, NAME:2."""
    return f"{loop}:connector"


def holder_name(loop: str) -> str:
    """Welded body of an end of a loop: see `holders`."""
    return f"{loop}:holder"


def connector_joint(loop: str, number: int) -> str:
    """Joint 1 or 2 of a connector body."""
    return f"{loop}:{number}"


def tendon_name(mechanism: Mechanism, name: str) -> str:
    """Tendon of a relation, spring or distance loop: its name, with a suffix when a shaft has that name."""
    return f"{name}:tendon" if any(s.name == name for s in mechanism.shafts) else name


def stage_name(body: str, number: int) -> str:
    """Body that carries the first joints of another one, where MuJoCo does not allow all of them in one body."""
    return f"{body}:stage{number}"


Z: Vector = (0.0, 0.0, 1.0)
TORQUESCALE = 20.0
"""Scale of the angular rows of a weld. MuJoCo estimates their inverse inertia without the factor torquescale / 2 of
the rows, so that 2 makes its estimate right, less makes the weld soft in rotation, and 20 makes it 100 times harder."""


@dataclass(frozen=True)
class ConnectorBody:
    """A connector body: child of `host`, welded to `guest`, with one or two joints (kind, axis in its own frame)."""

    loop: Loop
    host: str
    guest: str
    placement: Placement
    joints: tuple[tuple[str, Vector], ...]
    inertia: Inertia


def connectors(m: Mechanism) -> tuple[ConnectorBody, ...]:
    """The connector bodies that the loops of a mechanism need in MJCF, in the order of the loops."""
    loops = [x for x in m.loops if x.kind in ("universal", "cylindrical", "prismatic")]
    if not loops:
        return ()
    guests = {x.name: _guest(m, x) for x in loops}
    count = Counter(guests.values())
    tree = TreeKinematics(m)
    return tuple(_connector(m, tree, x, guests[x.name], 1.0 / (1 + count[guests[x.name]])) for x in loops)


def _guest(m: Mechanism, loop: Loop) -> str:
    for name in (loop.body_b, loop.body_a):
        if name != GROUND and m.body(name).inertia.mass > 0.0:
            return name
    raise MechlabError(
        f"{m.name}: loop {loop.name!r} of kind {loop.kind!r} needs a body with mass at one end to be written as MJCF; "
        f"{loop.body_a!r} and {loop.body_b!r} have none."
    )


def _connector(m: Mechanism, tree: TreeKinematics, loop: Loop, guest: str, share: float) -> ConnectorBody:
    a, b = (loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)
    (host, host_frame), (_, own_frame) = (a, b) if guest == loop.body_b else (b, a)
    r_host, p_host = tree.pose(host)
    r_guest, p_guest = tree.pose(guest)
    rotation = r_host.T @ r_guest @ own_frame.rotation
    placement = Placement.of(rotation, r_host.T @ (p_guest + r_guest @ own_frame.translation - p_host))
    if loop.kind == "universal":
        own, other = (1, 0) if guest == loop.body_b else (0, 1)
        across = rotation.T @ host_frame.rotation[:, other]
        across[own] = 0.0  # the pins of a closed universal joint are at right angles
        across /= np.linalg.norm(across)
        first: Vector = (float(across[0]), float(across[1]), float(across[2]))
        second: Vector = (0.0, 1.0, 0.0) if own == 1 else (1.0, 0.0, 0.0)
        joints: tuple[tuple[str, Vector], ...] = (("hinge", first), ("hinge", second))
    elif loop.kind == "cylindrical":
        joints = (("slide", Z), ("hinge", Z))
    else:
        joints = (("slide", Z),)
    whole = m.body(guest).inertia
    frame = own_frame.rotation.T
    part = whole.at(tuple(-(frame @ own_frame.translation)), frame)
    return ConnectorBody(loop, host, guest, placement, joints, scaled(part, share))


def scaled(inertia: Inertia, share: float) -> Inertia:
    """The inertia times `share`, with the same centre of mass."""
    t = tuple(share * x for x in inertia.tensor)
    return replace(inertia, mass=share * inertia.mass, tensor=t)  # type: ignore[arg-type]


def own_share(m: Mechanism, plan: tuple[ConnectorBody, ...], body: str) -> Inertia:
    """Inertia of a body without the shares of its connectors."""
    whole = m.body(body).inertia
    count = sum(1 for c in plan if c.guest == body)
    return scaled(whole, 1.0 / (1 + count)) if count else whole


STILL = 1e-3
"""A centre of mass is taken to stand still where all joints move it by less than this, relative to the size of the mechanism."""


def holders(tree: TreeKinematics, size: float) -> dict[str, tuple[str, Placement]]:
    """Loop -> the body, and where in it [m], of the pins that join bodies whose centres of mass no joint moves in the reference pose, as
    the cross of a cardan joint.

    MuJoCo scales the softness of a pin by how easily forces move the two centres of mass, in that pose. Where they do not, it becomes 0:
    the row is stiffer than numbers can be, and the run breaks. So the pin's end stands in a welded body without mass, whose centre of
    mass lies on the axis, as far out as its second end. The flag diagexact, which scales by the row itself, breaks where the axis comes
    to lie along an axis of the world: the row along it is then as good as 0.
    """
    along, out = Placement((0.0, 0.0, size)), dict[str, tuple[str, Placement]]()
    for loop in tree.mechanism.loops:
        if loop.kind in ("spherical", "revolute") and all(_still(tree, x, size) for x in (loop.body_a, loop.body_b)):
            body, at = (loop.body_b, loop.placement_b) if loop.body_a == GROUND else (loop.body_a, loop.placement_a)
            out[loop.name] = body, at @ along
    return out


def _still(tree: TreeKinematics, body: str, size: float) -> bool:
    if body == GROUND:
        return True
    m = tree.mechanism
    rotation, origin = tree.pose(body)
    centre = origin + rotation @ np.array(m.body(body).inertia.com)
    way = tree.jacobian(body, centre)[:3]
    slides = [m.v_slice[j.name].start for j in m.joints if j.kind == "prismatic"]
    return bool(np.all(np.delete(np.linalg.norm(way, axis=0), slides) < STILL * size) and not np.any(way[:, slides]))


def spread(tree: TreeKinematics) -> float:
    """Characteristic length [m] of a mechanism: half its largest extent in the reference pose, where the tree is; two digits."""
    m = tree.mechanism
    points = [np.zeros(3)]
    for body in m.bodies:
        r, p = tree.pose(body.name)
        points += [p, p + r @ np.array(body.inertia.com)]
    for loop in m.loops:
        for body_name, frame in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
            r, p = tree.pose(body_name)
            points.append(p + r @ frame.translation)
    extent = float(np.max(np.ptp(np.array(points), axis=0)))
    return float(f"{extent / 2.0:.2g}") if extent > 1e-6 else 0.1


def loop_ends(
    m: Mechanism, plan: tuple[ConnectorBody, ...], distance: float, held: Mapping[str, tuple[str, Placement]]
) -> dict[str, list[tuple[str, Placement]]]:
    """MJCF body name -> the sites (name, placement) that the loops and springs need in it. held: `holders`."""
    out: dict[str, list[tuple[str, Placement]]] = {}
    cut = {c.loop.name: c for c in plan}
    along = Placement((0.0, 0.0, distance))
    for loop in m.loops:
        end_a, end_b = site_names(loop.name)
        a, b = body_name(loop.body_a), body_name(loop.body_b)
        if loop.name in held:
            a, b = (a, holder_name(loop.name)) if loop.body_a == GROUND else (holder_name(loop.name), b)
        out.setdefault(a, []).append((end_a, loop.placement_a))
        out.setdefault(b, []).append((end_b, loop.placement_b))
        if loop.name in cut:
            out.setdefault(connector_name(loop.name), []).append((connector_name(loop.name), IDENTITY))
        if loop.kind == "revolute":
            axis_a, axis_b = axis_site_names(loop.name)
            out[a].append((axis_a, loop.placement_a @ along))
            out[b].append((axis_b, loop.placement_b @ along))
    for spring in m.springs:
        end_a, end_b = site_names(spring.name)
        out.setdefault(body_name(spring.body_a), []).append((end_a, Placement(spring.point_a)))
        out.setdefault(body_name(spring.body_b), []).append((end_b, Placement(spring.point_b)))
    return out


def write_equalities(root: ET.Element, m: Mechanism, plan: tuple[ConnectorBody, ...], s: Settings) -> None:
    """The <equality> section: every loop, every relation, every curve, each by its name."""
    if not m.is_closed:
        return
    section = add(root, "equality")
    if plan:
        section.append(ET.Comment(" A body NAME:connector takes a share of the inertia of the body it is welded to. "))
    cut = {c.loop.name: c for c in plan}
    soft: dict[str, object] = {"solref": s.solref, "solimp": s.solimp}
    scale = None if s.impedance is None else TORQUESCALE
    for loop in m.loops:
        a, b = site_names(loop.name)
        if loop.kind == "distance":
            add(section, "tendon", name=loop.name, tendon1=tendon_name(m, loop.name), **soft)
        elif loop.kind == "fixed":
            add(section, "weld", name=loop.name, site1=a, site2=b, torquescale=scale, **soft)
        elif loop.name in cut:
            own = b if cut[loop.name].guest == loop.body_b else a
            connector = connector_name(loop.name)
            add(section, "weld", name=loop.name, site1=connector, site2=own, torquescale=scale, **soft)
        else:
            add(section, "connect", name=loop.name, site1=a, site2=b, **soft)
        if loop.kind == "revolute":
            a, b = axis_site_names(loop.name)
            add(section, "connect", name=axis_name(loop.name), site1=a, site2=b, **soft)
    for relation in m.relations:
        add(section, "tendon", name=relation.name, tendon1=tendon_name(m, relation.name), **soft)
    if m.curves:
        section.append(ET.Comment(CURVES))
    for curve in m.curves:
        local = local_polynomial(m, curve)
        add(section, "joint", name=curve.name, joint1=curve.output, joint2=curve.input, polycoef=local, **soft)


CURVES = """ Curves: MuJoCo has polynomials of degree 4 only, here those of the piece in which the reference pose stands. They hold on
 that piece alone; the whole functions are in the JSON beside this file, and a run by mechlab follows them. """


def local_polynomial(m: Mechanism, relation: CurveRelation) -> tuple[float, ...]:
    """The coefficients (5,) of a curve about the reference pose, coordinate of the output for that of the input: Taylor's polynomial."""
    curve, x = relation.curve, m.zero(relation.input)
    k = curve.piece(x)
    d, piece = curve.folded(x) - curve.knots[k], curve.pieces[k]
    out = [sum(math.comb(i, j) * c * d ** (i - j) for i, c in enumerate(piece) if i >= j) for j in range(5)]
    return (curve.at(x)[0] - m.zero(relation.output), *out[1:])
