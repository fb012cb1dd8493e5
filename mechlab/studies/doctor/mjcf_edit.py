"""Changes to the text of an MJCF file that keep everything else of it: comments, order, names, the lines before the root."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from pathlib import Path

from mechlab.errors import MechlabError

_PROLOG = re.compile(r"\A(?:\s*(?:<\?.*?\?>|<!--.*?-->))*\s*", re.DOTALL)
TIES = ("connect", "weld", "joint", "tendon")
"""Equalities that close loops or couple joints."""


class MjcfText:
    """An MJCF file that is being changed. Each method does one change and returns what it did, or "" where nothing was to do.

    What stands in included files is not touched.
    """

    def __init__(self, content: str) -> None:
        found = _PROLOG.match(content)
        self.before = found.group(0) if found else ""
        closing = content.rfind("</mujoco>")
        end = content.rfind(">") + 1 if closing < 0 else closing + len("</mujoco>")
        self.after = content[end:]
        parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True, insert_pis=True))
        try:
            self.root = ET.fromstring(content[len(self.before) : end], parser)
        except ET.ParseError as error:
            raise MechlabError(f"this file is not XML: {error}.") from None

    def text(self) -> str:
        """The whole text."""
        return self.before + ET.tostring(self.root, encoding="unicode") + self.after

    def setting(self, tag: str, **attributes: str) -> str:
        """Attributes of a section such as <option>: changed where they stand, or else put on its first element."""
        done = []
        elements = self.root.findall(tag) or [self._section(tag)]
        for key, value in attributes.items():
            places = [e for e in elements if key in e.attrib] or elements[:1]
            if all(e.get(key) == value for e in places):
                continue
            done.append(f'{key}="{value}"' + (f' instead of "{places[0].get(key)}"' if places[0].get(key) else ""))
            for e in places:
                e.set(key, value)
        return f"<{tag} {', '.join(done)}>" if done else ""

    def harden(self, solref: str, solimp: str, soft: set[str]) -> str:
        """All loops and couplings as hard as the timestep allows. soft: bodies whose ties are meant to be soft (mocap bodies)."""
        own = [e for section in self.root.findall("equality") for e in section if e.tag in TIES]
        tied = [e for e in own if not {e.get("body1"), e.get("body2")} & soft]
        if len(tied) < len(own):
            for e in tied:
                e.set("solref", solref)
                e.set("solimp", solimp)
            return f'solref="{solref}" solimp="{solimp}" on {len(tied)} of {len(own)} equalities' if tied else ""
        top = self.root.find("default")
        top = self._section("default") if top is None else top
        place = top.find("equality")
        place = self._child(top, "equality", 0) if place is None else place
        if place.get("solref") != solref or place.get("solimp") != solimp:
            place.set("solref", solref)
            place.set("solimp", solimp)
            done = [f'<default><equality solref="{solref}" solimp="{solimp}"/>']
        else:
            done = []
        classes = [e for d in self.root.iter("default") for e in d.findall("equality") if e is not place]
        own_values = [e for e in [*tied, *classes] if {"solref", "solimp"} & e.attrib.keys()]
        for e in own_values:
            for key in ("solref", "solimp"):
                e.attrib.pop(key, None)
        done += [f"no solref and solimp of their own on {len(own_values)} equalities"] if own_values else []
        return "; ".join(done)

    def exclude(self, pairs: list[tuple[str, str]]) -> str:
        """No contact between pairs of bodies."""
        section = self.root.find("contact")
        known = {frozenset((e.get("body1", ""), e.get("body2", ""))) for e in self.root.findall("contact/exclude")}
        new = [p for p in pairs if frozenset(p) not in known]
        if not new:
            return ""
        section = self._section("contact", last=True) if section is None else section
        for a, b in new:
            child = self._child(section, "exclude", len(section))
            child.set("body1", a)
            child.set("body2", b)
        return f"<exclude> for {', '.join(f'{a} and {b}' for a, b in new)}"

    def actuators(self, ranges: dict[str, tuple[float, float]]) -> str:
        """The ctrlrange of actuators by name."""
        done = []
        for e in self.root.findall("actuator/*"):
            name = e.get("name", "")
            if isinstance(e.tag, str) and name in ranges:
                low, high = ranges[name]
                e.set("ctrlrange", f"{low:.9g} {high:.9g}")
                done.append(name)
        return f"ctrlrange of {', '.join(done)} as wide as the range of the joint" if done else ""

    def exact_filters(self) -> str:
        """Filters of actuators integrated exactly."""
        found = [e for e in self.root.findall("actuator/*") if e.get("dyntype") == "filter"]
        for e in found:
            e.set("dyntype", "filterexact")
        return f'dyntype="filterexact" on {len(found)} actuators' if found else ""

    def move(self, old: Path, new: Path) -> str:
        """Paths of includes and assets for a file that moves to another folder."""
        if old.resolve() == new.resolve():
            return ""
        for e in self.root.iter("include"):
            e.set("file", os.path.relpath(old / e.get("file", ""), new))
        if self.root.find("asset") is None and self.root.find("include") is None:
            return ""
        given: dict[str, str] = {}
        for e in self.root.findall("compiler"):
            given |= e.attrib
        folders = {
            key: os.path.relpath(old / given.get(key, given.get("assetdir", "")), new) for key in ("meshdir", "texturedir")
        }
        return self.setting("compiler", **folders)

    def _section(self, tag: str, last: bool = False) -> ET.Element:
        return self._child(self.root, tag, len(self.root) if last else 0)

    @staticmethod
    def _child(parent: ET.Element, tag: str, at: int) -> ET.Element:
        """A new child, indented as its siblings are."""
        made = ET.Element(tag)
        if at and len(parent):
            before = parent[at - 1]
            made.tail, before.tail = before.tail, parent.text
        else:
            made.tail = parent.text
        parent.insert(at, made)
        return made
