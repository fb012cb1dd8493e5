"""The bodies, frames and mimics of a parsed URDF; `mechlab.formats.urdf_file` makes a Mechanism of them and closes its loops.

The root link is the ground: its mass does not matter. Fixed links without shapes, children and mass become frames.
Meshes are those that `urdf_meshes` found. The physical value of a joint is that in the URDF.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.formats.json_text import exact
from mechlab.formats.mjcf.source import fail
from mechlab.formats.urdf import MASSLESS
from mechlab.formats.urdf_meshes import Surfaces, key_of
from mechlab.formats.urdf_source import KINDS, UrdfText, number_of, origin_of
from mechlab.formats.xml_text import floats
from mechlab.mechanism.geometry import IDENTITY, Array, Placement, axis_rotation, unit
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.parts import Body, Color, Frame, Joint, LinearRelation, Shape, floating, revolute
from mechlab.tables import listed

Tensor = tuple[float, float, float, float, float, float]
UNLIMITED = 1e8  # a wider range counts as none: `to_urdf` writes 1e9 for a joint without range
SWAPS = ("SPHERICAL", "FIXED", *(f"UJOINT_{a}{b}" for a in "XYZ" for b in "XYZ" if a != b))
"""Joint types that an Extended URDF puts in the place of a joint of the URDF."""


def bodies_of(text: UrdfText, swaps: Mapping[str, str]) -> list[Body]:
    """The bodies, in the order of the links; `swaps`: joint -> one of SWAPS, which takes its place."""
    colors = _colors(text)
    zeros = {name: _zero(text.joints, name, ()) for name in text.joints}
    bodies, raised = [], list[str]()
    for link in text.links:
        joint = text.above.get(link)
        if joint is None or link in text.bare:
            continue
        name = joint.get("name", "")
        own, placement = _motion(text, joint, swaps.get(name, ""), zeros[name])
        parent = text.bodies[text.parent[name]]
        element = text.links[link]
        shapes = tuple(_shapes(element, colors, text.surfaces))
        bodies.append(Body(text.bodies[link], parent, placement, own, _inertia(element, raised), shapes))
    if raised:
        words = "no body has moments of inertia as written (negative, or above the sum of the two others); they were raised"
        text.notes.append(f"{words}: {listed(raised, 6)}")
    return bodies


def frames_of(text: UrdfText) -> tuple[Frame, ...]:
    """The fixed links that only mark a place."""
    return tuple(Frame(text.bodies[name], *text.place(name, name)) for name in text.links if name in text.bare)


def ground_shapes_of(text: UrdfText) -> tuple[Shape, ...]:
    """The shapes of the root link."""
    return tuple(_shapes(text.links[text.ground], _colors(text), text.surfaces))


def relations_of(text: UrdfText, swaps: Mapping[str, str]) -> tuple[LinearRelation, ...]:
    """The mimics of the joints in the tree."""
    tree = [j for j in text.above.values() if j.find("mimic") is not None and j.get("type") != "fixed"]
    return tuple(_relation(text, j, swaps) for j in tree)


def _colors(text: UrdfText) -> dict[str, Color]:
    return {m.get("name", ""): c for m in text.root.findall("material") if (c := _rgba(m)) is not None}


def _zero(joints: Mapping[str, ET.Element], name: str, seen: tuple[str, ...]) -> float:
    """Value of a joint when all independent joints are 0: the offset of its mimic."""
    if name in seen:
        raise MechlabError(f"the mimics form a cycle: {' -> '.join([*seen, name])}; one of these joints must be independent.")
    mimic = joints[name].find("mimic")
    if mimic is None:
        return 0.0
    leader = mimic.get("joint")
    if leader is None or leader not in joints:
        raise unknown(f"joint {name!r}: mimic joint", leader, joints)
    return number_of(mimic, "multiplier", 1.0) * _zero(joints, leader, (*seen, name)) + number_of(mimic, "offset", 0.0)


def _relation(text: UrdfText, joint: ET.Element, swaps: Mapping[str, str]) -> LinearRelation:
    mimic = joint.find("mimic")
    assert mimic is not None
    own, leader = joint.get("name", ""), mimic.get("joint", "")
    for end in (own, leader):
        if end in swaps or text.joints[end] in text.closing or text.joints[end].get("type") not in KINDS:
            raise fail(joint, f"a mimic couples two joints with one coordinate each; {end!r} is none.")
    ratio = number_of(mimic, "multiplier", 1.0)
    if ratio == 0.0:
        raise fail(joint, "a mimic with the multiplier 0 locks its joint; make the joint fixed.")
    name = text.joint_names[own]
    terms = ((name, exact(1.0)), (text.joint_names[leader], -exact(ratio)))
    return LinearRelation(f"{name}_mimic", terms, "mimic")


def _motion(text: UrdfText, joint: ET.Element, swap: str, zero: float) -> tuple[tuple[Joint, ...], Placement]:
    """The joints of a link and the placement of its body."""
    name, kind, placement = text.joint_names[joint.get("name", "")], joint.get("type"), origin_of(joint)
    if swap == "SPHERICAL":
        return (Joint(name, "spherical", damping=_damping(joint)[0]),), placement
    if swap.startswith("UJOINT"):
        return tuple(revolute(f"{name}_{a}", a.lower()) for a in swap[-2:]), placement
    if kind == "floating" and not swap:
        return floating(name), placement
    if kind in KINDS and not swap:
        own = _joint(joint, name, zero)
        if zero:
            turn, slide = (zero, 0.0) if KINDS[kind] == "revolute" else (0.0, zero)
            axis = np.array(own.axis)
            placement = placement @ Placement.of(axis_rotation(axis, turn), slide * axis)
        return (own,), placement
    if kind != "fixed" and swap != "FIXED":
        raise fail(joint, f"joints of type {kind!r} are not read; mechlab reads {', '.join(KINDS)}, fixed, floating.")
    return (), placement


def _joint(joint: ET.Element, name: str, zero: float) -> Joint:
    axis, limit = joint.find("axis"), joint.find("limit")
    direction = (None if axis is None else floats(axis, "xyz", 3)) or (1.0, 0.0, 0.0)
    limits = None
    if limit is not None and joint.get("type") != "continuous":
        low, high = number_of(limit, "lower", 0.0), number_of(limit, "upper", 0.0)
        if low < high and max(-low, high) < UNLIMITED:
            limits = (low, high)
    damping, friction = _damping(joint)
    kind = KINDS[joint.get("type", "")]
    return Joint(name, kind, unit(direction, f"joint {name!r}: axis"), zero, limits, damping, 0.0, friction)


def _damping(joint: ET.Element) -> tuple[float, float]:
    """Damping and dry friction of a joint."""
    dynamics = joint.find("dynamics")
    if dynamics is None:
        return 0.0, 0.0
    return number_of(dynamics, "damping", 0.0), number_of(dynamics, "friction", 0.0)


def _inertia(link: ET.Element, raised: list[str]) -> Inertia:
    section = link.find("inertial")
    if section is None:
        return Inertia()
    placement = origin_of(section)
    mass_element, tensor = section.find("mass"), section.find("inertia")
    mass = 0.0 if mass_element is None else number_of(mass_element, "value", 0.0)
    if mass <= MASSLESS:
        return Inertia()
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    t = [0.0 if tensor is None else number_of(tensor, k, 0.0) for k in keys]
    try:
        own = Inertia(mass, (0.0, 0.0, 0.0), (t[0], t[1], t[2], t[3], t[4], t[5]))
    except MechlabError as error:
        given = (t[0], t[1], t[2], t[3], t[4], t[5])
        own = Inertia(mass, (0.0, 0.0, 0.0), _possible(given, mass, fail(link, str(error))))
        raised.append(f"{link.get('name')} (by at most {max(abs(a - b) for a, b in zip(own.tensor, given, strict=True)):.2g} kg m2)")
    turned: Array | None = None if placement.quaternion == IDENTITY.quaternion else placement.rotation
    return Inertia(mass, placement.position, own.tensor) if turned is None else own.at(placement.position, turned)


def _possible(t: Tensor, mass: float, error: MechlabError) -> Tensor:
    """The nearest tensor that a body can have: moments of at least 0, each at most the sum of the other two. Raises the error
    for a tensor that is more than that away from one, as by a wrong unit or order of its entries."""
    full = np.array([[t[0], t[3], t[4]], [t[3], t[1], t[5]], [t[4], t[5], t[2]]])
    moments, axes = np.linalg.eigh(full)
    if not np.all(np.isfinite(moments)) or moments[0] < -max(1e-6 * abs(float(moments[2])), 1e-15 * mass):
        raise error
    moments = np.maximum(moments, 0.0)
    short = max(0.0, float(moments[2] - moments[0] - moments[1]))
    moments[:2] += 0.5 * short * (1.0 + 1e-9) + 1e-12 * moments[2] * bool(short)
    out = axes @ np.diag(moments) @ axes.T
    return (float(out[0, 0]), float(out[1, 1]), float(out[2, 2]), float(out[0, 1]), float(out[0, 2]), float(out[1, 2]))


def _shapes(link: ET.Element, colors: dict[str, Color], surfaces: Surfaces) -> list[Shape]:
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
                size = {k: number_of(solid, k, 0.0) for k in ("radius", "length") if k in solid.attrib}
            if solid.tag == "mesh" and key_of(solid) in surfaces:
                out.append(replace(surfaces[key_of(solid)], placement=origin_of(visual), color=color or Shape.color))
            if size and min(size.values()) > 0.0:
                out.append(Shape(solid.tag, tuple(sorted(size.items())), origin_of(visual), color or Shape.color))
    return out


def _rgba(material: ET.Element) -> Color | None:
    element = material.find("color")
    values = None if element is None else floats(element, "rgba", 4)
    return None if values is None else (values[0], values[1], values[2], values[3])
