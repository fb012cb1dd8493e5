"""The loops that a URDF text itself declares, in each of the ways that are in use.

* a link that two joints end in, as in SDF
* `<loop_joint name type> <link1 link xyz rpy/> <link2 link xyz rpy/> <axis xyz/>` (Isaac Sim, older Drake)
* `<loop name type> <predecessor link> <origin/> ... <successor link> <origin/>` (URDF+)
* `<constraint name type> <parent link/> <parent_origin/> <parent_axis/> <child .../>` (proposed for ROS, urdfdom#264)
* `<gazebo> <joint name type> <parent> <child> <pose> <axis> <xyz>`, SDF inside of a URDF
* frames closing_NAME_1 and closing_NAME_2 (onshape-to-robot, placo), which are to coincide
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.formats.mjcf.source import clean, fail
from mechlab.formats.urdf_source import UrdfText, origin_of, placement_of
from mechlab.formats.xml_text import floats, label
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Placement, frame_along, unit
from mechlab.mechanism.parts import Loop

LOOP_KINDS = {
    "revolute": "revolute", "continuous": "revolute", "hinge": "revolute", "prismatic": "prismatic", "fixed": "fixed", "weld": "fixed",
    "spherical": "spherical", "ball": "spherical", "universal": "universal", "cylindrical": "cylindrical",
}  # fmt: skip
AXIAL = ("revolute", "prismatic", "cylindrical")
CLOSING = re.compile(r"^closing_(.+)_([12ab])$", re.IGNORECASE)


@dataclass(frozen=True)
class Closure:
    """A Loop as a file declares it, and where: "robot.yaml", "<constraint>"; `left`: what of it a Loop has no place for."""

    loop: Loop
    source: str
    left: tuple[str, ...] = ()


def declared(text: UrdfText) -> list[Closure]:
    """The loops that the elements of a URDF declare; raises MechlabError that names the element it cannot read."""
    found = [_second_parent(text, joint) for joint in text.closing]
    for element in text.root:
        if element.tag == "loop_joint":
            found.append(_between(text, element, ("link1", "link2"), ("parent", "child")))
        elif element.tag == "loop":
            found.append(_between(text, element, ("predecessor", "successor"), ("parent", "child")))
        elif element.tag == "constraint":
            found.append(_constraint(text, element))
        elif element.tag == "gazebo":
            found += [_sdf_joint(text, joint) for joint in element.findall("joint") if joint.find("parent") is not None]
    return found


def closing_frames(text: UrdfText) -> list[Closure]:
    """The loops that pairs of frames closing_NAME_1, closing_NAME_2 mean: the two points coincide."""
    return [Closure(point_loop(text, f"closing_{name}", a, b, "closing_ frames"), "closing_ frames") for name, a, b in closing_pairs(text)]


def closing_pairs(text: UrdfText) -> Iterator[tuple[str, str, str]]:
    """NAME and the two links of each pair of closing frames."""
    sides: dict[str, dict[str, str]] = {}
    for link in text.links:
        match = CLOSING.match(link)
        if match:
            sides.setdefault(match[1], {})[{"a": "1", "b": "2"}.get(match[2].lower(), match[2])] = link
    for name, ends in sides.items():
        if len(ends) == 2:
            yield name, ends["1"], ends["2"]


def point_loop(text: UrdfText, name: str, a: str, b: str, what: str, kind: str = "spherical") -> Loop:
    """The loop in which the frames of two links or joints coincide: in their origin (spherical) or wholly (fixed)."""
    body_a, placement_a = text.place(a, what)
    body_b, placement_b = text.place(b, what)
    return Loop(clean(name), kind, body_a, body_b, placement_a, placement_b)


def _kind(element: ET.Element) -> str:
    given = element.get("type", "")
    if given.lower() not in LOOP_KINDS:
        raise unknown(f"{label(element)}: type of a loop", given, LOOP_KINDS)
    return LOOP_KINDS[given.lower()]


def _turned(placement: Placement, axis: Sequence[float] | None, kind: str, what: str) -> Placement:
    """The placement with its local z along the axis, which is given in the frame of the placement."""
    if kind not in AXIAL:
        return placement
    return placement @ Placement.of(frame_along(np.array(unit(axis or (1.0, 0.0, 0.0), what))), (0.0, 0.0, 0.0))


def _second_parent(text: UrdfText, joint: ET.Element) -> Closure:
    name = joint.get("name", "")
    kind = _kind(joint)
    axis = joint.find("axis")
    direction = None if axis is None else floats(axis, "xyz", 3)
    what = f"joint {name!r}"
    parent, placement = text.place(text.parent[name], what)
    child, end = text.place(text.child[name], what)
    ends = (_turned(placement @ origin_of(joint), direction, kind, f"{what}: axis"), _turned(end, direction, kind, f"{what}: axis"))
    left = tuple(f"{tag} of {name}" for tag in ("limit", "dynamics", "mimic") if joint.find(tag) is not None)
    return Closure(Loop(clean(name), kind, parent, child, *ends), f"joint {name!r}, a second parent of link {text.child[name]!r}", left)


def _side(element: ET.Element, tags: Sequence[str]) -> ET.Element:
    found = next((x for tag in tags if (x := element.find(tag)) is not None), None)
    if found is None or found.get("link") is None:
        raise fail(element, f"it needs <{tags[0]} link=.../>; a loop has two ends.")
    return found


def _between(text: UrdfText, element: ET.Element, first: tuple[str, str], second: tuple[str, str]) -> Closure:
    """<loop_joint> and <loop>: two ends with an origin each, in attributes or in <origin>; one axis."""
    kind = _kind(element)
    what = label(element)
    sides = list(element.findall(first[0])) if first[0] == "link1" and element.find("link2") is None else []
    if len(sides) != 2:  # a writer in use writes both ends as <link1>
        sides = [_side(element, (first[0], second[0])), _side(element, (first[1], second[1]))]
    axis = element.find("axis")
    direction = None if axis is None else floats(axis, "xyz", 3)
    ends = []
    for side in sides:
        body, placement = text.place(side.get("link", ""), what)
        own = placement_of(side) if side.find("origin") is None else origin_of(side)
        ends.append((body, placement, own))
    if element.find("origin") is not None:  # URDF+ with one origin: that of the loop frame in the predecessor
        ends[0] = (ends[0][0], ends[0][1], origin_of(element))
    placed = [_turned(placement @ own, direction, kind, f"{what}: axis") for _, placement, own in ends]
    name = clean(element.get("name") or f"{ends[0][0]}_{ends[1][0]}")
    return Closure(Loop(name, kind, ends[0][0], ends[1][0], placed[0], placed[1]), f"<{element.tag}>")


def _constraint(text: UrdfText, element: ET.Element) -> Closure:
    """<constraint>: an origin and an axis for each of the two links; two axes of a universal joint."""
    if element.find("parent") is None or element.find("parent_origin") is None and element.find("predecessor") is not None:
        return _between(text, element, ("predecessor", "successor"), ("parent", "child"))
    kind, what = _kind(element), label(element)
    ends = []
    for side in ("parent", "child"):
        body, placement = text.place(_side(element, (side,)).get("link", ""), what)
        origin, axis = element.find(f"{side}_origin"), element.find(f"{side}_axis")
        own = IDENTITY if origin is None else placement_of(origin)
        ends.append((body, placement @ own, None if axis is None else floats(axis, "xyz", 3)))
    directions = [ends[0][2] or ends[1][2], ends[1][2] or ends[0][2]]
    placed = [_turned(p, d, kind, f"{what}: axis") for (_, p, _), d in zip(ends, directions, strict=True)]
    if kind == "universal":
        placed = _universal(placed, directions, what)
    name = clean(element.get("name") or "constraint")
    return Closure(Loop(name, kind, ends[0][0], ends[1][0], placed[0], placed[1]), "<constraint>")


def _universal(placed: list[Placement], directions: list[tuple[float, ...] | None], what: str) -> list[Placement]:
    """Ends of a universal loop: its pins lie along x of the first and y of the second placement."""
    out = []
    for placement, direction, column in zip(placed, directions, (0, 1), strict=True):
        if direction is None:
            raise MechlabError(f"{what}: a universal joint needs <parent_axis> and <child_axis>, its two pins.")
        z = frame_along(unit(direction, f"{what}: axis"))
        columns = [z[:, 2], z[:, 0], z[:, 1]] if column == 0 else [z[:, 1], z[:, 2], z[:, 0]]
        out.append(placement @ Placement.of(np.column_stack(columns), (0.0, 0.0, 0.0)))
    return out


def _sdf_joint(text: UrdfText, joint: ET.Element) -> Closure:
    """An SDF joint inside of <gazebo>: its pose stands in the child link, its axis in that pose."""
    kind, what = _kind(joint), label(joint)
    names = [(joint.findtext(tag) or "").strip() for tag in ("parent", "child")]
    parent, first = text.place(names[0], what)
    child, second = text.place(names[1], what)
    pose = _numbers_in(joint, "pose", (0.0,) * 6)
    own = placement_of(ET.Element("origin", xyz=" ".join(map(str, pose[:3])), rpy=" ".join(map(str, pose[3:]))))
    axis = _numbers_in(joint, "axis/xyz", (0.0, 0.0, 1.0))
    end = _turned(second @ own, axis, kind, f"{what}: axis")
    start = _turned(first @ in_parent(text, names[0], names[1]) @ own, axis, kind, f"{what}: axis")
    return Closure(Loop(clean(joint.get("name") or "loop"), kind, parent, child, start, end), "<joint> in <gazebo>")


def _numbers_in(joint: ET.Element, path: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """The numbers that an element of an SDF joint has as its text; raises MechlabError that names the joint and the element."""
    written = ET.Element("joint", {"name": joint.get("name", ""), path: joint.findtext(path) or ""})
    return floats(written, path, len(default)) or default


def in_parent(text: UrdfText, parent: str, child: str) -> Placement:
    """Placement of one link in another in the zero pose of the file."""
    return _world(text, parent).inverse() @ _world(text, child)


def _world(text: UrdfText, link: str) -> Placement:
    link = link if link in text.links else text.child[link]
    out = IDENTITY
    while link in text.above:
        joint = text.above[link]
        out = origin_of(joint) @ out
        link = text.parent[joint.get("name", "")]
    return out
