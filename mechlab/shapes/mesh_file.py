"""Meshes of files, for the eye: STL, OBJ and DAE by trimesh, as the data of a Shape of kind "mesh".

surface_of_file(path, (0.001, 0.001, 0.001))       # text of `mechlab.shapes.surface`; a file in millimetres
found_file("package://robot/meshes/arm.stl", folder_of_the_urdf)
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError
from mechlab.shapes.surface import surface_text

FORMATS = (".stl", ".obj", ".dae", ".ply")
ABOVE = 5
LFS = b"version https://git-lfs"
"""Beginning of a file that stands for one that was not fetched."""
MOST_BYTES = 200_000_000
"""Largest mesh file that is read [bytes]."""


def surface_of_file(path: Path, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> str:
    """The surface in a mesh file, each axis times `scale`.

    Raises MechlabError for a file that is missing, too large, of another format or not readable; EngineMissing without trimesh.
    """
    if path.suffix.lower() not in FORMATS:
        raise MechlabError(f"{path.name}: meshes are read from {', '.join(FORMATS)}.")
    if not path.is_file():
        raise MechlabError(f"there is no file {path}.")
    if path.stat().st_size > MOST_BYTES:
        raise MechlabError(f"{path.name}: it has more than {MOST_BYTES / 1e6:g} MB.")
    with path.open("rb") as file:
        if file.read(len(LFS)) == LFS:
            raise MechlabError(f"{path.name}: it is a pointer of Git LFS, not the mesh; fetch it with `git lfs pull`.")
    try:
        import trimesh
    except ModuleNotFoundError:
        raise EngineMissing("trimesh is not installed, which reads meshes; pip install trimesh.") from None
    try:
        made: Any = trimesh.load_mesh(path, process=False)
    except Exception as error:  # a library reads a stranger's file: whatever it raises means the same
        raise MechlabError(f"{path.name}: it is no readable mesh ({type(error).__name__}: {error}).") from None
    if isinstance(made, trimesh.Scene):
        made = made.to_mesh()
    vertices, faces = np.asarray(made.vertices, dtype=float), np.asarray(made.faces)
    if not len(faces):
        raise MechlabError(f"{path.name}: it has no faces.")
    scaled = vertices * np.asarray(scale, dtype=float)
    return surface_text(scaled, faces[:, ::-1] if np.prod(scale) < 0.0 else faces)


def found_file(name: str, folder: Path) -> Path | None:
    """The file that a model file in `folder` names: a path from there, or `package://NAME/REST` and `file://`, whose REST is looked
    for in the folder and in ABOVE folders above it. None where there is no such file."""
    rest = name.split("://", 1)[1] if "://" in name else name
    package = name.startswith(("package://", "model://"))
    rest = rest.lstrip("/") if package else rest
    choices = [rest, rest.partition("/")[2]] if package else [rest]
    places = [folder, *folder.resolve().parents[:ABOVE]] if package else [folder]
    for place in places:
        for choice in choices:
            if choice and (place / choice).is_file():
                return place / choice
    return None
