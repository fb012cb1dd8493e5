"""Geoms of a compiled model that are no simple solids, as shapes: meshes, ellipsoids, height fields, planes; and which are shown."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array, Placement
from mechlab.mechanism.parts import FLOOR, Color, Shape, shape
from mechlab.shapes import SURFACE, mesh, surface_text

GEOM = mujoco.mjtGeom
Faces = NDArray[Any]
SHOWN_GROUPS = 3
"""MuJoCo's viewers show the groups 0, 1 and 2; files put collision geoms into higher ones."""
UNCOLORED = (0.5, 0.5, 0.5, 1.0)
"""rgba of a geom for which the file gives none: that of its material holds then."""
MOST_CELLS = 100
"""Largest number of cells of a height field along a side, as it is drawn."""


def is_shown(model: mujoco.MjModel, k: int) -> bool:
    """Whether a geom is drawn: MuJoCo's viewers show its group, or no other geom of its body (a skin may stand for it there); and it
    is not transparent."""
    if geom_color(model, k)[3] <= 0.0:
        return False
    mates = model.geom_bodyid == model.geom_bodyid[k]
    return int(model.geom_group[k]) < SHOWN_GROUPS or not np.any(model.geom_group[mates] < SHOWN_GROUPS)


def geom_color(model: mujoco.MjModel, k: int) -> Color:
    """Colour of a geom: its own, or that of its material."""
    own = tuple(float(x) for x in model.geom_rgba[k])
    material = int(model.geom_matid[k])
    if material >= 0 and np.allclose(own, UNCOLORED):
        own = tuple(float(x) for x in model.mat_rgba[material])
    r, g, b, a = (min(max(x, 0.0), 1.0) for x in own)
    return (r, g, b, a)


def surface_shape(model: mujoco.MjModel, k: int, at: Placement) -> Shape | None:
    """The shape of a mesh, ellipsoid, height field or plane; None for other geoms, and for a mesh without area."""
    kind, color, size = int(model.geom_type[k]), geom_color(model, k), model.geom_size[k]
    if kind == int(GEOM.mjGEOM_PLANE):
        return shape(FLOOR, at, color, x=2.0 * float(size[0]), y=2.0 * float(size[1]))
    found = _triangles(model, k, kind)
    if found is None:
        return None
    try:
        return Shape(SURFACE, (), at, color, "", surface_text(*found))
    except MechlabError:
        return None


def _triangles(model: mujoco.MjModel, k: int, kind: int) -> tuple[Array, Faces] | None:
    data = int(model.geom_dataid[k])
    if kind in (int(GEOM.mjGEOM_MESH), int(GEOM.mjGEOM_SDF)) and data >= 0:
        first, count = int(model.mesh_vertadr[data]), int(model.mesh_vertnum[data])
        face, faces = int(model.mesh_faceadr[data]), int(model.mesh_facenum[data])
        return model.mesh_vert[first : first + count], model.mesh_face[face : face + faces]
    if kind == int(GEOM.mjGEOM_ELLIPSOID):
        ball = mesh("sphere", {"radius": 1.0})
        return ball.vertices * model.geom_size[k], ball.faces
    if kind == int(GEOM.mjGEOM_HFIELD) and data >= 0:
        return _terrain(model, data)
    return None


def _terrain(model: mujoco.MjModel, k: int) -> tuple[Array, Faces]:
    """The upper side of a height field, at most MOST_CELLS cells along a side."""
    rows, columns, start = int(model.hfield_nrow[k]), int(model.hfield_ncol[k]), int(model.hfield_adr[k])
    x, y, height, _ = model.hfield_size[k]
    z = model.hfield_data[start : start + rows * columns].reshape(rows, columns) * height
    i = np.unique(np.linspace(0, rows - 1, min(rows, MOST_CELLS + 1)).round().astype(int))
    j = np.unique(np.linspace(0, columns - 1, min(columns, MOST_CELLS + 1)).round().astype(int))
    across, along = np.meshgrid(np.linspace(-x, x, columns)[j], np.linspace(-y, y, rows)[i])
    vertices = np.stack([across, along, z[np.ix_(i, j)]], axis=-1).reshape(-1, 3)
    index = np.arange(len(i) * len(j)).reshape(len(i), len(j))
    a, b, c, d = (v.reshape(-1) for v in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
