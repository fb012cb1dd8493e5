"""Meshes as Wavefront OBJ, for the eye: places and normals that corners share, flat pairs of triangles as quadrangles.

An OBJ names place and normal of a corner separately, so a sharp edge needs no second copy of its places. Together with
coordinates on a grid that the eye does not see, a gear takes two fifths of a file with nine digits and split corners.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechlab.files import write
from mechlab.shapes.feature_edges import edges_between, split_faces
from mechlab.shapes.solid import Mesh

Indices = NDArray[np.int64]

HEADER = "# mechlab mesh, metres"
"""First line of an OBJ."""
GRID, GRID_OF_THIN = 2e-5, 1e-3
"""Coordinates are multiples of a power of ten, at most these parts of the largest and of the smallest extent of the mesh."""
NORMAL_DIGITS = 3
"""Decimals of a normal: half a unit of them is .03 degrees."""
FLAT = 1e-4
"""Largest angle between two triangles that are one flat quadrangle [rad]."""
CONVEX = 1e-6
"""Smallest sine at a corner of a quadrangle: readers cut it along either diagonal, so it must not be a triangle."""


def obj_text(mesh: Mesh) -> str:
    """Wavefront OBJ with normals that keep sharp edges sharp; the same bytes every time.

    Corners share places, as they share vertices of the mesh, and normals. Coordinates are rounded to `decimals(mesh)`, normals
    to `NORMAL_DIGITS`.
    """
    triangles = mesh.faces.astype(np.int64)
    split = split_faces(triangles, mesh.corners, mesh.normals)
    used, place = np.unique(triangles, return_inverse=True)
    normals, which = np.unique(np.round(split.normals, NORMAL_DIGITS) + 0.0, axis=0, return_inverse=True)
    corners = np.column_stack([place.ravel(), which.ravel()[split.faces.ravel()]]) + 1
    fours, threes = _quadrangles(mesh, triangles)
    return "".join((
        f"{HEADER}\n",
        _lines("v %.9g %.9g %.9g\n", np.round(mesh.vertices[used], decimals(mesh)) + 0.0),
        _lines("vn %.9g %.9g %.9g\n", normals),
        _lines("f %d//%d %d//%d %d//%d %d//%d\n", corners[fours].reshape(-1, 8)),
        _lines("f %d//%d %d//%d %d//%d\n", corners[threes].reshape(-1, 6)),
    ))  # fmt: skip


def write_obj(mesh: Mesh, path: str | Path) -> None:
    """Writes the mesh as OBJ [m] with normals, line ends `\\n` on every system."""
    write(path, obj_text(mesh))


def decimals(mesh: Mesh) -> int:
    """Decimals of a coordinate [m] such that their unit is at most `GRID` of the largest extent of the mesh and `GRID_OF_THIN` of
    the smallest one that is not zero; negative for a mesh of kilometres."""
    extents = np.ptp(mesh.vertices, axis=0) if len(mesh.vertices) else np.zeros(3)
    if not extents.any():
        return 9
    unit = min(GRID * float(extents.max()), GRID_OF_THIN * float(extents[extents > 1e-9 * extents.max()].min()))
    return -math.floor(math.log10(unit))


def _quadrangles(mesh: Mesh, triangles: Indices) -> tuple[Indices, Indices]:
    """Corners, numbered 3 * face + place, of the quadrangles (k, 4) that pairs of triangles make which are flat and convex
    together, and (l, 3) of the triangles that are left. The pairs are taken in the order of their common edges."""
    first, second, flat, _, _ = edges_between(triangles, mesh.normals, FLAT)
    opposed = triangles.ravel()[first] == triangles.ravel()[_next(second)]
    first, second = first[flat & opposed], second[flat & opposed]
    four = np.column_stack([first, _next(_next(second)), _next(first), _next(_next(first))])
    side = np.roll(places := mesh.corners.reshape(-1, 3)[four], -1, axis=1) - places
    side /= np.maximum(np.linalg.norm(side, axis=2, keepdims=True), 1e-300)
    turn = np.einsum("ijk,ik->ij", np.cross(np.roll(side, 1, axis=1), side), mesh.normals[first // 3])
    four = four[turn.min(axis=1) > CONVEX] if len(four) else four
    free, taken = np.ones(len(triangles), dtype=bool), []
    for k, (one, other) in enumerate((four[:, :2] // 3).tolist()):
        if free[one] and free[other]:
            free[one] = free[other] = False
            taken.append(k)
    return four[taken], np.flatnonzero(free)[:, None] * 3 + np.arange(3)


def _next(corner: Indices) -> Indices:
    """The next corner of the same triangle."""
    return corner - corner % 3 + (corner + 1) % 3


def _lines(line: str, rows: NDArray[np.generic]) -> str:
    """The rows of an array, each as a line: one call for all of them."""
    return (line * len(rows)) % tuple(rows.ravel().tolist())
