"""The words of MJCF: which attributes each element has in MuJoCo 4.0.0.

`schema.txt` is the output of MuJoCo's `mj_printSchema` in a short form: one element a line, indented below its parent, with its
attributes. Elements that are not in it (composite, plugins of newer versions) are not judged here: the reader and the engine name them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import field
from difflib import get_close_matches
from functools import cache
from pathlib import Path

from mechlab.lazy_dataclass import dataclass

REPLICATE = frozenset(("count", "sep", "offset", "euler", "prefix"))


@dataclass
class Words:
    """Attributes and children of an element."""

    attributes: frozenset[str]
    children: dict[str, Words] = field(default_factory=dict)


@cache
def words() -> Words:
    """The words of <mujoco>, with those of its children."""
    path: list[Words] = []
    for line in Path(__file__).with_name("schema.txt").read_text(encoding="ascii").splitlines():
        tag, *attributes = line.split()
        depth = len(line) - len(line.lstrip(" "))
        found = Words(frozenset(attributes))
        if depth:
            path[depth - 1].children[tag] = found
        path[depth:] = [found]
    top = path[0]
    body = top.children["body"]
    body.children |= dict.fromkeys(("body", "frame"), body)
    body.children["replicate"] = Words(body.attributes | REPLICATE, body.children)
    top.children["worldbody"] = body
    top.children["default"].children["default"] = top.children["default"]
    return top


def unknown_attributes(root: ET.Element) -> Iterator[tuple[ET.Element, str, str]]:
    """Element, attribute, and a sentence that says what was meant, for each attribute that no version of the element has."""
    stack = [(root, words())]
    while stack:
        element, known = stack.pop()
        for key in element.attrib:
            if key not in known.attributes and ":" not in key and not key.startswith("{"):
                yield element, key, _meant(key, known.attributes)
        for child in element:
            inside = known.children.get(child.tag)
            if inside is not None:
                stack.append((child, inside))


def _meant(key: str, known: frozenset[str]) -> str:
    close = get_close_matches(key, sorted(known), n=1)
    guess = f" Did you mean {close[0]!r}?" if close else ""
    return f"MuJoCo knows no attribute {key!r} here.{guess}"
