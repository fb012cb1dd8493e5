"""Generated files compared as what they are: structure and words exactly, numbers to what a processor may change.

Sines, quaternions and solved statics differ between processors in their last bits. So numbers of XML and JSON may differ by
`ROUNDING` of the largest number of the same name in the file (of 1 where all are smaller), a quaternion may have the other
sign; numbers of sheets by one unit of their last printed digit, of an OBJ by one unit of what it rounds them to.
"""

import json
import math
import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

ROUNDING = 1e-12
NOTHING = 1e-12
"""Printed numbers below this are rounding, of which a sheet shows the size."""
IN_JSON = {"pieces": 1e-6}
"""The highest of the six coefficients of a piece of a curve holds rounding over the fifth power of its width, about .04: 1e-7."""
IN_OBJ = {"v": 4e-5, "vn": 1.001e-3, "f": 0.0}
"""Vertices are rounded to a unit of at most 2e-5 of the largest extent, which is at most twice the largest coordinate; normals to
3 decimals."""
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w|\.\d)", re.IGNORECASE)
QUATERNIONS = ("quat", "quaternion")
Leaf = tuple[str, str, Any]
"""Place in the file, name of the quantity, and its value: text, or numbers as a tuple."""


def difference(kept: Path, made: Path) -> str:
    """The first difference of two files, with its place; "" for none."""
    one, two = kept.read_text("utf-8"), made.read_text("utf-8")
    if one == two:
        return ""
    if kept.suffix in (".xml", ".urdf"):
        return _first(list(_xml(one)), list(_xml(two)))
    if kept.suffix == ".json":
        return _first(list(_json(json.loads(one))), list(_json(json.loads(two))), IN_JSON)
    if kept.suffix == ".obj":
        return _first(list(_obj(one)), list(_obj(two)), IN_OBJ)
    return _first_printed(one, two)


def _first(one: list[Leaf], two: list[Leaf], allowed: Mapping[str, float] | None = None) -> str:
    """The first difference; allowed: what numbers of a name may differ by, over their size (default: ROUNDING)."""
    sizes: dict[str, float] = defaultdict(lambda: 0.0 if allowed is IN_OBJ else 1.0)
    for _, name, value in one:
        if isinstance(value, tuple):
            sizes[name] = max(sizes[name], *(abs(x) for x in value))
    for (place, name, a), (other, _, b) in zip(one, two, strict=False):
        if place != other:
            return f"{place} against {other}"
        if not _same(name, a, b, (allowed or {}).get(name, ROUNDING) * sizes[name]):
            return f"{place}: {a} against {b}"
    return "" if len(one) == len(two) else f"{len(one)} entries against {len(two)}"


def _same(name: str, a: Any, b: Any, allowed: float) -> bool:
    if a == b:
        return True
    if not (isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b)):
        return False
    signs = (1.0, -1.0) if name in QUATERNIONS else (1.0,)
    return any(all(abs(x - s * y) <= allowed for x, y in zip(a, b, strict=True)) for s in signs)


def _xml(text: str) -> Iterator[Leaf]:
    root = ET.fromstring(text, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)))
    for k, element in enumerate(root.iter()):
        place = f"element {k} <{element.tag}>"
        yield place, "text", (element.text or "").strip()
        for name, value in element.attrib.items():
            yield f"{place} {name}", name, _numbers(value.split()) or value
        yield f"{place} has {len(element)} children", "tail", (element.tail or "").strip()


def _json(value: Any, place: str = "", name: str = "") -> Iterator[Leaf]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _json(item, f"{place}/{key}", key)
    elif isinstance(value, list) and not (value and all(type(x) in (int, float) for x in value)):
        yield f"{place} of {len(value)}", name, ""
        for k, item in enumerate(value):
            yield from _json(item, f"{place}/{k}", name)
    else:
        yield place, name, tuple(value) if isinstance(value, list) else (value,) if type(value) is float else value


def _obj(text: str) -> Iterator[Leaf]:
    for k, line in enumerate(text.splitlines(), 1):
        kind, *words = line.split()
        yield f"line {k}, {kind}", kind, _numbers(words) or line


def _numbers(words: list[str]) -> tuple[float, ...]:
    """The numbers, or () where a word is none."""
    try:
        found = tuple(float(w) for w in words)
    except ValueError:
        return ()
    return found if all(math.isfinite(x) for x in found) else ()


def _first_printed(one: str, two: str) -> str:
    lines = list(zip(one.splitlines(), two.splitlines(), strict=False))
    for k, (a, b) in enumerate(lines, 1):
        if a == b:
            continue
        if NUMBER.sub("#", a) != NUMBER.sub("#", b):
            return f"line {k}: {a!r} against {b!r}"
        for x, y in zip(NUMBER.findall(a), NUMBER.findall(b), strict=True):
            if max(abs(float(x)), abs(float(y))) < NOTHING:
                continue
            if abs(float(x) - float(y)) > 1.000001 * max(_last_digit(x), _last_digit(y)):
                return f"line {k}: {x} against {y}"
    return "" if one.count("\n") == two.count("\n") else f"{one.count(chr(10))} lines against {two.count(chr(10))}"


def _last_digit(number: str) -> float:
    """One unit of the last printed digit; nothing for a whole number, which is a count."""
    mantissa, _, exponent = number.lower().partition("e")
    if "." not in mantissa and not exponent:
        return 0.0
    return float(10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2])))
