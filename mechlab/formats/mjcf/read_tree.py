"""The tree of an MJCF text: bodies, joints, sites; geoms as shapes, and as inertia where a body has no <inertial>."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import field, replace

import numpy as np

from mechlab.formats.mjcf.source import MjcfText, Names, along, fail, one, refuse
from mechlab.formats.mjcf.write_loops import BASE, scaled
from mechlab.formats.xml_text import floats
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Placement, Vector, unit
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.parts import GROUND, Body, Color, Joint, Shape, floating, shape

SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


def solid(source: MjcfText, geom: ET.Element) -> tuple[str, tuple[float, ...], Placement]:
    """Type, sizes (as MJCF: radii and half lengths) and placement of a primitive geom."""
    kind = geom.get("type", "sphere")
    sizes = floats(geom, "size") or ()
    if kind in SIZES and (not sizes or min(sizes[: SIZES[kind]]) <= 0.0):
        raise fail(geom, f"the sizes of a {kind} must be positive, got {geom.get('size')!r}.")
    ends = floats(geom, "fromto", 6)
    placement = source.placement(geom)
    if ends is not None:
        start, end = np.array(ends[:3]), np.array(ends[3:])
        placement = along(start, end)
        half = float(np.linalg.norm(end - start)) / 2.0
        sizes = (sizes[0], half) if kind in ("capsule", "cylinder") else (sizes[0], sizes[0], half)
    if len(sizes) < SIZES[kind]:
        raise fail(geom, f"a {kind} needs {SIZES[kind]} sizes.")
    return kind, sizes[: SIZES[kind]], placement


def geom_shape(source: MjcfText, geom: ET.Element) -> Shape | None:
    """The shape of a geom, or None if a Mechanism has no such shape (mesh, plane, ellipsoid)."""
    if geom.get("type", "sphere") not in SIZES:
        return None
    kind, s, placement = solid(source, geom)
    rgba = floats(geom, "rgba", 4) or (0.5, 0.5, 0.5, 1.0)
    color: Color = (rgba[0], rgba[1], rgba[2], rgba[3])
    if kind == "box":
        return shape("box", placement, color, x=2 * s[0], y=2 * s[1], z=2 * s[2])
    if kind == "sphere":
        return shape("sphere", placement, color, radius=s[0])
    if kind == "cylinder":
        return shape("cylinder", placement, color, radius=s[0], length=2 * s[1])
    if kind == "capsule":
        return shape("rod", placement @ Placement((0.0, 0.0, -s[1])), color, radius=s[0], length=2 * s[1])
    return None


def geom_inertia(source: MjcfText, geom: ET.Element) -> Inertia:
    """Inertia of a primitive geom from its mass or density, in the body frame."""
    refuse(geom, "shellinertia", "fluidshape")
    kind = geom.get("type", "sphere")
    mass = one(geom, "mass", -1.0)
    if mass == 0.0 or (mass < 0.0 and one(geom, "density", 1000.0) == 0.0):
        return Inertia()
    if kind not in SIZES:
        raise fail(geom, f"the mass of a {kind} cannot be read from the text; give its body an <inertial>.")
    kind, s, placement = solid(source, geom)
    volume, moments = _uniform(kind, s)
    if mass < 0.0:
        mass = one(geom, "density", 1000.0) * volume
    xx, yy, zz = (mass * k for k in moments)
    return Inertia(mass, (0.0, 0.0, 0.0), (xx, yy, zz, 0.0, 0.0, 0.0)).at(placement.position, placement.rotation)


def _uniform(kind: str, s: tuple[float, ...]) -> tuple[float, tuple[float, float, float]]:
    """Volume and moments per mass of a uniform solid."""
    if kind in ("box", "ellipsoid"):
        a, b, c = s
        k = 3.0 if kind == "box" else 5.0
        volume = 8.0 * a * b * c if kind == "box" else 4.0 / 3.0 * math.pi * a * b * c
        return volume, ((b * b + c * c) / k, (a * a + c * c) / k, (a * a + b * b) / k)
    r = s[0]
    ball = 4.0 / 3.0 * math.pi * r * r * r
    if kind == "sphere":
        return ball, (0.4 * r * r,) * 3
    half = s[1]
    tube = 2.0 * math.pi * r * r * half
    across, axial = (3.0 * r * r + 4.0 * half * half) / 12.0, r * r / 2.0
    if kind == "cylinder":
        return tube, (across, across, axial)
    # a capsule: two half balls, whose centres lie 3 r / 8 outside the ends of the cylinder
    volume = tube + ball
    caps = 0.4 * r * r + half * half + 0.75 * r * half
    side = (tube * across + ball * caps) / volume
    return volume, (side, side, (tube * axial + ball * 0.4 * r * r) / volume)


KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "spherical"}
PASSIVE = {"damping": "damping", "armature": "armature", "friction": "frictionloss", "stiffness": "stiffness"}
SKIPPED = ("light", "camera", "geom", "site", "inertial", "joint", "freejoint", "body")


@dataclass
class BodyTree:
    """The tree as read: bodies depth-first, sites, connector bodies, the reference angle of each joint."""

    bodies: list[Body] = field(default_factory=list)
    ground_shapes: list[Shape] = field(default_factory=list)
    sites: dict[str, tuple[str, Placement]] = field(default_factory=dict)
    connectors: dict[str, tuple[str, tuple[str, ...]]] = field(default_factory=dict)
    ref: dict[str, float] = field(default_factory=dict)
    spring_at: dict[str, float] = field(default_factory=dict)
    zero: dict[str, float] = field(default_factory=dict)
    range: dict[str, tuple[float, float]] = field(default_factory=dict)
    body_names: Names = field(default_factory=lambda: Names("body"))
    joint_names: Names = field(default_factory=lambda: Names("joint"))
    frame_of: dict[str, Placement] = field(default_factory=dict)
    """MJCF body frame in the frame of the body of the Mechanism, which stands at its joints."""

    def restore(self, body: str, connectors: int) -> None:
        """Give a body back the inertia that its connector bodies took; `connectors`: their number."""
        k = next(i for i, b in enumerate(self.bodies) if b.name == body)
        self.bodies[k] = replace(self.bodies[k], inertia=scaled(self.bodies[k].inertia, 1.0 + connectors))


@dataclass(frozen=True)
class PlacedJoint:
    """The joints of a Mechanism that stand for one joint of the file, and where it acts in the frame of its body there."""

    joint: tuple[Joint, ...]
    pos: Vector


def read_tree(source: MjcfText) -> BodyTree:
    """The bodies of the text. The one fixed body `base` at the origin is the ground."""
    tree = BodyTree()
    tree.body_names.given["world"] = GROUND
    tree.frame_of[GROUND] = IDENTITY
    for world in source.section("worldbody"):
        _content(source, tree, world, GROUND, IDENTITY, None)
    return tree


def _content(
    source: MjcfText, tree: BodyTree, element: ET.Element, name: str, inner: Placement, childclass: str | None
) -> tuple[Inertia, list[Shape]]:
    """Geoms, sites and child bodies of an element; `inner` is its frame in the frame of body `name`."""
    inertia, shapes = Inertia(), []
    for child in element:
        if child.tag not in SKIPPED:
            raise fail(child, "mechlab does not read this element; flatten the model (save it from MuJoCo) first.")
        if child.tag == "geom":
            geom = source.attributes(child, childclass)
            found = geom_shape(source, geom)
            if found is not None:
                shapes.append(replace(found, placement=inner @ found.placement))
            if name != GROUND and element.find("inertial") is None and source.inertia_from_geoms != "false":
                inertia += geom_inertia(source, geom).at(inner.position, inner.rotation)
        elif child.tag == "site" and child.get("name"):
            site = source.attributes(child, childclass)
            tree.sites[child.get("name", "")] = (name, inner @ source.placement(site))
        elif child.tag == "body":
            _body(source, tree, child, name, inner, childclass, ())
    if name == GROUND:
        tree.ground_shapes += shapes
    return inertia, shapes


def _is_base(element: ET.Element, parent: str, placement: Placement) -> bool:
    own = {"name": BASE}
    fixed = all(element.find(t) is None for t in ("joint", "freejoint", "inertial"))
    return parent == GROUND and element.attrib == own and fixed and placement == IDENTITY


def _body(
    source: MjcfText, tree: BodyTree, element: ET.Element, parent: str, outer: Placement, childclass: str | None,
    before: tuple[PlacedJoint, ...],
) -> None:  # fmt: skip
    refuse(element, "gravcomp", "mocap")
    childclass = element.get("childclass") or childclass
    placement = outer @ source.placement(element)
    given = element.get("name") or ""
    if _is_base(element, parent, placement):
        tree.body_names.given[BASE] = GROUND
        _content(source, tree, element, GROUND, IDENTITY, childclass)
        return
    if source.ours and given.endswith(":connector"):
        kinds = tuple(KINDS.get(j.get("type", "hinge"), "") for j in element.findall("joint"))
        tree.connectors[given.removesuffix(":connector")] = (parent, kinds)
        return
    if source.ours and given.endswith(":holder"):
        _content(source, tree, element, parent, placement, childclass)
        return
    joints = (*before, *_joints(source, tree, element, childclass, given))
    if source.ours and ":stage" in given:
        child = element.find("body")
        if child is None:
            raise fail(element, "a stage of a body must carry it.")
        _body(source, tree, child, parent, placement, childclass, joints)
        return
    name = tree.body_names.add(given.removesuffix(":body") or None)
    tree.body_names.given[given] = name
    parent, placement, inner, own = anchored(tree, name, parent, placement, joints)
    tree.frame_of[name] = inner
    slot = len(tree.bodies)
    tree.bodies.append(Body(name, parent, placement, own))
    inertia, shapes = _content(source, tree, element, name, inner, childclass)
    written = element.find("inertial")
    if written is not None and source.inertia_from_geoms != "true":
        inertia = _inertial(source, written).at(inner.position, inner.rotation) if inner != IDENTITY else _inertial(
            source, written
        )  # fmt: skip
    tree.bodies[slot] = replace(tree.bodies[slot], inertia=inertia, shapes=tuple(shapes))


def anchored(
    tree: BodyTree, name: str, parent: str, placement: Placement, joints: tuple[PlacedJoint, ...]
) -> tuple[str, Placement, Placement, tuple[Joint, ...]]:
    """Parent, placement, MJCF frame and joints of a body whose joints act off its origin: the body frame moves to the
    joints; joints at different points get bodies in between."""
    groups: list[tuple[Vector, list[Joint]]] = []
    for item in joints:
        slides = all(j.kind == "prismatic" for j in item.joint)
        if groups and (slides or item.pos == groups[-1][0]):
            groups[-1][1].extend(item.joint)
        else:
            groups.append(((0.0, 0.0, 0.0) if slides else item.pos, list(item.joint)))
    if len(groups) > 1 and all(j.kind == "prismatic" for j in groups[0][1]):
        groups[1] = (groups[1][0], groups[0][1] + groups[1][1])
        groups = groups[1:]
    at: Vector = (0.0, 0.0, 0.0)
    for k, (pos, group) in enumerate(groups):
        step = Placement((pos[0] - at[0], pos[1] - at[1], pos[2] - at[2]))
        placement, at = placement @ step, pos
        if k < len(groups) - 1:
            between = tree.body_names.add(f"{name}.{k + 1}")
            tree.bodies.append(Body(between, parent, placement, tuple(group)))
            parent, placement = between, IDENTITY
    inner = IDENTITY if not any(at) else Placement((-at[0], -at[1], -at[2]))
    return parent, placement, inner, tuple(groups[-1][1]) if groups else ()


def _joints(
    source: MjcfText, tree: BodyTree, element: ET.Element, childclass: str | None, body: str
) -> list[PlacedJoint]:
    out = []
    for child in element:
        if child.tag == "freejoint" or (child.tag == "joint" and child.get("type") == "free"):
            name = tree.joint_names.add(child.get("name"), f"{body or 'body'}_free")
            e = source.attributes(child, childclass) if child.tag == "joint" else child
            passive = {key: one(e, word) for key, word in PASSIVE.items() if one(e, word)}
            out.append(PlacedJoint(tuple(replace(j, **passive) for j in floating(name)), (0.0, 0.0, 0.0)))  # type: ignore[arg-type]
        elif child.tag == "joint":
            out.append(_joint(source, tree, source.attributes(child, childclass)))
    return out


def _joint(source: MjcfText, tree: BodyTree, e: ET.Element) -> PlacedJoint:
    refuse(e, "springdamper", "actuatorfrcrange", "actuatorgravcomp")
    kind = e.get("type", "hinge")
    if kind not in KINDS:
        raise fail(e, f"unknown joint type {kind!r}.")
    name = tree.joint_names.add(e.get("name"))
    angle = source.angle if kind == "hinge" else 1.0
    ref = one(e, "ref") * angle
    user = floats(e, "user") or ()
    zero = user[0] if source.ours and user else ref
    pos = floats(e, "pos", 3) or (0.0, 0.0, 0.0)
    axis = floats(e, "axis", 3) or (0.0, 0.0, 1.0)
    spring_at = one(e, "springref") * angle
    limits = floats(e, "range", 2)
    if e.get("limited", "auto") == "false" or (e.get("limited", "auto") == "auto" and not source.autolimits):
        limits = None
    shift = zero - ref
    if kind == "ball":
        angle = source.angle
    tree.ref[name], tree.spring_at[name], tree.zero[name] = ref, spring_at, zero
    if limits is not None:
        tree.range[name] = (limits[0] * angle, limits[1] * angle)
    joint = Joint(
        name, KINDS[kind], (0.0, 0.0, 1.0) if kind == "ball" else unit(axis, f"joint {name!r}: axis"), zero,
        None if limits is None else (limits[0] * angle + shift, limits[1] * angle + shift),
        one(e, "damping"), one(e, "armature"), one(e, "frictionloss"), one(e, "stiffness"),
        spring_at + shift if one(e, "stiffness") and kind != "ball" else 0.0,
    )  # fmt: skip
    return PlacedJoint((joint,), (pos[0], pos[1], pos[2]))


def _inertial(source: MjcfText, e: ET.Element) -> Inertia:
    placement = source.placement(e)
    mass = one(e, "mass")
    full = floats(e, "fullinertia", 6)
    if full is not None:
        return Inertia(mass, placement.position, (full[0], full[1], full[2], full[3], full[4], full[5]))
    principal = np.diag(floats(e, "diaginertia", 3) or (0.0, 0.0, 0.0))
    if source.ours and mass <= 2e-15:
        return Inertia()
    if placement.quaternion != IDENTITY.quaternion:
        principal = placement.rotation @ principal @ placement.rotation.T
    t = principal
    return Inertia(mass, placement.position, (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]))
