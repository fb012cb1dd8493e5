"""XML text of the model files: elements with numbers of 17 digits, the same byte for byte, and how they are read.

`primitive` says which shapes MJCF and URDF draw themselves, without a mesh.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.parts import Shape


def number(value: float) -> str:
    """The shortest text that reads back as the same float; whole numbers without a point."""
    x = float(value)
    if not math.isfinite(x):
        raise MechlabError(f"a value overflows and cannot be written: {x!r}. Are masses and lengths in kg and m?")
    return str(int(x)) if x == int(x) and abs(x) < 1e15 else repr(x)


def numbers(values: Iterable[float]) -> str:
    """Numbers with a blank between them."""
    return " ".join(number(v) for v in values)


def add(parent: ET.Element, tag: str, **attributes: object) -> ET.Element:
    """A child element. Floats and tuples become numbers, None is left out, a trailing _ of a name is dropped."""
    return ET.SubElement(parent, tag, {k.rstrip("_"): _text(v) for k, v in attributes.items() if v is not None})


def _text(value: object) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, int | float):
        return number(value)
    assert isinstance(value, Iterable)
    return numbers(value)


def pose(placement: Placement) -> dict[str, object]:
    """MJCF attributes pos and quat (w, x, y, z) of a placement; zeros and the identity are left out."""
    out: dict[str, object] = {}
    if any(placement.position):
        out["pos"] = placement.position
    if placement.quaternion != IDENTITY.quaternion:
        out["quat"] = placement.quaternion
    return out


def text(root: ET.Element) -> str:
    """The indented document, which ends with a newline."""
    ET.indent(root, "  ")
    return ET.tostring(root, encoding="unicode") + "\n"


def parse(content: str, root: str, what: str) -> ET.Element:
    """The root element of an XML text; raises MechlabError when it is not XML, or the root has another tag."""
    if "<!DOCTYPE" in content or "<!ENTITY" in content:
        raise MechlabError(f"this {what} declares entities; expected plain XML without a document type.")
    try:
        found = ET.fromstring(content)
    except ET.ParseError as error:
        raise MechlabError(f"this {what} is not XML: {error}.") from None
    if found.tag != root:
        raise MechlabError(f"this is no {what}: its root element is <{found.tag}>, expected <{root}>.")
    return found


def floats(element: ET.Element, key: str, count: int | None = None) -> tuple[float, ...] | None:
    """The numbers of an attribute, or None when it is absent; raises MechlabError that names the element."""
    raw = element.get(key, "")
    if not raw.strip():
        return None
    try:
        values = tuple(float(x) for x in raw.split())
    except ValueError:
        raise MechlabError(f"{label(element)}: {key}={raw!r} is not a list of numbers.") from None
    if any(math.isnan(x) or (math.isinf(x) and element.tag != "limit") for x in values):
        raise MechlabError(f"{label(element)}: {key}={raw!r} is not finite.")
    if count is not None and len(values) != count:
        raise MechlabError(f"{label(element)}: {key}={raw!r} has {len(values)} numbers, expected {count}.")
    return values


def label(element: ET.Element) -> str:
    """The tag and name of an element, for messages."""
    name = element.get("name")
    return f"<{element.tag} name={name!r}>" if name else f"<{element.tag}>"


SIZES = {"box": ("x", "y", "z"), "cylinder": ("radius", "length"), "sphere": ("radius",)}


def primitive(item: Shape) -> tuple[float, ...] | None:
    """The sizes of a box (edges), cylinder (radius, length) or sphere (radius); None for any other solid.

    A cylinder with a chamfer counts as another solid. Raises MechlabError when a size is missing.
    """
    if item.kind not in SIZES or item.parameters.get("chamfer"):
        return None
    given = item.parameters
    missing = [k for k in SIZES[item.kind] if k not in given]
    if missing:
        raise MechlabError(f"shape {item.name or item.kind!r}: missing {', '.join(missing)}.")
    return tuple(given[k] for k in SIZES[item.kind])
