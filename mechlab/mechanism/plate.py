"""The flat plate with rounded ends round a set of points: the points of its plane within `radius` of their convex hull.

Area, centre and second moments are exact: the region is the hull, a strip of the width `radius` along each edge, and at
each corner a circular sector between the normals of its two edges.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.inertia import Inertia


@dataclass(frozen=True)
class Area:
    """Area [m2], first moments (2,) [m3] and second moments (2, 2) [m4], the integrals of 1, p and p p^T, about the origin."""

    area: float
    first: Array
    second: Array

    def __add__(self, other: Area) -> Area:
        return Area(self.area + other.area, self.first + other.first, self.second + other.second)

    @property
    def centre(self) -> Array:
        """(2,) centre of the area [m]."""
        return self.first / self.area

    @property
    def central(self) -> Array:
        """(2, 2) second moments about the centre [m4]."""
        return self.second - np.outer(self.first, self.first) / self.area

    def moved(self, by: Array) -> Area:
        """The same area, shifted `by` (2,) [m]."""
        mixed = np.outer(by, self.first)
        return Area(
            self.area,
            self.first + self.area * by,
            self.second + mixed + mixed.T + self.area * np.outer(by, by),
        )


def convex_hull(points: ArrayLike) -> Array:
    """The corners (k, 2) of the convex hull of (n, 2) points, counter-clockwise; two for points on one line (Andrew 1979)."""
    ordered = sorted({(float(x), float(y)) for x, y in np.asarray(points, dtype=float)})

    def chain(items: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for p in items:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], p) <= 0.0:
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return np.array(ordered if len(ordered) < 3 else chain(ordered) + chain(ordered[::-1]))


def _turn(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def corners(hull: Array) -> Iterator[tuple[Array, float, float]]:
    """Each corner of a hull with the direction [rad] of the normal of the edge before it, and the turn to the next one."""
    edges = np.roll(hull, -1, axis=0) - hull
    normals = [math.atan2(-e[0], e[1]) for e in edges]
    for k, corner in enumerate(hull):
        turn = (normals[k] - normals[k - 1]) % (2.0 * math.pi)
        # a convex corner turns by at most pi; a flat one whose rounded turn is negative comes out near 2 pi
        yield corner, normals[k - 1], turn if turn < 1.5 * math.pi else 0.0


def plate_outline(points: ArrayLike, radius: float, segments: int = 48) -> Array:
    """The outline (k, 2) of the plate, counter-clockwise; `segments` to a full circle."""
    found: list[Array] = []
    for corner, start, turn in corners(convex_hull(points)):
        steps = max(1, math.ceil(segments * turn / (2.0 * math.pi)))
        angles = start + turn * np.arange(steps + 1) / steps
        found.append(corner + radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.concatenate(found)


def plate_area(points: ArrayLike, radius: float) -> Area:
    """Exact moments of the points within `radius` [m] of the convex hull of `points` (n, 2) [m], n >= 2."""
    hull = convex_hull(points)
    total = _polygon(hull)
    for a, b in zip(hull, np.roll(hull, -1, axis=0), strict=True):
        along = (b - a) / np.linalg.norm(b - a)
        out = radius * np.array([along[1], -along[0]])
        total += _polygon(np.array([a, a + out, b + out, b]))
    for corner, start, turn in corners(hull):
        total += _sector(radius, start, turn).moved(corner)
    return total


def _polygon(p: Array) -> Area:
    """Moments of a counter-clockwise polygon (n, 2) by Green's theorem."""
    q = np.roll(p, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    first = cross @ (p + q) / 6.0
    ends = np.einsum("n,ni,nj->ij", cross, p, p) + np.einsum("n,ni,nj->ij", cross, q, q)
    mixed = np.einsum("n,ni,nj->ij", cross, p, q)
    return Area(float(cross.sum()) / 2.0, first, (2.0 * ends + mixed + mixed.T) / 24.0)


def _sector(radius: float, start: float, turn: float) -> Area:
    """Moments of a circular sector about its centre."""
    end = start + turn
    first = np.array([math.sin(end) - math.sin(start), math.cos(start) - math.cos(end)]) * radius**3 / 3.0
    sine, cosine = (math.sin(2 * end) - math.sin(2 * start)) / 2.0, (math.cos(2 * start) - math.cos(2 * end)) / 2.0
    second = np.array([[turn + sine, cosine], [cosine, turn - sine]]) * radius**4 / 8.0
    return Area(radius**2 * turn / 2.0, first, second)


def plate_inertia(points: ArrayLike, radius: float, thickness: float, mass: float) -> Inertia:
    """The uniform plate of a mass [kg], its middle plane z = 0, in the axes of the points:
    Ixx = s int(y^2) + m t^2 / 12, Izz = s int(x^2 + y^2), Ixy = -s int(x y) about its centre, with s = m / area."""
    area = plate_area(points, radius)
    (xx, xy), (_, yy) = (area.central * mass / area.area).tolist()
    thick = mass * thickness**2 / 12.0
    x, y = area.centre.tolist()
    return Inertia(mass, (x, y, 0.0), (yy + thick, xx + thick, xx + yy, -xy, 0.0, 0.0))
