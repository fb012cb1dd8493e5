"""XML text of the model files: elements with numbers of 17 digits, the same byte for byte, and how they are read.

`primitive` says which shapes MJCF and URDF draw themselves, without a mesh.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.parts import Shape
from mechlab.values import LARGEST_NUMBER


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


DEEPEST = 500
"""Largest nesting of elements; MuJoCo refuses more, too."""
MOST_ELEMENTS = 500_000
"""Largest number of elements of a file: a hundred times that of the largest robots."""
MOST_CHARACTERS = 2**26


class _BoundedTree(ET.TreeBuilder):
    """Builds the tree as long as it is neither too deep nor too large, and has no document type: entities expand without end."""

    depth, count = 0, 0

    def start(self, tag: str, attrs: dict[str, str]) -> ET.Element:
        self.depth, self.count = self.depth + 1, self.count + 1
        if self.depth > DEEPEST:
            raise MechlabError(f"elements are nested more than {DEEPEST} deep, at <{tag}>.")
        if self.count > MOST_ELEMENTS:
            raise MechlabError(f"it has more than {MOST_ELEMENTS} elements.")
        return super().start(tag, attrs)

    def end(self, tag: str) -> ET.Element:
        self.depth -= 1
        return super().end(tag)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise MechlabError("it declares entities; expected plain XML without a document type.")


def parse(content: str, root: str, what: str) -> ET.Element:
    """The root element of an XML text.

    Raises MechlabError when it is not XML, or the root has another tag; when it is larger than MOST_CHARACTERS, deeper than
    DEEPEST, or declares a document type (the entities of a small file can expand to terabytes); and for a number of any
    attribute that is not finite.
    """
    if len(content) > MOST_CHARACTERS:
        raise MechlabError(f"this {what} has {len(content)} characters, the limit is {MOST_CHARACTERS}.")
    try:
        found = ET.fromstring(content, ET.XMLParser(target=_BoundedTree()))
    except (ET.ParseError, ValueError) as error:  # ValueError: an encoding that the text declares and Python does not know
        raise MechlabError(f"this {what} is not XML: {error}.") from None
    except MechlabError as error:
        raise MechlabError(f"this {what} is refused: {error}") from None
    if found.tag != root:
        raise MechlabError(f"this is no {what}: its root element is <{_short(str(found.tag))}>, expected <{root}>.")
    for element in found.iter():
        _refuse_not_finite(element)
    return found


_SUSPECT = re.compile(r"nan|inf|[eE]\+?\d{2,}|\d{300}", re.IGNORECASE)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf(inity)?)(\(.*\))?", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
WORDS = ("name", "class", "childclass", "model", "file", "filename", "joint", "site", "body", "geom", "tendon", "actuator", "mesh",
         "material", "texture", "link", "key", "objname", "refname", "target", "prefix", "group", "type", "info")  # fmt: skip
"""Attributes that hold names, also with a number behind (joint1): "inf" is a name there."""


def _refuse_not_finite(element: ET.Element) -> None:
    """Raise MechlabError for an attribute with a NaN, an infinity or a number beyond LARGEST_NUMBER. Limits of URDF may be infinite."""
    if element.tag in ("text", "config"):  # words, whatever they look like
        return
    for key, value in element.attrib.items():
        if not _SUSPECT.search(value) or (key.rstrip("0123456789") in WORDS):
            continue
        for token in value.split():
            if _NOT_FINITE.fullmatch(token):
                fault = "" if element.tag == "limit" and "nan" not in token.lower() else "is not finite"
            elif _NUMBER.fullmatch(token) and abs(float(token)) > LARGEST_NUMBER:
                fault = "is not finite" if math.isinf(float(token)) else f"is beyond {LARGEST_NUMBER:g}"
            else:
                fault = ""
            if fault:
                raise MechlabError(f"{label(element)}: {key}={_short(value)!r} {fault}.")


def _short(value: str) -> str:
    """A value for a message, however long it is."""
    return value if len(value) <= 60 else f"{value[:57]}..."


def floats(element: ET.Element, key: str, count: int | None = None) -> tuple[float, ...] | None:
    """The numbers of an attribute, or None when it is absent; raises MechlabError that names the element."""
    raw = element.get(key, "")
    if not raw.strip():
        return None
    tokens = raw.split()
    if not all(_NUMBER.fullmatch(x) or _NOT_FINITE.fullmatch(x) for x in tokens):
        raise MechlabError(f"{label(element)}: {key}={_short(raw)!r} is not a list of numbers.")
    values = tuple(float(x.partition("(")[0]) for x in tokens)
    if any(math.isnan(x) or (math.isinf(x) and element.tag != "limit") for x in values):
        raise MechlabError(f"{label(element)}: {key}={_short(raw)!r} is not finite.")
    if count is not None and len(values) != count:
        raise MechlabError(f"{label(element)}: {key}={_short(raw)!r} has {len(values)} numbers, expected {count}.")
    return values


def label(element: ET.Element) -> str:
    """The tag and name of an element, for messages."""
    name = element.get("name")
    return f"<{element.tag} name={_short(name)!r}>" if name else f"<{element.tag}>"


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
