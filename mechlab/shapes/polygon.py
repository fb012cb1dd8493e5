"""Plane outlines and their triangulation: (n, 2) arrays of points, counter-clockwise, the last point not repeated."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def circle(radius: float, segments: int = 48, center: tuple[float, float] = (0.0, 0.0)) -> Array:
    """A regular polygon with its corners on the circle, the first one on +x of the centre."""
    t = 2.0 * math.pi * np.arange(segments) / segments
    return np.column_stack([center[0] + radius * np.cos(t), center[1] + radius * np.sin(t)])


def around_circles(centers: ArrayLike, radii: ArrayLike, segments: int = 48) -> Array:
    """The convex belt around circles: corners on the arcs, and the exact tangent points between them.

    The support point of direction u is c_i + r_i u with the largest c_i . u + r_i; it changes from circle i to j where
    (c_i - c_j) . u = r_j - r_i.
    """
    c = np.asarray(centers, dtype=float)
    r = np.asarray(radii, dtype=float)

    def point(i: int, t: float) -> Array:
        return c[i] + r[i] * np.array([math.cos(t), math.sin(t)])

    angles = 2.0 * math.pi * (np.arange(segments) + 0.5) / segments
    winners = np.argmax(np.column_stack([np.cos(angles), np.sin(angles)]) @ c.T + r, axis=1)
    points: list[Array] = []
    for k in range(segments):
        i, j, t = int(winners[k]), int(winners[(k + 1) % segments]), float(angles[k])
        points.append(point(i, t))
        if i == j:
            continue
        d = c[i] - c[j]
        base, reach = math.atan2(d[1], d[0]), math.acos(max(-1.0, min(1.0, (r[j] - r[i]) / math.hypot(*d))))
        step = min(((base + s * reach - t) % (2.0 * math.pi) for s in (1.0, -1.0)), key=abs)
        for p in (point(i, t + step), point(j, t + step)):
            if np.linalg.norm(p - points[-1]) > 1e-9 * r.max():
                points.append(p)
    return np.array(points)


def rounded_rectangle(x: float, y: float, corner: float, segments: int = 6) -> Array:
    """A rectangle of full sides x, y round the origin with corner radius `corner` (0 gives four sharp corners)."""
    if corner <= 0.0:
        return 0.5 * np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    points = []
    for quarter, (sx, sy) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        t = 0.5 * math.pi * (quarter + np.arange(segments + 1) / segments)
        center = np.array([sx * (0.5 * x - corner), sy * (0.5 * y - corner)])
        points.append(center + corner * np.column_stack([np.cos(t), np.sin(t)]))
    return np.concatenate(points)


def signed_area(points: Array) -> float:
    """Shoelace area [m^2], positive for a counter-clockwise outline."""
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def triangulate(points: ArrayLike, outer: ArrayLike, holes: Sequence[ArrayLike] = ()) -> Indices:
    """Triangles (m, 3), counter-clockwise, of `outer` without the `holes` (index arrays into (n, 2) points).

    Ear clipping over one outline, into which bridges join every hole (Eberly, "Triangulation by ear clipping").
    Every given point is used, so that neighbouring faces share their edges. Raises MechlabError when outlines cross.
    """
    p = np.asarray(points, dtype=float)
    ring = _oriented(p, np.asarray(outer), 1.0)
    rest = sorted((_oriented(p, np.asarray(h), -1.0) for h in holes), key=lambda h: -float(p[h, 0].max()))
    for k, hole in enumerate(rest):
        ring = _bridged(p, ring, hole, rest[k:])
    return _clipped(p, ring)


def _oriented(p: Array, loop: Indices, sign: float) -> Indices:
    return loop if signed_area(p[loop]) * sign > 0.0 else loop[::-1]


def _turn(a: Array, b: Array, c: Array) -> Array:
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def _bridged(p: Array, ring: Indices, hole: Indices, others: Sequence[Indices]) -> Indices:
    start = int(np.argmax(p[hole, 0]))
    m = int(hole[start])
    loops = [ring, *others]
    a = np.concatenate(loops)
    b = np.concatenate([np.roll(loop, -1) for loop in loops])
    for k in np.argsort(np.linalg.norm(p[ring] - p[m], axis=1), kind="stable"):
        v, before, after = int(ring[k]), p[ring[k - 1]], p[ring[(k + 1) % len(ring)]]
        left, right = _turn(before, p[v], p[m]) > 0, _turn(p[v], after, p[m]) > 0
        convex = _turn(before, p[v], after) > 0
        if not ((left and right) if convex else (left or right)):
            continue
        far = (a != m) & (a != v) & (b != m) & (b != v)
        pa, pb = p[a[far]], p[b[far]]
        crossing = (_turn(p[m], p[v], pa) * _turn(p[m], p[v], pb) <= 0) & (
            _turn(pa, pb, p[m]) * _turn(pa, pb, p[v]) <= 0
        )
        if not crossing.any():
            return np.concatenate([ring[: k + 1], np.roll(hole, -start), [m], ring[k:]])
    raise MechlabError("triangulate: a hole reaches outside its outline or into another hole; make the holes smaller.")


def _clipped(p: Array, ring: Indices) -> Indices:
    triangles: list[tuple[int, int, int]] = []
    ids: list[int] = ring.tolist()
    left = _Left(p[ring], ring)
    at: list[list[float]] = p.tolist()
    tiny = 1e-14 * float(np.ptp(p[ring], axis=0).max()) ** 2
    i, misses, slack = 0, 0, 0.0
    while len(ids) > 3:
        n = len(ids)
        i %= n
        a, b, c = ids[i - 1], ids[i], ids[(i + 1) % n]
        (ax, ay), (bx, by), (cx, cy) = at[a], at[b], at[c]
        if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > tiny and not left.block(a, b, c, at, slack):
            triangles.append((a, b, c))
            del ids[i]
            left.delete(i)
            misses, slack = 0, 0.0
            i += 1  # skipping one vertex keeps the triangles from becoming a fan of needles
            continue
        i, misses = i + 1, misses + 1
        if misses > n:
            if slack > 0.0:
                raise MechlabError("triangulate: the outline crosses itself or touches a hole; check the sizes.")
            misses, slack = 0, tiny  # let vertices lie on the border of an ear
    triangles.append((ids[0], ids[1], ids[2]))
    return np.array(triangles, dtype=np.int64)


class _Left:
    """The vertices that are not clipped yet: places (n, 2) and numbers (n,)."""

    def __init__(self, places: Array, ids: Indices) -> None:
        self.x, self.y, self.ids = places[:, 0].copy(), places[:, 1].copy(), ids.copy()
        self.n = len(ids)

    def delete(self, i: int) -> None:
        """Take out the vertex at place i of the outline."""
        for column in (self.x, self.y, self.ids):
            column[i : self.n - 1] = column[i + 1 : self.n]
        self.n -= 1

    def block(self, a: int, b: int, c: int, at: list[list[float]], slack: float) -> bool:
        """Whether a vertex other than its corners lies in the triangle of the vertices numbered a, b, c, which stand `at`."""
        (ax, ay), (bx, by), (cx, cy) = at[a], at[b], at[c]
        x, y = self.x[: self.n], self.y[: self.n]
        xa, ya, xb, yb, xc, yc = x - ax, y - ay, x - bx, y - by, x - cx, y - cy
        inside = (bx - ax) * ya - (by - ay) * xa >= slack
        inside &= (cx - bx) * yb - (cy - by) * xb >= slack
        inside &= (ax - cx) * yc - (ay - cy) * xc >= slack
        return any(k not in (a, b, c) for k in self.ids[: self.n][inside].tolist())
