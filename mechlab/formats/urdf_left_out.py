"""What of a URDF a Mechanism does not hold, by name: meshes, contacts, transmissions, sensors, tags of other programs; and
names that suggest a loop which no file declares.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator

from mechlab.experiment.model_file import LeftOut
from mechlab.formats.urdf_meshes import key_of
from mechlab.formats.urdf_read import UNLIMITED
from mechlab.formats.urdf_source import UrdfText, number_of
from mechlab.tables import listed

READ = ("link", "joint", "material", "loop_joint", "loop", "constraint")
READ_IN_LINK = ("inertial", "visual", "collision")
READ_IN_JOINT = ("parent", "child", "origin", "axis", "limit", "dynamics", "mimic")
WHY = {
    "transmission": "motors are given to a run; the joint names are kept",
    "ros2_control": "motors are given to a run; the joint names are kept",
    "gazebo": "settings of another program",
    "mujoco": "settings of another program",
    "sensor": "mechlab has its own channels",
    "safety_controller": "a controller's limit",
    "calibration": "a controller's setting",
}
SUGGESTS = re.compile(r"^(.*?(?:clos(?:ed|ing|ure)|loop|fermeture).*?)[_-]?([ab12])$", re.IGNORECASE)


def left_out(text: UrdfText) -> tuple[LeftOut, ...]:
    """The elements that are not read, grouped by kind."""
    groups: dict[tuple[str, str], list[str]] = {}
    for what, name, why in _elements(text):
        groups.setdefault((what, why), []).append(name)
    return tuple(LeftOut(what, tuple(names), why) for (what, why), names in groups.items())


def _elements(text: UrdfText) -> Iterator[tuple[str, str, str]]:
    for k, element in enumerate(text.root):
        if element.tag not in READ and not _is_own(element) and not _is_loop(element):
            tag = plain(element.tag)
            name = element.get("name") or element.get("reference") or f"number {k + 1}"
            yield tag, name, WHY.get(tag, "mechlab does not read this tag")
    for name, link in text.links.items():
        yield from _of_link(text, name, link)
    for name, joint in text.joints.items():
        yield from _of_joint(name, joint)


def _of_link(text: UrdfText, name: str, link: ET.Element) -> Iterator[tuple[str, str, str]]:
    for part in link:
        solid = None if (geometry := part.find("geometry")) is None else next(iter(geometry), None)
        if part.tag == "collision":
            yield "collision", name, "contacts between parts are not modelled"
        elif part.tag == "visual" and solid is not None and solid.tag == "mesh":
            if key_of(solid) not in text.surfaces:
                file = solid.get("filename", name)
                yield "mesh", file, text.unread.get(file, "it names no file") + "; the part is drawn as lines"
        elif part.tag == "visual" and solid is not None and solid.tag not in ("box", "cylinder", "sphere"):
            yield f"visual {plain(solid.tag)}", name, "mechlab draws boxes, cylinders and spheres"
        elif part.tag == "visual" and solid is not None and _is_void(solid):
            yield "visual without size", name, "a shape needs sizes above 0"
        elif part.tag not in READ_IN_LINK:
            yield f"{plain(part.tag)} of a link", name, WHY.get(part.tag, "mechlab does not read this tag")


def _of_joint(name: str, joint: ET.Element) -> Iterator[tuple[str, str, str]]:
    for part in joint:
        if part.tag not in READ_IN_JOINT:
            yield f"{plain(part.tag)} of a joint", name, WHY.get(part.tag, "mechlab does not read this tag")
    if joint.get("type") == "fixed" and joint.find("mimic") is not None:
        yield "mimic of a joint", name, "the joint is fixed and follows nothing"
    limit = joint.find("limit")
    if limit is not None and any(0.0 < number_of(limit, k, 0.0) < UNLIMITED for k in ("effort", "velocity")):
        yield "limit of effort or velocity", name, "a limit of the motor that a run gives to the joint"


def _is_void(solid: ET.Element) -> bool:
    sizes = [float(x) for key in ("size", "radius", "length") for x in solid.get(key, "").split()]
    return not sizes or min(sizes) <= 0.0


def _is_own(element: ET.Element) -> bool:
    """True for the settings that `to_urdf` writes for MuJoCo's reader."""
    return element.tag == "mujoco" and [e.tag for e in element] == ["compiler"]


def _is_loop(element: ET.Element) -> bool:
    """True for a <gazebo> that holds nothing but joints, which are read as loops."""
    return element.tag == "gazebo" and len(element) > 0 and all(e.tag == "joint" for e in element)


def plain(tag: str) -> str:
    """A tag without its name space."""
    return tag.rpartition("}")[2]


def suspected(text: UrdfText, closed: Collection[str]) -> tuple[str, ...]:
    """A sentence on the pairs of names that look like the two sides of a loop, while no file closes it; `closed`: the names
    that are used by a loop."""
    sides: dict[str, dict[str, str]] = {}
    for name in [*text.links, *text.joints]:
        match = SUGGESTS.match(name)
        if match and name not in closed:
            sides.setdefault(match[1].rstrip("_-"), {}).setdefault(match[2].lower(), name)
    pairs = [tuple(ends.values()) for ends in sides.values() if set(ends) in ({"a", "b"}, {"1", "2"})]
    if not pairs:
        return ()
    pairs_text = listed([f"[{a}, {b}]" for a, b in pairs], 3)
    return (
        f"this looks like {'a loop' if len(pairs) == 1 else f'{len(pairs)} loops'}, read as OPEN: the names {pairs_text} come in "
        "pairs, but no file says that they meet. To close, write a YAML file of the same name beside it with the lines "
        f'closed_loop: [{pairs_text.split(" and ")[0]}]  and  type: [{", ".join(["6d"] * min(len(pairs), 3))}]  '
        "(6d: the frames coincide, 3d: their origins do)",
    )
