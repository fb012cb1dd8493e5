"""MJCF text -> Mechanism: the files that mechlab writes, and the part of MJCF that a Mechanism can represent.

Read: bodies, hinge, slide, ball and free joints, inertias (of <inertial> or of primitive geoms), default classes,
connect, weld, joint and tendon equalities, fixed tendons, two-site spatial tendons, motors and servos, sites.
Contacts, sensors, keyframes and visual settings are not part of a Mechanism and are left out. Anything else is an
error that names it.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter

import numpy as np

from mechlab.errors import MechlabError, explained, unknown
from mechlab.formats.mjcf.read_drives import Tendons, Terms, coupled, read_drives, read_tendons
from mechlab.formats.mjcf.read_tree import BodyTree, read_tree
from mechlab.formats.mjcf.source import MjcfText, Names, clean, fail, refuse
from mechlab.formats.xml_text import floats, label
from mechlab.mechanism.curve import CurveRelation, polynomial
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.naming import colliding_frame
from mechlab.mechanism.parts import Body, Coefficients, Frame, LinearRelation, Loop, Spring

CONNECTOR_KINDS = {
    ("revolute", "revolute"): "universal",
    ("prismatic", "revolute"): "cylindrical",
    ("prismatic",): "prismatic",
}


@explained
def from_mjcf(content: str) -> Mechanism:
    """The Mechanism in an MJCF text (without includes); raises MechlabError that names what it cannot read."""
    source = MjcfText(content)
    tree = read_tree(source)
    tendons = read_tendons(source, tree)
    names = Names("equality")
    loops, relations, curves = _equalities(source, tree, tendons, names)
    frames = Names("site")
    scalars = [j.name for b in tree.bodies for j in b.joints if j.nv == 1] + list(tendons.shafts)
    sites = {
        n if source.ours or not colliding_frame(n, scalars) else f"{n}_site": site
        for n, site in tree.sites.items()
        if not (source.ours and ":" in n)
    }
    return Mechanism(
        name=clean(source.root.get("model", "")) or "model",
        bodies=tuple(tree.bodies),
        loops=tuple(loops),
        relations=tuple(relations),
        curves=tuple(curves),
        shafts=tuple(tendons.shafts.values()),
        springs=tuple(_spring(tendons, n, names) for n in tendons.springs),
        drives=read_drives(source, tree, tendons),
        frames=tuple(Frame(frames.add(n), b, p) for n, (b, p) in sites.items()),
        gravity=_gravity(source),
        ground_shapes=tuple(tree.ground_shapes),
    )


def _gravity(source: MjcfText) -> tuple[float, float, float]:
    gravity = (0.0, 0.0, -9.81)
    for option in source.section("option"):
        refuse(option, "wind", "density", "viscosity")
        g = floats(option, "gravity", 3)
        if g is not None:
            gravity = (g[0], g[1], g[2])
        for flag in option.findall("flag"):
            for key in ("gravity", "equality", "spring", "damper", "actuation"):
                if flag.get(key) == "disable":
                    raise fail(flag, f"{key} is switched off; a Mechanism cannot say that.")
    return gravity


def _spring(tendons: Tendons, name: str, names: Names) -> Spring:
    spring = tendons.springs[name]
    return Spring(
        names.add(name.removesuffix(":tendon")), spring.body_a, spring.body_b, spring.point_a, spring.point_b,
        spring.stiffness, spring.damping, spring.rest_length, spring.range,
    )  # fmt: skip


def _equalities(
    source: MjcfText, tree: BodyTree, tendons: Tendons, names: Names
) -> tuple[list[Loop], list[LinearRelation], list[CurveRelation]]:
    elements = [source.attributes(e) for e in source.items("equality") if e.get("active", "true") != "false"]
    given = {e.get("name") for e in elements}
    second = {e.get("name") for e in elements if source.ours and (e.get("name") or "").endswith(":axis")}
    guests: Counter[str] = Counter()
    reference = TreeKinematics(Mechanism("reading", tuple(_plain(b) for b in tree.bodies)))
    loops: list[Loop] = []
    relations: list[LinearRelation] = []
    curves: list[CurveRelation] = []
    for e in elements:
        if e.get("name") in second:
            continue
        if e.tag in ("connect", "weld"):
            revolute = f"{e.get('name')}:axis" in second and f"{e.get('name')}" in given
            loops.append(_loop(source, tree, reference, e, names.add(e.get("name")), revolute, guests))
        elif e.tag == "tendon" and e.get("tendon1") in tendons.distances:
            _no_offset(e)
            a, b = tendons.distances[e.get("tendon1", "")]
            loops.append(_distance(reference, names.add(e.get("name")), tree.sites[a], tree.sites[b]))
        elif e.tag == "joint" and e.get("joint2") and any(_polynomial(e)[2:]):
            curves.append(_curve(tree, names.add(e.get("name")), e))
        elif e.tag in ("tendon", "joint"):
            relations.append(LinearRelation(names.add(e.get("name")), _relation(tree, tendons, e)))
        else:
            raise fail(e, "mechlab does not read this kind of equality.")
    for body, count in guests.items():
        tree.restore(body, count)
    return loops, relations, curves


def _curve(tree: BodyTree, name: str, e: ET.Element) -> CurveRelation:
    """A joint equality of higher degree: output - its reference = polynomial of input - its reference."""
    output, given_by = (tree.joint_names.find(e.get(k), e) for k in ("joint1", "joint2"))
    zeros = {j.name: j.zero for b in tree.bodies for j in b.joints}
    first, *rest = _polynomial(e)
    return CurveRelation(name, output, given_by, polynomial((zeros[output] + first, *rest), zeros[given_by]))


def _plain(body: Body) -> Body:
    """The body with a mass, so that the tree without loops is a valid Mechanism for reading poses."""

    return Body(body.name, body.parent, body.placement, body.joints, Inertia(1.0, (0.0, 0.0, 0.0), (1, 1, 1, 0, 0, 0)))


def _loop(
    source: MjcfText,
    tree: BodyTree,
    reference: TreeKinematics,
    e: ET.Element,
    name: str,
    revolute: bool,
    guests: Counter[str],
) -> Loop:
    kind = "spherical" if e.tag == "connect" or e.get("torquescale") == "0" else "fixed"
    site1, site2 = e.get("site1"), e.get("site2")
    if source.ours and e.get("name") in tree.connectors:
        _, kinds = tree.connectors[e.get("name", "")]
        a, b = (_site(tree, f"{e.get('name')}:{end}", e) for end in "ab")
        guests[a[0] if site2 == f"{e.get('name')}:a" else b[0]] += 1
        if kinds not in CONNECTOR_KINDS:
            raise fail(e, f"its connector has the joints {', '.join(kinds) or 'none'}, which is no kind of loop.")
        return Loop(name, CONNECTOR_KINDS[kinds], a[0], b[0], a[1], b[1])
    if site1 is not None or site2 is not None:
        (a_body, a_at), (b_body, b_at) = _site(tree, site1, e), _site(tree, site2, e)
        return Loop(name, "revolute" if revolute else kind, a_body, b_body, a_at, b_at)
    one_body = tree.body_names.find(e.get("body1"), e)
    two = tree.body_names.find(e.get("body2", "world"), e)
    anchor = floats(e, "anchor", 3) or (0.0, 0.0, 0.0)
    point = Placement((anchor[0], anchor[1], anchor[2]))
    if e.tag == "connect":
        a_at = tree.frame_of[one_body] @ point
        return Loop(name, kind, one_body, two, a_at, _seen(reference, one_body, a_at, two))
    b_at = tree.frame_of[two] @ point
    relpose = floats(e, "relpose", 7)
    if relpose is None or not any(relpose[3:]):
        return Loop(name, kind, one_body, two, _seen(reference, two, b_at, one_body), b_at)
    r = relpose
    a_at = tree.frame_of[one_body] @ Placement((r[0], r[1], r[2]), (r[3], r[4], r[5], r[6]))
    return Loop(name, kind, one_body, two, a_at, b_at)


def _site(tree: BodyTree, name: str | None, e: ET.Element) -> tuple[str, Placement]:
    if name is None or name not in tree.sites:
        raise unknown(f"{label(e)}: site", name, tree.sites)
    return tree.sites[name]


def _seen(reference: TreeKinematics, body: str, placement: Placement, other: str) -> Placement:
    """A frame fixed in `body`, seen from the body `other`, in the reference pose."""
    r, p = reference.pose(body)
    ro, po = reference.pose(other)
    return Placement.of(ro.T @ r @ placement.rotation, ro.T @ (p + r @ placement.translation - po))


def _distance(reference: TreeKinematics, name: str, a: tuple[str, Placement], b: tuple[str, Placement]) -> Loop:
    far = _seen(reference, b[0], b[1], a[0]).translation - a[1].translation
    ends = (Placement(a[1].position), Placement(b[1].position)) if a[1] == b[1] == IDENTITY else (a[1], b[1])
    return Loop(name, "distance", a[0], b[0], *ends, length=float(np.linalg.norm(far)))


def _polynomial(e: ET.Element) -> tuple[float, ...]:
    return floats(e, "polycoef") or (0.0, 1.0)


def _no_offset(e: ET.Element) -> tuple[float, ...]:
    """polycoef of an equality. Raises MechlabError when it is not linear or has an offset in the reference pose."""
    poly = _polynomial(e)
    if any(poly[2:]):
        raise fail(e, "a nonlinear polycoef of a tendon is not read.")
    if poly[0] != 0.0:
        raise fail(e, f"the offset {poly[0]:g} of polycoef means that the reference pose is not assembled.")
    return poly


def _relation(tree: BodyTree, tendons: Tendons, e: ET.Element) -> Coefficients:
    poly = _no_offset(e)
    ratio = poly[1] if len(poly) > 1 else 0.0
    if e.tag == "joint":
        first: Terms = ((tree.joint_names.find(e.get("joint1"), e), 1.0),)
        other: Terms = () if e.get("joint2") is None else ((tree.joint_names.find(e.get("joint2"), e), 1.0),)
    else:
        first = tendons.terms(e.get("tendon1"), e)
        other = () if e.get("tendon2") is None else tendons.terms(e.get("tendon2"), e)
    terms = coupled(first, other, ratio)
    if not terms:
        raise MechlabError(f"{label(e)}: it couples nothing.")
    return terms
