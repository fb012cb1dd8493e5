"""Meshes as files, the same bytes every time: binary STL, and OBJ with normals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mechlab.files import write
from mechlab.shapes.shading import crisp
from mechlab.shapes.solid import Mesh

HEADER = "# mechlab mesh, metres"
"""First line of an OBJ."""


def stl_bytes(mesh: Mesh) -> bytes:
    """Binary STL: 80 bytes of header, the count, then 50 bytes a triangle (float32: good enough for the eye)."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    data = np.zeros(len(mesh.faces), dtype=record)
    data["normal"] = mesh.normals.astype("<f4") + 0.0
    data["corners"] = mesh.corners.astype("<f4") + 0.0
    return b"mechlab mesh, metres".ljust(80, b" ") + np.uint32(len(mesh.faces)).astype("<u4").tobytes() + data.tobytes()


def obj_text(mesh: Mesh) -> str:
    """Wavefront OBJ with split vertices and their normals, so that viewers keep the sharp edges sharp."""
    split = crisp(mesh)
    lines = [HEADER]
    lines += ["v " + _numbers(p) for p in split.vertices]
    lines += ["vn " + _numbers(n) for n in np.round(split.normals, 6) + 0.0]
    lines += ["f " + " ".join(f"{i}//{i}" for i in face) for face in (split.faces + 1).tolist()]
    return "\n".join(lines) + "\n"


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{x:.9g}" for x in values.tolist())


def write_stl(mesh: Mesh, path: str | Path) -> None:
    """Writes the mesh as binary STL [m]."""
    write(path, stl_bytes(mesh))


def write_obj(mesh: Mesh, path: str | Path) -> None:
    """Writes the mesh as OBJ [m] with normals, line ends `\\n` on every system."""
    write(path, obj_text(mesh))
