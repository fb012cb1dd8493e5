"""An MJCF file whose meshes cannot be loaded, without those that only draw or collide.

Public repositories often hold models without their meshes (pointers of Git LFS, files left out). Where the bodies say their
inertia themselves, the mechanism does not need them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco

from mechlab.engines.mujoco.model_file.guarded import ModelCrashed, ModelRefused, load_file, load_text
from mechlab.errors import MechlabError
from mechlab.formats.xml_text import parse
from mechlab.tables import listed


def load_model(path: Path, content: str) -> tuple[mujoco.MjModel, str]:
    """The compiled model of an MJCF file, and a note that names the meshes that it is compiled without, if they cannot be loaded.
    Raises MechlabError with MuJoCo's words where it refuses the file for another reason."""
    try:
        return load_file(path), ""
    except ModelCrashed as crash:
        raise MechlabError(str(crash)) from None
    except ModelRefused as refused:
        text, names = without_meshes(content)
        if names:
            try:
                return load_text(text), _note(names, str(refused))
            except ModelRefused:
                pass
        raise MechlabError(f"MuJoCo refuses {path.name}: {refused}") from None


def without_meshes(content: str) -> tuple[str, tuple[str, ...]]:
    """The text without the mesh geoms of bodies that have an <inertial>, and of the world, and the names of their meshes; nothing
    is taken from a text that includes others."""
    root = parse(content, "mujoco", "MJCF file")
    if root.find(".//include") is not None:
        return content, ()
    names: dict[str, None] = {}
    for body in [*root.iter("body"), *root.iter("worldbody")]:
        for holder in _frames(body):
            for geom in holder.findall("geom"):
                if geom.get("mesh") and (body.tag == "worldbody" or body.find("inertial") is not None):
                    names[geom.get("mesh", "")] = None
                    holder.remove(geom)
    used = {e.get("mesh") for e in root.iter("geom")}
    for asset in root.findall("asset"):
        for mesh in asset.findall("mesh"):
            if (mesh.get("name") or Path(mesh.get("file", "")).stem) not in used:
                asset.remove(mesh)
    return ET.tostring(root, encoding="unicode"), tuple(names)


def _frames(body: ET.Element) -> list[ET.Element]:
    """A body and the <frame>s in it, which hold geoms of the body."""
    out = [body]
    for frame in body.findall("frame"):
        out += _frames(frame)
    return out


def _note(names: tuple[str, ...], words: str) -> str:
    reason = words if len(words) <= 120 else f"{words[:117]}..."
    return (
        f"the meshes {listed(names)} cannot be loaded; their bodies have inertias of their own and are read "
        f"without them. MuJoCo says: {reason}"
    )
