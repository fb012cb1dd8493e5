"""Surfaces that come from files: triangles as a text, which a Shape of kind "mesh" carries as its data.

    text = surface_text(vertices, faces)          # base64 of zlib of counts, float32 vertices [m], int32 faces
    surface_mesh(text)                            # the Mesh

A text is hashed and compared as one value and stands in a JSON as it is. Surfaces of more than MOST_FACES faces are made coarser.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.shapes.solid import Mesh

MOST_FACES = 20_000
"""Largest number of triangles of a surface."""
MOST_BYTES = 8 + 12 * 3 * MOST_FACES + 12 * MOST_FACES
"""Size of the largest surface: as many corners as three for each face."""


def surface_text(vertices: ArrayLike, faces: ArrayLike, most: int = MOST_FACES) -> str:
    """The text of a surface of vertices (n, 3) [m] and faces (m, 3), with at most `most` faces (see `coarser`).

    Raises MechlabError for arrays that make no mesh, and for a surface without a face.
    """
    made = Mesh(np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64).reshape(-1, 3).astype(np.int32))
    made = coarser(made, most)
    if not len(made.faces):
        raise MechlabError("mesh: it has no faces with an area.")
    used, index = np.unique(made.faces, return_inverse=True)
    points, triangles = made.vertices[used], index.reshape(-1, 3)
    counts = np.array([len(points), len(triangles)], dtype="<u4").tobytes()
    data = counts + points.astype("<f4").tobytes() + triangles.astype("<i4").tobytes()
    return base64.b64encode(zlib.compress(data, 9)).decode("ascii")


@lru_cache(maxsize=512)
def surface_mesh(text: str) -> Mesh:
    """The Mesh of a text of `surface_text`. Raises MechlabError for any other text."""
    try:
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(base64.b64decode(text, validate=True), MOST_BYTES)
        points, triangles = np.frombuffer(data[:8], dtype="<u4").tolist()
        if len(data) != 8 + 12 * points + 12 * triangles:
            raise ValueError
    except (binascii.Error, zlib.error, ValueError):
        raise MechlabError("mesh: its data are no surface as mechlab writes them (zlib and base64 of vertices and faces).") from None
    vertices = np.frombuffer(data, dtype="<f4", count=3 * points, offset=8).reshape(-1, 3)
    faces = np.frombuffer(data, dtype="<i4", count=3 * triangles, offset=8 + 12 * points).reshape(-1, 3)
    return Mesh(vertices.astype(float), faces)


def coarser(mesh: Mesh, most: int) -> Mesh:
    """The mesh with at most `most` faces: vertices of one cell of a cubic grid become one, the cells as small as possible within a
    twentieth. Faces without area are dropped; the mesh itself where it is small enough."""
    if len(mesh.faces) <= most:
        return mesh
    low, size = mesh.vertices.min(axis=0), float(np.ptp(mesh.vertices, axis=0).max()) or 1.0
    cells = float(np.sqrt(most))
    found = _clustered(mesh, low, size / cells)
    while len(found.faces) > most and cells > 1.0:
        cells *= 0.95
        found = _clustered(mesh, low, size / cells)
    return found


def _clustered(mesh: Mesh, low: NDArray[np.float64], cell: float) -> Mesh:
    place = np.floor((mesh.vertices - low) / cell).astype(np.int64)
    _, index = np.unique(place, axis=0, return_inverse=True)
    index = index.reshape(-1)
    count = np.bincount(index).astype(float)
    points = np.stack([np.bincount(index, mesh.vertices[:, k]) / count for k in range(3)], axis=1)
    faces = index[mesh.faces]
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = np.unique(np.sort(faces[proper], axis=1), axis=0, return_index=True)[1]
    return Mesh(points, index[mesh.faces][proper][faces].astype(np.int32))
