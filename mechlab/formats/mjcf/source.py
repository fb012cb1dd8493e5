"""A parsed MJCF text: compiler options, default classes, orientations, names for a Mechanism."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.formats.soundness import sound
from mechlab.formats.xml_text import floats, label
from mechlab.mechanism.geometry import Array, Placement, axis_rotation, frame_along, matrix_to_quaternion

TOP = (
    "compiler", "option", "size", "statistic", "visual", "asset", "default", "custom", "worldbody", "tendon",
    "equality", "actuator", "sensor", "keyframe", "contact",
)  # fmt: skip
DEFAULT_TAG = {"fixed": "tendon", "spatial": "tendon", "connect": "equality", "weld": "equality"}


def fail(element: ET.Element, message: str) -> MechlabError:
    """An error that names the element."""
    return MechlabError(f"{label(element)}: {message}")


def written_by_mechlab(content: str) -> bool:
    """True for an MJCF text that mechlab wrote. Raises MechlabError for a text that is no MJCF."""
    return _ours(sound(content, "mujoco", "MJCF file"))


def _ours(root: ET.Element) -> bool:
    return any(t.get("name") == "written_by" and t.get("data") == "mechlab" for t in root.iter("text"))


class MjcfText:
    """A parsed MJCF text. `attributes(element, childclass)` gives an element with its defaults filled in."""

    def __init__(self, content: str) -> None:
        self.root = sound(content, "mujoco", "MJCF file")
        for element in self.root:
            if element.tag not in TOP:
                raise fail(element, f"mechlab does not read this part of MJCF. It reads {', '.join(TOP)}.")
        compiler: dict[str, str] = {}
        for element in self.section("compiler"):
            compiler |= element.attrib
        for key in ("settotalmass", "boundmass", "boundinertia"):
            if float(compiler.get(key, "0")) > 0.0:
                raise MechlabError(f"<compiler>: {key} changes masses while compiling; write the masses themselves.")
        if compiler.get("coordinate", "local") != "local":
            raise MechlabError("<compiler>: only local coordinates are read.")
        self.angle = 1.0 if compiler.get("angle", "degree") == "radian" else math.pi / 180.0
        self.eulerseq = compiler.get("eulerseq", "xyz")
        if len(self.eulerseq) != 3 or set(self.eulerseq.lower()) - set("xyz"):
            raise MechlabError(f"<compiler>: eulerseq={self.eulerseq!r} must be three of x, y, z.")
        self.autolimits = compiler.get("autolimits", "true") == "true"
        self.inertia_from_geoms = compiler.get("inertiafromgeom", "auto")
        self.ours = _ours(self.root)
        self.defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for element in self.section("default"):
            self._read_defaults(element, "main", {})

    def section(self, tag: str) -> list[ET.Element]:
        """All top-level elements with a tag (MJCF allows several)."""
        return self.root.findall(tag)

    def items(self, tag: str) -> Iterator[ET.Element]:
        """The children of all top-level elements with a tag."""
        for section in self.section(tag):
            yield from section

    def _read_defaults(self, element: ET.Element, name: str, above: dict[str, dict[str, str]]) -> None:
        here = {tag: dict(values) for tag, values in above.items()}
        for child in element:
            if child.tag != "default":
                here.setdefault(child.tag, {}).update(child.attrib)
        self.defaults[name] = here
        for child in element:
            if child.tag == "default":
                self._read_defaults(child, child.get("class", ""), here)

    def attributes(self, element: ET.Element, childclass: str | None = None) -> ET.Element:
        """A copy of the element (without children) with the attributes of its default class filled in."""
        name = element.get("class") or childclass or "main"
        if name not in self.defaults:
            raise unknown(f"{label(element)}: default class", name, self.defaults)
        tag = DEFAULT_TAG.get(element.tag, element.tag)
        out = ET.Element(element.tag, self.defaults[name].get(tag, {}) | element.attrib)
        out.attrib.pop("class", None)
        return out

    # -- orientations ------------------------------------------------------------------------------------------------

    def placement(self, element: ET.Element) -> Placement:
        """pos and any one of quat, axisangle, euler, xyaxes, zaxis of an element."""
        pos = floats(element, "pos", 3) or (0.0, 0.0, 0.0)
        quat = floats(element, "quat", 4)
        if quat is not None:
            return Placement((pos[0], pos[1], pos[2]), (quat[0], quat[1], quat[2], quat[3]))
        turned = self._rotation(element)
        return Placement(
            (pos[0], pos[1], pos[2]), (1.0, 0.0, 0.0, 0.0) if turned is None else matrix_to_quaternion(turned)
        )

    def _rotation(self, element: ET.Element) -> Array | None:
        axisangle = floats(element, "axisangle", 4)
        if axisangle is not None:
            axis = np.array(axisangle[:3])
            return axis_rotation(axis / np.linalg.norm(axis), axisangle[3] * self.angle)
        euler = floats(element, "euler", 3)
        if euler is not None:
            turned = np.eye(3)
            for letter, angle in zip(self.eulerseq, euler, strict=True):
                one = axis_rotation(np.eye(3)["xyz".index(letter.lower())], angle * self.angle)
                turned = turned @ one if letter.islower() else one @ turned
            return turned
        xyaxes = floats(element, "xyaxes", 6)
        if xyaxes is not None:
            x = np.array(xyaxes[:3]) / np.linalg.norm(xyaxes[:3])
            y = np.array(xyaxes[3:]) - (x @ np.array(xyaxes[3:])) * x
            y /= np.linalg.norm(y)
            return np.column_stack([x, y, np.cross(x, y)])
        zaxis = floats(element, "zaxis", 3)
        return None if zaxis is None else _shortest_turn(np.array(zaxis) / np.linalg.norm(zaxis))


def _shortest_turn(z: Array) -> Array:
    """Rotation by the smallest angle that takes z to the given direction, as MuJoCo's zaxis and fromto."""
    axis = np.cross([0.0, 0.0, 1.0], z)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3) if z[2] > 0 else axis_rotation([1.0, 0.0, 0.0], math.pi)
    return axis_rotation(axis / sine, math.atan2(sine, z[2]))


