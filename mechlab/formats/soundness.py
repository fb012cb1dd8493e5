"""What no model file may say, whoever reads it: faults that engines accept without a word, or that mean nothing.

MuJoCo runs a file with a negative timestep, limits upside down, a time constant of 0, or a NaN that a later number hides; readers
of URDF take the first of two origins. Each fault is named by its element; nothing is guessed.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from difflib import get_close_matches

from mechlab.errors import MechlabError
from mechlab.formats.mjcf.schema import unknown_attributes
from mechlab.formats.xml_text import floats, label, parse

SHOWN = 3
"""Largest number of faults written out in one message; the others are counted."""


def sound(content: str, root: str, what: str) -> ET.Element:
    """The root element of an MJCF or URDF text, as `xml_text.parse`, without faults; raises MechlabError that names them."""
    found = parse(content, root, what)
    refuse_faults(found)
    return found


def refuse_faults(root: ET.Element) -> None:
    """Raise MechlabError that names the faults of a parsed MJCF (<mujoco>, <mujocoinclude>) or URDF (<robot>), if it has any."""
    found = []
    count = 0
    for element, words in _urdf_faults(root) if root.tag == "robot" else _mjcf_faults(root):
        count += 1
        if count <= SHOWN:
            found.append(f"{where(root, element)}: {words}")
    if found:
        more = f" And {count - SHOWN} more faults." if count > SHOWN else ""
        raise MechlabError(" ".join(found) + more)


def where(root: ET.Element, element: ET.Element) -> str:
    """The element for a message: its tag and name; without a name with the nearest named element around it."""
    if element.get("name") or element is root:
        return label(element)
    around = {child: parent for parent in root.iter() for child in parent}
    above = around.get(element)
    while above is not None and not (above.get("name") or above.get("class")):
        above = around.get(above)
    if above is None or above is root:
        return label(element)
    key = "name" if above.get("name") else "class"
    return f"{label(element)} of <{above.tag} {key}={above.get(key)!r}>"


# -- MJCF ----------------------------------------------------------------------------------------------------------------

POSITIVE = {"option": ("timestep", "impratio")}
NOT_NEGATIVE = {
    "inertial": ("mass",), "geom": ("density",), "joint": ("armature", "frictionloss", "damping"), "tendon": ("frictionloss",),
    "fixed": ("armature", "frictionloss"), "spatial": ("armature", "frictionloss"), "option": ("density", "viscosity"),
}  # fmt: skip
RANGES = ("range", "ctrlrange", "forcerange", "actrange", "actuatorfrcrange", "lengthrange")
LIMITED = {"range": "limited", "ctrlrange": "ctrllimited", "forcerange": "forcelimited", "actrange": "actlimited"}
SOLREFS = ("solref", "solreflimit", "o_solref")
SPACES = {
    "body": "body", "joint": "joint", "freejoint": "joint", "geom": "geom", "site": "site", "camera": "camera", "light": "light",
}  # fmt: skip
"""Elements in bodies, and the space in which their names are unique."""


def _mjcf_faults(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    for element, _, words in unknown_attributes(root):
        yield element, words
    for element in root.iter():
        yield from _numbers_of(element)
    yield from _repeated_names(root)


def _numbers_of(e: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    for key in POSITIVE.get(e.tag, ()):
        if (x := _first(e, key)) is not None and x <= 0.0:
            yield e, f"{key}={e.get(key)!r} must be above 0."
    for key in NOT_NEGATIVE.get(e.tag, ()):
        if (x := _first(e, key)) is not None and x < 0.0:
            yield e, f"{key}={e.get(key)!r} must not be negative."
    if e.tag == "geom" and (x := _first(e, "mass")) is not None and x < 0.0 and x != -1.0:
        yield e, f"mass={e.get('mass')!r} must not be negative (MuJoCo takes any negative mass for 'not given')."
    if e.tag == "inertial" and any(x < 0.0 for x in _all(e, "diaginertia")):
        yield e, f"diaginertia={e.get('diaginertia')!r} must not be negative."
    for key in RANGES:
        ends = _all(e, key)
        if len(ends) == 2 and ends[0] > ends[1] and e.get(LIMITED.get(key, ""), "auto") != "false":
            yield e, f"{key}={e.get(key)!r} is upside down: the lower limit comes first."
    for key in SOLREFS:
        pair = _all(e, key)
        if pair and (pair[0] == 0.0 or (len(pair) == 2 and (pair[0] > 0.0) != (pair[1] > 0.0))):
            yield (
                e,
                (
                    f"{key}={e.get(key)!r}: expected a time constant and a damping ratio, both above 0, or both negative for "
                    "stiffness and damping."
                ),
            )


def _repeated_names(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    seen: set[tuple[str, str]] = set()
    for section in root:
        for element in section.iter():
            if section.tag in ("worldbody", "body"):
                space = SPACES.get(element.tag, "")
            elif section.tag in ("tendon", "equality", "actuator", "sensor", "keyframe"):
                space = section.tag if element is not section else ""
            else:
                space = f"{section.tag} {element.tag}" if section.tag == "asset" else ""
            name = element.get("name")
            if not space or not name:
                continue
            if (space, name) in seen:
                yield element, f"the name is used twice; each {space.split()[-1]} needs its own."
            seen.add((space, name))


def _first(e: ET.Element, key: str) -> float | None:
    values = _all(e, key)
    return values[0] if values else None


def _all(e: ET.Element, key: str) -> tuple[float, ...]:
    """The numbers of an attribute; none where it holds words."""
    try:
        return floats(e, key) or ()
    except MechlabError:
        return ()


# -- URDF ----------------------------------------------------------------------------------------------------------------

ATTRIBUTES = {
    "link": ("name", "type"), "joint": ("name", "type"), "origin": ("xyz", "rpy"), "mass": ("value",), "axis": ("xyz",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"), "mimic": ("joint", "multiplier", "offset"), "parent": ("link",), "child": ("link",),
    "box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"),
}  # fmt: skip
"""Attributes of the elements that describe the mechanics of a URDF."""
NAMES, VECTORS = ("name", "type", "link", "joint"), ("xyz", "rpy", "size")
ONCE = {
    "joint": ("origin", "axis", "limit", "dynamics", "mimic", "parent", "child"), "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"), "visual": ("origin",), "collision": ("origin",),
}  # fmt: skip


def _urdf_faults(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    for top in root:
        if top.tag in ("link", "joint"):
            for element in top.iter():
                yield from _urdf_words(element)
            yield from _mass_faults(top) if top.tag == "link" else _limit_faults(top)


def _urdf_words(e: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    known = ATTRIBUTES.get(e.tag)
    for key in e.attrib if known else ():
        close = get_close_matches(key, known or (), n=1)
        if key not in (known or ()) and close and close[0] not in e.attrib:
            yield e, f"URDF knows no attribute {key!r} here. Did you mean {close[0]!r}?"
    for key in known or ():
        if key not in NAMES and e.get(key) is not None:
            try:
                floats(e, key, 3 if key in VECTORS else 1)
            except MechlabError as error:
                yield e, str(error).removeprefix(f"{label(e)}: ")
    for tag in ONCE.get(e.tag, ()):
        if (count := len(e.findall(tag))) > 1:
            yield e, f"it has {count} elements <{tag}>, expected one."


def _mass_faults(link: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    for mass in link.iterfind("inertial/mass"):
        value = _first(mass, "value")
        if value is None and not (mass.get("value") or "").strip():
            yield link, "its <mass> has no number as value."
        elif value is not None and value < 0.0:
            yield link, f"its mass {mass.get('value')} must not be negative."


def _limit_faults(joint: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    for limit in joint.iterfind("limit") if joint.get("type") in ("revolute", "prismatic") else ():
        lower, upper = _first(limit, "lower") or 0.0, _first(limit, "upper") or 0.0
        if lower > upper:
            yield joint, f"its limits are upside down: lower={lower:g} is above upper={upper:g}."
    for axis in joint.iterfind("axis"):
        xyz = _all(axis, "xyz")
        if joint.get("type") not in ("fixed", "floating") and len(xyz) == 3 and math.hypot(*xyz) == 0.0:
            yield joint, "its axis has no direction: xyz is 0 0 0."
