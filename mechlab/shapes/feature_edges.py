"""Feature edges: the vertices of a mesh are split where its faces meet sharply, and these edges are drawn as lines."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FEATURE_ANGLE = math.radians(30.0)


@dataclass(frozen=True, eq=False)
class SplitMesh:
    """A mesh whose vertices carry one normal each.

    vertices: (n, 3) [m]; normals: (n, 3), unit; faces: (m, 3) indices; edges: (k, 2) indices of sharp edges and
    open borders; closed: whether the faces bound a solid, all of them seen from outside counter-clockwise.
    """

    vertices: Array
    normals: Array
    faces: Indices
    edges: Indices
    closed: bool = False


def split_at_edges(vertices: ArrayLike, faces: ArrayLike, angle: float = FEATURE_ANGLE) -> SplitMesh:
    """The mesh of `vertices` (n, 3) and `faces` (m, 3), its equal vertices welded, split as by `split_faces`.

    Vertices are equal when they are so in single precision, which is what pages and GLB files hold. Faces without
    area are dropped.
    """
    points, welded = _welded(np.asarray(vertices, dtype=np.float32))
    triangles = welded[np.asarray(faces, dtype=np.int64)]
    corners = points.astype(np.float64)[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max() if len(corners) else 1.0
    solid = area > 1e-14 * size**2
    return split_faces(triangles[solid], corners[solid], normals[solid] / area[solid, None], angle)


def _welded(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], Indices]:
    """The different points of (n, 3), sorted, and (n,) which of them each one is: `np.unique` of rows, by sorting numbers."""
    order = np.lexsort(points.T[::-1])
    ranked = points[order]
    new = np.append(True, np.any(ranked[1:] != ranked[:-1], axis=1))[: len(points)]
    which = np.empty(len(points), dtype=np.int64)
    which[order] = np.cumsum(new) - 1
    return ranked[new], which


def split_faces(triangles: Indices, corners: Array, normals: Array, angle: float = FEATURE_ANGLE) -> SplitMesh:
    """The mesh with its vertices split where neighbouring faces meet at more than `angle` [rad].

    The corners of faces that meet smoothly share a vertex: connected components over the smooth edges. Its
    normal is the mean of their face normals, each weighted with its corner angle, so that the triangulation
    of a flat or round surface does not show. `triangles` (m, 3): indices of points; `corners` (m, 3, 3): their
    places [m]; `normals` (m, 3): of the faces, unit.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second, smooth, edge_start, edge_end = edges_between(triangles, normals, angle)
    # The two ends of a smooth edge, in the corner numbering 3 * face + place; its second face runs the other
    # way round.
    start = _corner_of(triangles, first // 3, edge_start), _corner_of(triangles, second // 3, edge_start)
    end = _corner_of(triangles, first // 3, edge_end), _corner_of(triangles, second // 3, edge_end)
    rows = np.concatenate([start[0][smooth], end[0][smooth]])
    columns = np.concatenate([start[1][smooth], end[1][smooth]])
    count = triangles.size
    links = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(count, count))
    total, label = connected_components(links, directed=False)

    out_vertices = np.zeros((total, 3))
    out_vertices[label] = corners.reshape(-1, 3)
    out_normals = np.zeros((total, 3))
    np.add.at(out_normals, label, (normals[:, None, :] * _corner_angles(corners)[:, :, None]).reshape(-1, 3))
    out_normals /= np.maximum(np.linalg.norm(out_normals, axis=1), 1e-300)[:, None]
    points = int(triangles.max(initial=-1)) + 1
    sharp = np.sort(triangles.reshape(-1)[np.stack([start[0], end[0]], axis=1)[~smooth]], axis=1)
    lines = np.stack(np.divmod(np.unique(_key(sharp[:, 0], sharp[:, 1], points)), max(points, 1)), axis=1)
    representative = np.zeros(points, dtype=np.int64)
    representative[triangles.reshape(-1)] = label
    faces = label.reshape(-1, 3).astype(np.int64)
    return SplitMesh(out_vertices, out_normals, faces, representative[lines], _is_closed(triangles, corners))


def edges_between(
    triangles: Indices, normals: Array, angle: float
) -> tuple[Indices, Indices, NDArray[np.bool_], Indices, Indices]:
    """Every undirected edge of `triangles` (m, 3) once: the two half-edges (3 * face + place) that bound it, whether the face
    `normals` (m, 3) there differ by less than `angle` [rad], its two points.

    An edge of one face, or of more than two, is never smooth; its second half-edge is then its first again.
    """
    a, b = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    points = int(triangles.max(initial=0)) + 1
    keys = _key(np.minimum(a, b), np.maximum(a, b), points)
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    begin = np.flatnonzero(np.append(True, ranked[1:] != ranked[:-1])[: len(ranked)])
    count = np.diff(np.append(begin, len(ranked)))
    first = order[begin]
    second = order[begin + (count == 2)]
    cosine = np.einsum("ij,ij->i", normals[first // 3], normals[second // 3])
    smooth = (count == 2) & (cosine > math.cos(angle))
    start, end = np.divmod(ranked[begin], points)
    return first, second, smooth, start, end


def _key(start: Indices, end: Indices, points: int) -> Indices:
    """One number for each pair of points, in the order of the pairs: sorting numbers is many times faster than sorting rows."""
    return start * points + end


def _is_closed(triangles: Indices, corners: Array) -> bool:
    """Whether every half-edge meets exactly one that runs the other way, and the volume inside is positive."""
    if not len(triangles):
        return False
    a, b = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    points = int(triangles.max()) + 1
    ways, back = np.sort(_key(a, b, points)), np.sort(_key(b, a, points))
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    return bool(np.all(ways[1:] > ways[:-1]) and np.array_equal(ways, back) and volume > 0.0)


def _corner_of(triangles: Indices, face: Indices, point: Indices) -> Indices:
    return 3 * face + np.argmax(triangles[face] == point[:, None], axis=1)


def _corner_angles(corners: Array) -> Array:
    """(m, 3) interior angles [rad] of triangles (m, 3, 3)."""
    to_next = np.roll(corners, -1, axis=1) - corners
    to_last = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(to_next, to_last), axis=2)
    return np.arctan2(sine, np.einsum("ijk,ijk->ij", to_next, to_last))
