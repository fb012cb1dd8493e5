"""The patient: a file as text, as MuJoCo compiles it, and as a Mechanism, as far as each of them can be had."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import mujoco

from mechlab.errors import MechlabError
from mechlab.formats.xml_text import parse
from mechlab.mechanism import Mechanism
from mechlab.simulate.control import compiling

ROOTS = {".xml": ("mujoco", "MJCF"), ".urdf": ("robot", "URDF")}


@dataclass(frozen=True)
class Case:
    """What is known of a file: the root of its XML (None for other sources), the compiled model or why MuJoCo refuses it,
    the Mechanism or why mechlab cannot hold it."""

    name: str
    kind: str
    root: ET.Element | None = None
    model: mujoco.MjModel | None = None
    refused: str = ""
    mechanism: Mechanism | None = None
    unread: str = ""


def read_case(path: Path) -> Case:
    """The case of an .xml or .urdf file; raises MechlabError for a file that cannot be read, or is neither."""
    try:
        content = path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise MechlabError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}.") from None
    tag, kind = ROOTS[path.suffix.lower()]
    try:
        root = parse(content, tag, f"{kind} file")
        mechanism, unread = _as_mechanism(content, kind)
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}") from None
    model, refused = _compiled(path, root, kind)
    return Case(path.name, kind, root, model, refused, mechanism, unread)


def case_of(mechanism: Mechanism, kind: str) -> Case:
    """The case of a Mechanism: the MJCF that mechlab would write of it."""
    from mechlab.formats.mjcf import to_mjcf
    from mechlab.simulate import to_mujoco

    root = ET.fromstring(to_mjcf(mechanism))
    return Case(mechanism.name, kind, root, to_mujoco(mechanism)[0], "", mechanism)


def _as_mechanism(content: str, kind: str) -> tuple[Mechanism | None, str]:
    from mechlab.formats import from_mjcf, from_urdf

    try:
        return (from_mjcf if kind == "MJCF" else from_urdf)(content), ""
    except MechlabError as error:
        return None, str(error)
    except (ValueError, KeyError, IndexError) as error:
        return None, f"{type(error).__name__}: {error}"


def _compiled(path: Path, root: ET.Element, kind: str) -> tuple[mujoco.MjModel | None, str]:
    try:
        with compiling():
            if kind == "MJCF":
                return mujoco.MjModel.from_xml_path(str(path)), ""
            return mujoco.MjModel.from_xml_string(ET.tostring(bare(root), encoding="unicode")), ""
    except ValueError as error:
        return None, " ".join(str(error).split())


def bare(root: ET.Element) -> ET.Element:
    """A URDF without its looks: meshes need not be there to look at its mechanics."""
    root = copy.deepcopy(root)
    for link in root.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
    return root
