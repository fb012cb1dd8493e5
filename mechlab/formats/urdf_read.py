"""URDF text -> Mechanism: a tree; mimics become relations. What URDF cannot describe (loops, gears) is in the JSON.

The root link is the ground: its mass does not matter. Fixed links without mass, visuals and children become frames.
Meshes are left out: a Mechanism's shapes are made from parameters. The physical value of a joint is that in the URDF.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.formats.json_text import exact
from mechlab.formats.mjcf.source import clean, fail
from mechlab.formats.soundness import sound
from mechlab.formats.urdf import MASSLESS
from mechlab.formats.xml_text import floats
from mechlab.mechanism.geometry import IDENTITY, Array, Placement, axis_rotation, unit
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Color, Frame, Joint, LinearRelation, Shape, floating
from mechlab.mechanism.tree import depth_first

KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
UNLIMITED = 1e8  # a wider range counts as none: `to_urdf` writes 1e9 for a joint without range


def from_urdf(content: str) -> Mechanism:
    """The Mechanism in a URDF text; raises MechlabError that names what it cannot read."""
    root = sound(content, "robot", "URDF file")
    links = _named(root, "link")
    joints = _named(root, "joint")
    above: dict[str, ET.Element] = {}
    for joint in joints.values():
        child = _end(joint, "child", links)
        _end(joint, "parent", links)
        if child in above:
            raise fail(joint, f"link {child!r} already hangs on joint {above[child].get('name')!r}.")
        above[child] = joint
    roots = [n for n in links if n not in above]
    if len(roots) != 1:
        raise MechlabError(
            f"a URDF has exactly one root link; this one has {len(roots)}: {', '.join(roots) or 'a cycle'}."
        )
    colors = {m.get("name", ""): c for m in root.findall("material") if (c := _rgba(m)) is not None}
    zeros = {name: _zero(joints, name, ()) for name in joints}
    parents = {_end(j, "parent", links) for j in joints.values()}
    bodies: list[Body] = []
    frames: list[Frame] = []
    for name, joint in ((n, above[n]) for n in links if n in above):
        parent = _end(joint, "parent", links)
        parent = GROUND if parent == roots[0] else clean(parent)
        bare = joint.get("type") == "fixed" and not len(links[name]) and name not in parents
        if bare:
            frames.append(Frame(clean(name), parent, _origin(joint)))
        else:
            bodies.append(_body(links[name], joint, parent, zeros[joint.get("name", "")], colors))
    return Mechanism(
        name=clean(root.get("name") or "robot"),
        bodies=depth_first(bodies),
        relations=tuple(_relation(j) for j in joints.values() if j.find("mimic") is not None),
        frames=tuple(frames),
        ground_shapes=tuple(_shapes(links[roots[0]], colors)),
    )


def _named(root: ET.Element, tag: str) -> dict[str, ET.Element]:
    out: dict[str, ET.Element] = {}
    for element in root.findall(tag):
        name = element.get("name")
        if not name or name in out:
            raise fail(element, "every link and joint needs a name of its own.")
        out[name] = element
    return out


def _end(joint: ET.Element, tag: str, links: dict[str, ET.Element]) -> str:
    element = joint.find(tag)
    name = None if element is None else element.get("link")
    if name is None or name not in links:
        raise unknown(f"joint {joint.get('name')!r}: {tag} link", name, links)
    return name


def _zero(joints: dict[str, ET.Element], name: str, seen: tuple[str, ...]) -> float:
    """Value of a joint when all independent joints are 0: the offset of its mimic."""
    if name in seen:
        raise MechlabError(f"the mimics form a cycle: {' -> '.join([*seen, name])}.")
    mimic = joints[name].find("mimic")
    if mimic is None:
        return 0.0
    leader = mimic.get("joint")
    if leader not in joints:
        raise unknown(f"joint {name!r}: mimic joint", leader, joints)
    return _value(mimic, "multiplier", 1.0) * _zero(joints, leader, (*seen, name)) + _value(mimic, "offset", 0.0)


def _value(element: ET.Element, key: str, default: float) -> float:
    values = floats(element, key, 1)
    return default if values is None else values[0]


def _relation(joint: ET.Element) -> LinearRelation:
    mimic = joint.find("mimic")
    assert mimic is not None
    name, ratio = clean(joint.get("name", "")), _value(mimic, "multiplier", 1.0)
    if ratio == 0.0:
        raise fail(joint, "a mimic with the multiplier 0 locks its joint; make the joint fixed.")
    terms = ((name, exact(1.0)), (clean(mimic.get("joint", "")), -exact(ratio)))
    return LinearRelation(f"{name}_mimic", terms, "mimic")


def _body(link: ET.Element, joint: ET.Element, parent: str, zero: float, colors: dict[str, Color]) -> Body:
    kind, name = joint.get("type"), clean(joint.get("name", ""))
    placement = _origin(joint)
    own: tuple[Joint, ...] = ()
    if kind == "floating":
        own = floating(name)
    elif kind in KINDS:
        own = (_joint(joint, name, zero),)
        if zero:
            turn, slide = (zero, 0.0) if KINDS[kind] == "revolute" else (0.0, zero)
            axis = np.array(own[0].axis)
            placement = placement @ Placement.of(axis_rotation(axis, turn), slide * axis)
    elif kind != "fixed":
        raise fail(joint, f"joints of type {kind!r} are not read; mechlab reads {', '.join(KINDS)}, fixed, floating.")
    return Body(clean(link.get("name", "")), parent, placement, own, _inertia(link), tuple(_shapes(link, colors)))


def _joint(joint: ET.Element, name: str, zero: float) -> Joint:
    axis, limit, dynamics = joint.find("axis"), joint.find("limit"), joint.find("dynamics")
    direction = (None if axis is None else floats(axis, "xyz", 3)) or (1.0, 0.0, 0.0)
    limits = None
    if limit is not None and joint.get("type") != "continuous":
        low, high = _value(limit, "lower", 0.0), _value(limit, "upper", 0.0)
        if low < high and max(-low, high) < UNLIMITED:
            limits = (low, high)
    damping = 0.0 if dynamics is None else _value(dynamics, "damping", 0.0)
    friction = 0.0 if dynamics is None else _value(dynamics, "friction", 0.0)
    kind = KINDS[joint.get("type", "")]
    return Joint(name, kind, unit(direction, f"joint {name!r}: axis"), zero, limits, damping, 0.0, friction)


def _origin(element: ET.Element) -> Placement:
    origin = element.find("origin")
    if origin is None:
        return IDENTITY
    x, y, z = floats(origin, "xyz", 3) or (0.0, 0.0, 0.0)
    roll, pitch, yaw = floats(origin, "rpy", 3) or (0.0, 0.0, 0.0)
    return Placement((x, y, z), _quaternion(roll / 2.0, pitch / 2.0, yaw / 2.0))


def _quaternion(r: float, p: float, y: float) -> tuple[float, float, float, float]:
    """(w, x, y, z) of Rz Ry Rx, from half angles."""
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    w, x = cy * cp * cr + sy * sp * sr, cy * cp * sr - sy * sp * cr
    return (w, x, cy * sp * cr + sy * cp * sr, sy * cp * cr - cy * sp * sr)


def _inertia(link: ET.Element) -> Inertia:
    section = link.find("inertial")
    if section is None:
        return Inertia()
    placement = _origin(section)
    mass_element, tensor = section.find("mass"), section.find("inertia")
    mass = 0.0 if mass_element is None else _value(mass_element, "value", 0.0)
    if mass <= MASSLESS:
        return Inertia()
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    t = [0.0 if tensor is None else _value(tensor, k, 0.0) for k in keys]
    try:
        own = Inertia(mass, (0.0, 0.0, 0.0), (t[0], t[1], t[2], t[3], t[4], t[5]))
    except MechlabError as error:
        raise fail(link, str(error)) from None
    turned: Array | None = None if placement.quaternion == IDENTITY.quaternion else placement.rotation
    return Inertia(mass, placement.position, own.tensor) if turned is None else own.at(placement.position, turned)


def _shapes(link: ET.Element, colors: dict[str, Color]) -> list[Shape]:
    out = []
    for visual in link.findall("visual"):
        geometry, material = visual.find("geometry"), visual.find("material")
        color = None
        if material is not None:
            color = _rgba(material) or colors.get(material.get("name", ""))
        for solid in () if geometry is None else geometry:
            size: dict[str, float] = {}
            if solid.tag == "box":
                size = dict(zip("xyz", floats(solid, "size", 3) or (0.0, 0.0, 0.0), strict=True))
            elif solid.tag in ("cylinder", "sphere"):
                size = {k: _value(solid, k, 0.0) for k in ("radius", "length") if k in solid.attrib}
            if size:
                out.append(Shape(solid.tag, tuple(sorted(size.items())), _origin(visual), color or Shape.color))
    return out


def _rgba(material: ET.Element) -> Color | None:
    element = material.find("color")
    values = None if element is None else floats(element, "rgba", 4)
    return None if values is None else (values[0], values[1], values[2], values[3])
