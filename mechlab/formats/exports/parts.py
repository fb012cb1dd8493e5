"""The parts of a mechanism for a printer or a CAD system: STL, one file a part, or one 3MF with all of them in their places.

Millimetres, as slicers expect (STL has no unit, 3MF says so). The solids of a body are one part, in the axes of the body; they
overlap where they meet, which slicers join. Bodies without shapes have no part.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.model_file import LeftOut
from mechlab.files import write
from mechlab.formats.exports.graph import Exported
from mechlab.mechanism.geometry import Array, Placement
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Shape
from mechlab.mechanism.tree import reference_poses

MILLIMETRES = 1000.0
Part = tuple[str, tuple[Shape, ...], Array]


def parts(m: Mechanism) -> Iterator[Part]:
    """(name, shapes, (4, 4) pose in the world in the reference pose) of the ground, bodies and shafts that have shapes."""
    poses = {n: Placement.of(r, p).matrix() for n, (r, p) in reference_poses(m.bodies).items()}
    owned = [(GROUND, m.ground_shapes, poses[GROUND])]
    owned += [(b.name, b.shapes, poses[b.name]) for b in m.bodies]
    bodies = {b.name for b in m.bodies}
    for shaft in m.shafts:
        name = f"{shaft.name}_shaft" if shaft.name in bodies else shaft.name
        owned.append((name, shaft.shapes, poses[shaft.body] @ shaft.placement.matrix()))
    yield from (part for part in owned if part[1])


def solid(shapes: tuple[Shape, ...]) -> tuple[Array, Array]:
    """Vertices (n, 3) [mm] and faces (k, 3) of shapes in the axes of their body."""
    from mechlab.shapes import mesh

    vertices, faces, start = [], [], 0
    for item in shapes:
        made = mesh(item.kind, item.parameters)
        vertices.append(made.vertices @ item.placement.rotation.T + item.placement.translation)
        faces.append(made.faces.astype(np.int64) + start)
        start += len(made.vertices)
    return MILLIMETRES * np.concatenate(vertices), np.concatenate(faces)


def write_stl(m: Mechanism, folder: Path) -> Exported:
    """Write stl/PART.stl (binary, mm) for every part. Raises MechlabError when nothing has a shape."""
    found = _some(m)
    taken: set[str] = set()
    (folder / "stl").mkdir()
    for name, shapes, _ in found:
        stem = re.sub(r"[^A-Za-z0-9_.-]", "_", name)
        while stem.lower() in taken:
            stem += "_"
        taken.add(stem.lower())
        vertices, faces = solid(shapes)
        write(folder / "stl" / f"{stem}.stl", stl_bytes(vertices, faces))
    return Exported({"stl": Path("stl")}, _without(m))


def stl_bytes(vertices: Array, faces: Array) -> bytes:
    """A binary STL: 80 bytes of text, the number of triangles, and for each its normal, its corners and two zero bytes."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    records["normal"], records["corners"] = normals / np.where(lengths > 0, lengths, 1.0), corners
    return b"mechlab part, millimetres".ljust(80) + np.uint32(len(faces)).astype("<u4").tobytes() + records.tobytes()


def write_3mf(m: Mechanism, folder: Path) -> Exported:
    """Write NAME.3mf: every part as an object [mm], placed as in the reference pose. Raises MechlabError when nothing has a
    shape."""
    import trimesh

    scene = trimesh.Scene()
    for name, shapes, pose in _some(m):
        vertices, faces = solid(shapes)
        place = pose.copy()
        place[:3, 3] *= MILLIMETRES
        scene.add_geometry(
            trimesh.Trimesh(vertices, faces, process=False), node_name=name, geom_name=name, transform=place
        )
    write(folder / f"{m.name}.3mf", scene.export(file_type="3mf"))
    return Exported({"3mf": Path(f"{m.name}.3mf")}, _without(m))


def _some(m: Mechanism) -> list[Part]:
    found = list(parts(m))
    if not found:
        raise MechlabError(f"{m.name}: no body has a shape, so there is no part to write; give the bodies shapes.")
    return found


def _without(m: Mechanism) -> tuple[LeftOut, ...]:
    bare = tuple(b.name for b in m.bodies if not b.shapes)
    return (LeftOut("body", bare, "has no shape, so no part"),) if bare else ()
