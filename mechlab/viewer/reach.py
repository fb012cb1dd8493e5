"""The surface of a region {margin >= 0} that a point can reach, for pages in which a mechanism is moved by hand.

Naive surface nets (Gibson 1998): one vertex for each cell of the grid that the border passes.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

COARSE, FINE = 41, 39  # points of the grid along each axis


@dataclass(frozen=True, eq=False)
class BorderSurface:
    """Triangles of a border: name, in words; vertices (n, 3) [m]; faces (m, 3), counter-clockwise seen from outside."""

    name: str
    vertices: Array
    faces: NDArray[np.int64]


def border(name: str, margin: Callable[[Array, Array, Array], Array], low: Array, high: Array) -> BorderSurface | None:
    """The border of the region of the box `low`, `high` (3,) where margin(x, y, z) >= 0, which broadcasts; None if it is
    empty. A coarse grid finds the region, a fine one about it draws it."""
    for count in (COARSE, COARSE, FINE):
        axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
        x, y, z = np.meshgrid(*axes, indexing="ij", sparse=True)
        values = np.broadcast_to(margin(x, y, z), (count,) * 3)
        inside = np.argwhere(values >= 0.0)
        if not len(inside):
            return None
        step = (high - low) / (count - 1)
        found = low + inside.min(axis=0) * step - 1.2 * step, low + inside.max(axis=0) * step + 1.2 * step
        if count == FINE:
            break
        low, high = found
    values = np.pad(values, 1, constant_values=-float(step.max()))
    vertices, faces = nets(values)
    return BorderSurface(name, low + (vertices - 1.0) * step, faces)


def nets(values: Array) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (n, 3), in grid steps, and triangles (m, 3) between values (a, b, c) >= 0 and below."""
    corners = np.array(list(itertools.product((0, 1), repeat=3)))
    cells = np.array(values.shape) - 1
    blocks = np.stack([values[tuple(slice(c, c + n) for c, n in zip(o, cells, strict=True))] for o in corners])
    inside = blocks >= 0.0
    mixed = inside.any(axis=0) & ~inside.all(axis=0)
    where = np.argwhere(mixed)
    index = np.full(mixed.shape, -1)
    index[mixed] = np.arange(len(where))
    total, count = np.zeros((len(where), 3)), np.zeros((len(where), 1))
    at = blocks[:, mixed]
    for i, j in itertools.combinations(range(8), 2):
        if np.abs(corners[i] - corners[j]).sum() != 1:
            continue
        cut = (at[i] >= 0.0) != (at[j] >= 0.0)
        share = np.where(cut, at[i] / np.where(cut, at[i] - at[j], 1.0), 0.0)[:, None]
        total += cut[:, None] * (corners[i] + share * (corners[j] - corners[i]))
        count += cut[:, None]
    faces = [_quads(values, index, axis) for axis in range(3)]
    return where + total / count, np.concatenate(faces)


def _quads(values: Array, index: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    """Two triangles for each grid edge along `axis` whose ends lie on different sides: between the four cells around."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    first, second = np.moveaxis(values, axis, 0)[:-1], np.moveaxis(values, axis, 0)[1:]
    cut = np.moveaxis((first >= 0.0) != (second >= 0.0), 0, axis)
    edges = np.argwhere(cut)
    edges = edges[(edges[:, one] > 0) & (edges[:, two] > 0)]

    def cell(a: int, b: int) -> NDArray[np.int64]:
        at = edges.copy()
        at[:, one] -= a
        at[:, two] -= b
        return index[tuple(at.T)]

    ring = np.stack([cell(1, 1), cell(0, 1), cell(0, 0), cell(1, 0)], axis=1)
    leaving = values[tuple(edges.T)] >= 0.0
    ring[~leaving] = ring[~leaving][:, ::-1]
    return np.concatenate([ring[:, [0, 1, 2]], ring[:, [0, 2, 3]]])
