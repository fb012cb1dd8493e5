"""Reach and dexterity of a workspace region without a grid: continuous in the parameters, as an optimizer needs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize.elementwise import find_root

from mechlab.analytic.regions import Clause, Region
from mechlab.errors import MechlabError
from mechlab.experiment.entry import WorkspaceMap, WorkspaceRecipe
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

RAYS, ROUNDS, CLOSER = 72, 3, 17
"""Number of directions; rounds of refinement around the worst one, and directions in each. The worst angle is found to
2e-4 rad, the radius to 1e-9."""
STEPS = 64
FULL_TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Plane:
    """The clauses of a region that depend on its first two axes alone; top: the largest radius considered [m]."""

    axes: tuple[str, str]
    clauses: tuple[Clause, ...]
    top: float

    def margin(self, u: Array, v: Array) -> Array:
        """Smallest margin of the clauses [m] at points u, v; negative outside."""
        points = dict(zip(self.axes, (u, v), strict=True))
        parts = [c.margin({k: points[k] for k in c.axes}) for c in self.clauses]
        return np.asarray(np.minimum.reduce(np.broadcast_arrays(*parts)))


def plane_of(region: Region, recipe: WorkspaceRecipe, owner: str) -> Plane:
    """The plane of the first two axes of a region. Raises MechlabError where no clause depends on these axes alone."""
    u, v, *_ = recipe.grid
    clauses = tuple(c for c in region.clauses if set(c.axes) <= {u, v})
    if not clauses:
        raise MechlabError(f"{owner}: reach: no clause of the workspace looks at {u} and {v} alone.")
    top = max(abs(float(end)) for k in (u, v) for end in (recipe.grid[k].low, recipe.grid[k].high))
    return Plane((u, v), clauses, top)


def reach(plane: Plane, rays: int = RAYS) -> float:
    """Radius [m] of the largest disc about the axis in which every clause holds; where a clause fails on the axis
    itself, the (negative) margin there."""
    centre = float(plane.margin(np.zeros(1), np.zeros(1))[0])
    if centre < 0.0:
        return centre
    angles = np.linspace(0.0, FULL_TURN, rays, endpoint=False)
    return _worst(lambda a: exits(plane, a), angles)


def exits(plane: Plane, angles: Array) -> Array:
    """Radius (n,) [m] at which a ray from the axis first leaves the region; `top` where it does not.

    Only rays that may be the shortest are refined; the others are given to a grid step.
    """
    radii = np.linspace(0.0, plane.top, STEPS + 1)
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    outside = plane.margin(c * radii, s * radii) < 0.0
    first = np.where(outside.any(axis=1), np.argmax(outside, axis=1), STEPS + 1)
    out = np.full(len(angles), plane.top)
    near = first <= min(int(first.min()) + 1, STEPS)  # other rays leave farther out
    out[~near] = radii[np.minimum(first[~near], STEPS)]
    if near.any():
        cosine, sine = c[near, 0], s[near, 0]
        bracket = (radii[first[near] - 1], radii[first[near]])
        found = find_root(lambda r, x, y: plane.margin(r * x, r * y), bracket, args=(cosine, sine))
        out[near] = found.x
    return out


def least_within(item: WorkspaceMap, radius: float, rays: int = RAYS) -> float:
    """Smallest value of a map over the disc about the axis."""
    u, v = item.axes

    def value(a: Array, r: Array) -> Array:
        return np.asarray(item.function({u: r * np.cos(a), v: r * np.sin(a)}))

    angles = np.linspace(0.0, FULL_TURN, rays, endpoint=False)
    size = max(radius, 0.0)
    inner = float(np.min(value(angles[:, None], size * np.array([0.0, 0.25, 0.5, 0.75])[None, :])))
    if size == 0.0:
        return inner
    return min(inner, _worst(lambda a: value(a, np.full(len(a), size)), angles))


def _worst(function: Callable[[Array], Array], angles: Array) -> float:
    """The smallest value over all angles: on a grid, then refined around its minimum."""
    width = angles[1] - angles[0]
    values = function(angles)
    best, at = float(values.min()), float(angles[int(np.argmin(values))])
    for _ in range(ROUNDS):
        close = at + np.linspace(-width, width, CLOSER)
        values = function(close)
        k = int(np.argmin(values))
        if values[k] < best:
            best, at = float(values[k]), float(close[k])
        width *= 2.0 / (CLOSER - 1)
    return best
