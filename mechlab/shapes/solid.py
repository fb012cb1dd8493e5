"""A triangle mesh as plain data, and the operations on any mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.shapes.polygon import triangulate

Array = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles for the eye: `vertices` (n, 3) [m] and `faces` (m, 3), counter-clockwise seen from outside; read-only.

    Raises MechlabError when an array has the wrong shape, a vertex is not finite or a face names a missing vertex.
    """

    vertices: Array
    faces: Faces

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64) + 0.0  # + 0.0 turns -0.0 into 0.0: same bytes everywhere
        faces = np.array(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise MechlabError(f"mesh: vertices must be finite with shape (n, 3), got shape {vertices.shape}.")
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise MechlabError(f"mesh: faces must have shape (m, 3), got {faces.shape}.")
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise MechlabError(f"mesh: faces name vertices outside 0..{len(vertices) - 1}.")
        vertices.setflags(write=False)
        faces.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    @property
    def corners(self) -> Array:
        """(m, 3, 3) the corner points of every face."""
        return self.vertices[self.faces]

    @property
    def normals(self) -> Array:
        """(m, 3) outward unit normal of every face (0 for a face without area)."""
        area = _area_vectors(self)
        length = np.linalg.norm(area, axis=1, keepdims=True)
        return area / np.where(length > 0.0, length, 1.0)


def _area_vectors(mesh: Mesh) -> Array:
    c = mesh.corners
    return 0.5 * np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])


def volume(mesh: Mesh) -> float:
    """Enclosed volume [m^3], sum of a . (b x c) / 6 over the faces; a volume where solids overlap counts twice."""
    c = mesh.corners
    return float(np.einsum("ij,ij->", c[:, 0], np.cross(c[:, 1], c[:, 2])) / 6.0)


def bounds(mesh: Mesh) -> Array:
    """(2, 3) lowest and highest corner of the axis-aligned box around the mesh [m]."""
    if not len(mesh.vertices):
        raise MechlabError("bounds: the mesh has no vertices.")
    return np.array([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])


def is_watertight(mesh: Mesh) -> bool:
    """Whether every directed edge occurs once and its reverse occurs once."""
    directed = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]).astype(np.int64)
    n = len(mesh.vertices)
    forward = np.sort(directed[:, 0] * n + directed[:, 1])
    backward = np.sort(directed[:, 1] * n + directed[:, 0])
    return bool((np.diff(forward) > 0).all() and np.array_equal(forward, backward))


def moved(mesh: Mesh, translation: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> Mesh:
    """The mesh at `rotation` (3, 3) @ vertex + `translation` (3,)."""
    vertices = mesh.vertices if rotation is None else mesh.vertices @ np.asarray(rotation, dtype=float).T
    return Mesh(vertices + np.asarray(translation, dtype=float), mesh.faces)


def along_x(mesh: Mesh) -> Mesh:
    """The mesh turned so that its z axis points along x (and its x along y)."""
    return Mesh(mesh.vertices[:, [2, 0, 1]], mesh.faces)


def along_y(mesh: Mesh) -> Mesh:
    """The mesh turned so that its z axis points along y (and its x along z)."""
    return Mesh(mesh.vertices[:, [1, 2, 0]], mesh.faces)


def merge(parts: Iterable[Mesh | tuple[Mesh, ArrayLike]]) -> Mesh:
    """One mesh of many: each part a Mesh, or a pair of a Mesh and its 4 x 4 transform; parts may overlap."""
    vertices: list[Array] = []
    faces: list[Faces] = []
    count = 0
    for part in parts:
        mesh, transform = (part, None) if isinstance(part, Mesh) else part
        points = mesh.vertices
        if transform is not None:
            matrix = np.asarray(transform, dtype=float)
            if matrix.shape != (4, 4):
                raise MechlabError(f"merge: a transform must have shape (4, 4), got {matrix.shape}.")
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
        vertices.append(points)
        faces.append(mesh.faces + np.int32(count))
        count += len(points)
    if not vertices:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


class Shell:
    """Gathers loops of vertices, and the bands and caps between them, into one closed mesh."""

    def __init__(self) -> None:
        self._points: list[Array] = []
        self._faces: list[NDArray[np.int64]] = []
        self._count = 0

    def loop(self, points: ArrayLike, z: float | None = None) -> NDArray[np.int64]:
        """Adds (n, 2) points at height `z`, or (n, 3) points; returns their indices."""
        p = np.atleast_2d(np.asarray(points, dtype=float))
        if z is not None:
            p = np.column_stack([p, np.full(len(p), z)])
        self._points.append(p)
        self._count += len(p)
        return np.arange(self._count - len(p), self._count)

    def band(self, lower: NDArray[np.int64], upper: NDArray[np.int64]) -> None:
        """Quads between two loops of equal length; counter-clockwise loops with `upper` above give outward faces."""
        a, b, c, d = lower, np.roll(lower, -1), np.roll(upper, -1), upper
        self.faces(np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))

    def fan(self, apex: int, loop: NDArray[np.int64]) -> None:
        """Triangles from one vertex to a loop, counter-clockwise with the loop."""
        self.faces(np.column_stack([np.full(len(loop), apex), loop, np.roll(loop, -1)]))

    def cap(self, outer: NDArray[np.int64], holes: Sequence[NDArray[np.int64]] = (), up: bool = True) -> None:
        """A flat face with holes, seen along z; `up` tells which side is outside."""
        faces = triangulate(np.concatenate(self._points)[:, :2], outer, holes)
        self.faces(faces if up else faces[:, ::-1])

    def faces(self, triangles: NDArray[np.int64]) -> None:
        """Adds (m, 3) triangles of vertex indices."""
        self._faces.append(np.asarray(triangles, dtype=np.int64))

    def mesh(self) -> Mesh:
        """The mesh of all vertices and faces gathered so far."""
        return Mesh(np.concatenate(self._points), np.concatenate(self._faces).astype(np.int32))
