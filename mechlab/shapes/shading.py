"""What makes a mesh look like a machined part: sharp edges drawn as lines, and flat shading across them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.shapes.solid import Array, Faces, Mesh

SHARP = math.radians(30.0)


@dataclass(frozen=True, eq=False)
class Crisp:
    """A mesh whose vertices are split along sharp edges: `vertices` (n, 3), `normals` (n, 3) unit, `faces` (m, 3)."""

    vertices: Array
    normals: Array
    faces: Faces


def _shared_edges(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Directed edges (k, 2) as (face, corner) flat indices 3 f + c of every edge and of its twin in the other face."""
    f = mesh.faces.astype(np.int64)
    start, stop = f.ravel(), np.roll(f, -1, axis=1).ravel()
    n = len(mesh.vertices)
    key, twin = start * n + stop, stop * n + start
    order = np.argsort(key, kind="stable")
    at = np.minimum(np.searchsorted(key[order], twin), len(order) - 1)
    found = key[order[at]] == twin
    here = np.flatnonzero(found & (start < stop))
    return here, order[at[here]]


def edges(mesh: Mesh, angle: float = SHARP) -> Array:
    """(k, 2, 3) end points of the edges whose two faces turn by more than `angle` [rad]: what draws the part."""
    here, there = _shared_edges(mesh)
    sharp = _turns(mesh, here, there) > angle
    a = mesh.faces.ravel()[here[sharp]]
    b = np.roll(mesh.faces, -1, axis=1).ravel()[here[sharp]]
    return np.stack([mesh.vertices[a], mesh.vertices[b]], axis=1)


def _turns(mesh: Mesh, here: NDArray[np.int64], there: NDArray[np.int64]) -> Array:
    normals = mesh.normals
    a, b = normals[here // 3], normals[there // 3]
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))


def crisp(mesh: Mesh, angle: float = SHARP) -> Crisp:
    """The mesh split where faces turn by more than `angle` [rad], with angle-weighted normals on each patch."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    here, there = _shared_edges(mesh)
    smooth = _turns(mesh, here, there) <= angle
    a, b = here[smooth], there[smooth]
    # the start corner of an edge meets the end corner of its twin, and the other way round
    rows, columns = np.concatenate([a, _next(a)]), np.concatenate([_next(b), b])
    corners = mesh.faces.size
    links = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(corners, corners))
    groups, group = connected_components(links, directed=False)
    first = np.full(groups, corners, dtype=np.int64)
    np.minimum.at(first, group, np.arange(corners))
    vertices = mesh.vertices[mesh.faces.ravel()[first]]
    weighted = mesh.normals[np.arange(corners) // 3] * _corner_angles(mesh)[:, None]
    normals = np.zeros((groups, 3))
    np.add.at(normals, group, weighted)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return Crisp(vertices, normals / np.where(length > 0.0, length, 1.0), group.reshape(-1, 3).astype(np.int32))


def _next(corner: NDArray[np.int64]) -> NDArray[np.int64]:
    return corner - corner % 3 + (corner + 1) % 3


def _corner_angles(mesh: Mesh) -> Array:
    c = mesh.corners
    u, v = np.roll(c, -1, axis=1) - c, np.roll(c, 1, axis=1) - c
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=2), np.einsum("ijk,ijk->ij", u, v)).ravel()