def along(start: Array, end: Array) -> Placement:
    """Placement in the middle between two points, z from the first to the second."""
    z = (end - start) / np.linalg.norm(end - start)
    return Placement.of(frame_along(z), (start + end) / 2.0)


def clean(name: str) -> str:
    """The name as a Mechanism may have it: other characters than letters, digits, '_', '-', '.' become '_'."""
    return "".join(c if c.isalnum() or c in "_-." else "_" for c in name)


class Names:
    """Names of one kind of element -> unique names that a Mechanism may have; unnamed elements are counted."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.given: dict[str, str] = {}
        self._taken: set[str] = set()

    def add(self, name: str | None, fallback: str | None = None) -> str:
        """The unique clean name of a new element."""
        base = clean(name) if name else (fallback or f"{self.kind}_{len(self._taken) + 1}")
        out, k = base, 2
        while out in self._taken:
            out, k = f"{base}_{k}", k + 1
        self._taken.add(out)
        if name:
            self.given[name] = out
        return out

    def reserve(self, name: str) -> None:
        """Keep a name from being given to an element."""
        self._taken.add(name)

    def find(self, name: str | None, element: ET.Element) -> str:
        """The name of an element that `element` refers to; raises MechlabError that lists what exists."""
        if name is None or name not in self.given:
            raise unknown(f"{label(element)}: {self.kind}", name, self.given)
        return self.given[name]


def one(element: ET.Element, key: str, default: float = 0.0) -> float:
    """The number of an attribute; of a polynomial (damping="1 0 0") the first, if the others are 0."""
    values = floats(element, key)
    if not values:
        return default
    if any(values[1:]):
        raise fail(element, f"{key} is nonlinear, which a Mechanism has no place for.")
    return values[0]


def refuse(element: ET.Element, *keys: str) -> None:
    """Raise MechlabError for attributes whose physics a Mechanism cannot represent, unless they are zero or off."""
    for key in keys:
        value = element.get(key)
        if value is not None and value not in ("false", "auto") and any(x not in ("0", "0.0") for x in value.split()):
            raise fail(element, f"{key}={value!r} is not read by mechlab.")
