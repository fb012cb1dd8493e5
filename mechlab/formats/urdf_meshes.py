"""The meshes that a URDF draws with, from the files beside it: for the picture alone, so one that cannot be read is left out."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.formats.xml_text import floats
from mechlab.mechanism.parts import Shape

MOST_BYTES = 200_000_000
"""Size of all mesh files that are read for one URDF [bytes]; further ones are left out."""
Surfaces = dict[tuple[str, str], Shape]
"""(filename, scale) as the URDF writes them -> the shape, without placement."""


def key_of(mesh: ET.Element) -> tuple[str, str]:
    """What tells one <mesh> from another."""
    return mesh.get("filename", ""), mesh.get("scale", "")


def read_surfaces(root: ET.Element, folder: Path) -> tuple[Surfaces, dict[str, str]]:
    """The surfaces of all <visual> meshes that are found from the folder of the URDF; and filename -> why it is not drawn."""
    from mechlab.shapes import SURFACE
    from mechlab.shapes.mesh_file import found_file, surface_of_file

    surfaces: Surfaces = {}
    missing: dict[str, str] = {}
    spent = 0
    for mesh in root.iterfind("link/visual/geometry/mesh"):
        name = mesh.get("filename", "")
        if key_of(mesh) in surfaces or name in missing:
            continue
        path = found_file(name, folder)
        if path is None:
            missing[name] = "there is no such file from the folder of the URDF"
            continue
        spent += path.stat().st_size
        if spent > MOST_BYTES:
            missing[name] = f"its mesh files have more than {MOST_BYTES / 1e6:g} MB"
            continue
        try:
            scale = floats(mesh, "scale", 3) or (1.0, 1.0, 1.0)
            surfaces[key_of(mesh)] = Shape(SURFACE, data=surface_of_file(path, scale))
        except MechlabError as error:
            missing[name] = str(error).removeprefix(f"{path.name}: ").removesuffix(".")
    return surfaces, missing
