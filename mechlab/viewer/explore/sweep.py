"""Sweeps: closed poses of one drive over its range, as the page reads them; and how the page blends them.

`border` makes the surface of a region {margin >= 0} that a point can reach: naive surface nets (Gibson 1998), one
vertex for each cell of the grid that the border passes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism import Loop
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


STENCIL = 6
"""Samples that one position in the page is blended from (a polynomial of degree 5)."""


@dataclass(frozen=True, eq=False)
class Load:
    """A force or torque along a sweep: kind "force" or "torque"; on: the body it acts on, by: the one that feels the
    opposite ("" for a weight); points, vectors: (k, 3) world axes, NaN where they have no bound."""

    name: str
    kind: str
    unit: str
    on: str
    by: str
    points: Array
    vectors: Array

    def packed(self, block: Any, bodies: tuple[str, ...]) -> dict[str, Any]:
        """The load as JSON values and references of arrays in `block`."""
        return {
            "name": self.name, "kind": self.kind, "unit": self.unit,
            "on": bodies.index(self.on), "by": bodies.index(self.by) if self.by in bodies else -1,
            "points": block.add(self.points, "f4"), "vectors": block.add(self.vectors, "f4"),
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Sweep:
    """One drive moved over its range, the others at home.

    name, unit: of the joint or shaft; q: (k, nq) closed coordinates at `values` (k,), which grow along `arc` (k,), the
    length of the curve. poses: (k, nb, 4, 4); rates: (k, nv) per rate of the drive, NaN at a fold. closeness: (k,) 0
    at a singularity, 1 at the farthest from it. low, high: ends of the slider; beyond `values` no pose exists, and
    `low_reason`, `high_reason` say why. home: value at home. error: of the blend, in sizes and radians. loads: forces at the
    constant rate `rate` of the drive.
    """

    name: str
    unit: str
    arc: Array
    values: Array
    q: Array
    rates: Array
    poses: Array
    closeness: Array
    low: float
    high: float
    low_reason: str
    high_reason: str
    home: float
    error: float
    loads: tuple[Load, ...] = ()
    rate: float = 1.0

    def place(self, value: float) -> float:
        """The arc at a value of the drive, by bisection of the blend; outside of the range, its end."""
        if value <= self.values[0]:
            return float(self.arc[0])
        if value >= self.values[-1]:
            return float(self.arc[-1])
        i = int(np.searchsorted(self.values, value, side="right")) - 1
        low, high = float(self.arc[i]), float(self.arc[i + 1])
        for _ in range(60):
            middle = 0.5 * (low + high)
            first, weights = lagrange(self.arc, middle)
            low, high = (middle, high) if weights @ self.values[first : first + STENCIL] < value else (low, middle)
        return 0.5 * (low + high)


@dataclass(frozen=True, eq=False)
class Exploration:
    """Sweeps of all drives of a mechanism. size [m]: the unit of gaps; mode: the assembly mode in words; loops:
    those whose closure the page checks; reach: surface of the region that a point can reach."""

    sweeps: tuple[Sweep, ...]
    size: float
    mode: str
    loops: tuple[Loop, ...]
    bodies: tuple[str, ...]
    reach: BorderSurface | None = None

    def packed(self, block: Any, pack_motion: Callable[[Array, Any, str], Any]) -> dict[str, Any]:
        """The exploration as JSON values and references of arrays in `block`."""
        return {
            "size": self.size, "mode": self.mode,
            "loops": [_packed_loop(x, self.bodies) for x in self.loops],
            "reach": None if self.reach is None else {
                "name": self.reach.name, "positions": block.add(self.reach.vertices, "f4"), "faces": block.add(self.reach.faces, "u2"),
            },
            "sweeps": [
                {
                    "name": s.name, "unit": s.unit, "low": s.low, "high": s.high, "home": s.home,
                    "lowReason": s.low_reason, "highReason": s.high_reason,
                    "arc": block.add(s.arc, "f8"), "values": block.add(s.values, "f8"),
                    "motion": pack_motion(s.poses, block, "f4" if _near_origin(s.poses, self.size) else "f8"),
                    "closeness": block.add(s.closeness, "f4"),
                    "rate": s.rate, "loads": [x.packed(block, self.bodies) for x in s.loads],
                }
                for s in self.sweeps
            ],
        }  # fmt: skip


def _near_origin(poses: Array, size: float) -> bool:
    """True when 32 bits hold the positions to 1e-7 of `size`."""
    return float(np.abs(poses[..., :3, 3]).max(initial=0.0)) < size


def _packed_loop(loop: Loop, bodies: tuple[str, ...]) -> dict[str, Any]:
    """Ends of a loop, and along which axes of its first end they must meet."""
    axes = "xy" if loop.kind in ("cylindrical", "prismatic") else "xyz"
    return {
        "name": loop.name, "a": bodies.index(loop.body_a), "b": bodies.index(loop.body_b), "length": loop.length,
        "axes": len(axes), "placement": loop.placement_a.matrix().T.reshape(-1).tolist(),
        "point": [float(x) for x in loop.placement_b.translation],
    }  # fmt: skip


def lagrange(nodes: Array, at: float) -> tuple[int, Array]:
    """First sample and weights (STENCIL,) of the polynomial through the samples around `at`; the page does the same."""
    here = int(np.searchsorted(nodes, at, side="right")) - 1
    first = min(max(here - (STENCIL // 2 - 1), 0), len(nodes) - STENCIL)
    x = nodes[first : first + STENCIL]
    return first, np.array(
        [math.prod((at - x[j]) / (x[i] - x[j]) for j in range(STENCIL) if j != i) for i in range(STENCIL)]
    )


def blend_weights(sweep: Sweep, value: float) -> tuple[int, Array]:
    """As `lagrange`, at a value of the drive."""
    return lagrange(sweep.arc, sweep.place(value))


def blend_error(nodes: Array, poses: Array, at: Array, between: Array, size: float) -> float:
    """Largest difference of the blend of poses (k, nb, 4, 4) at `nodes` (k,) to `between` (n, nb, 4, 4) at `at` (n,)."""
    worst = 0.0
    for x, pose in zip(at, between, strict=True):
        first, weights = lagrange(nodes, float(x))
        error = np.abs(np.tensordot(weights, poses[first : first + STENCIL], axes=1) - pose)
        worst = max(worst, float(error[:, :3, 3].max(initial=0.0)) / size, float(error[:, :3, :3].max(initial=0.0)))
    return worst
