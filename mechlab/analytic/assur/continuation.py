"""Continuation along a drive: the closed curve of all positions of a class III or IV group by pseudo-arclength, which passes
limit positions (Keller 1977), and a dyad followed in its assembly mode over a path of its drive.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.dyads import ChangePoint, Dyad
from mechlab.analytic.assur.folds import Family
from mechlab.analytic.assur.plane import Real, dot
from mechlab.analytic.assur.two_loops import closure_jacobian
from mechlab.errors import NoSolution, Untrustworthy
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class ClosedCurve:
    """Positions along the curve: crank, theta_t, theta_u (n,) [rad], continuous; the ends agree modulo full turns.

    turning_points: crank angles at which the crank reverses [rad]: limit positions, interpolated between samples.
    """

    crank: Real
    theta_t: Real
    theta_u: Real
    turning_points: tuple[float, ...]

    @property
    def net_turns(self) -> int:
        """Full turns of the crank along the whole curve: 0 when it swings."""
        return round((self.crank[-1] - self.crank[0]) / (2 * np.pi))


def closed_curve(
    family: Family, crank: float, theta_t: float, theta_u: float, step: float = 0.05, max_steps: int = 20_000
) -> ClosedCurve:
    """The curve of positions through one mode, followed until it comes back to its start.

    Each step goes `step` [rad] along the tangent; Newton then returns to the curve at right angles to it. The step is
    halved where the tangent turns by more than 0.1 rad. Raises Untrustworthy when it does not close within `max_steps`
    steps.
    """
    size = float(family(np.array([crank])).scale.ravel()[0])

    def system(x: Real) -> tuple[Real, Real]:
        """F (2,) and its gradient (2, 3) in (theta_t, theta_u, crank), scaled."""
        group = family(x[2:])
        a, b, c, d, z = closure_jacobian(group, x[:1], x[1:2])
        f = 0.5 * (dot(z, z) - group.l**2)[:, 0]
        slope = dot(z, group.wd + 0 * z)[:, 0]
        return f / size, np.array([[a[0], b[0], slope[0]], [c[0], d[0], slope[1]]]) / size

    def tangent(x: Real, before: Real | None) -> Real:
        g = system(x)[1]
        t = np.cross(g[0], g[1])
        t = t / max(float(np.linalg.norm(t)), 1e-300)
        return -t if before is not None and t @ before < 0.0 else t

    x = np.array([theta_t, theta_u, crank])
    start, along = x.copy(), tangent(x, None)
    if along[2] < 0.0:
        along = -along
    path, turns, h, left_start = [x], [], step, False
    for _ in range(max_steps):
        new = _correct(system, x + h * along, along)
        if new is None or tangent(new, along) @ along < 0.995:
            h *= 0.5
            if h < 1e-9:
                break
            continue
        fresh = tangent(new, along)
        if along[2] * fresh[2] < 0.0:
            turns.append(float(x[2] + (new[2] - x[2]) * along[2] / (along[2] - fresh[2])))
        x, along = new, fresh
        path.append(x)
        h = min(step, 1.3 * h)
        miss = (x - start + np.pi) % (2 * np.pi) - np.pi
        left_start = left_start or float(np.linalg.norm(miss)) > 3.0 * step
        if left_start and np.linalg.norm(miss) < 1.2 * step and miss @ along > -step * step:
            path[-1] = x - miss
            points = np.array(path)
            return ClosedCurve(points[:, 2], points[:, 0], points[:, 1], tuple(turns))
    raise Untrustworthy(
        f"the curve of positions through the crank angle {crank:.6g} rad did not close within {len(path)} steps of at most "
        f"{step:g} rad; try a smaller step, or a start away from a point where curves cross."
    )


def _correct(system: object, x: Real, along: Real) -> Real | None:
    foot = x.copy()
    for _ in range(12):
        f, g = system(x)  # type: ignore[operator]
        dx = np.linalg.solve(np.vstack([g, along]), -np.array([*f, along @ (x - foot)]))
        x = x + dx
        if np.max(np.abs(dx)) < 1e-12:
            return x
    return x if np.max(np.abs(system(x)[0])) < 1e-12 else None  # type: ignore[operator]


CHANGE = 1e-6
"""Sine of the transmission angle below which a pose is a change point: rounding alone would decide the mode."""
_GRID = np.radians(0.5)


def follow_dyad(family: Callable[[Real], Dyad], drive: ArrayLike, change: float = CHANGE) -> Dyad:
    """The dyad at the drive positions (n,) [rad or m] in its fixed mode, checked over the whole path between them.

    family: gives the Dyad at drive positions. Between the samples the discriminant (quality squared) is evaluated every
    0.0087 rad or m, and each of its minima is located. Raises NoSolution, naming the arc, where it is negative: no
    assembly; ChangePoint where it is below `change` squared: two modes meet and either may follow.
    """
    asked = np.atleast_1d(np.asarray(drive, dtype=float))

    def level(x: ArrayLike) -> Real:
        return np.asarray(family(np.atleast_1d(np.asarray(x, dtype=float))).discriminant)

    pieces = [
        np.linspace(a, b, max(2, int(np.ceil(abs(b - a) / _GRID))), endpoint=False)
        for a, b in zip(asked[:-1], asked[1:], strict=True)
    ]
    lowest_discriminant(level, np.concatenate([*pieces, asked[-1:]]), change)
    return family(asked).require()


def lowest_discriminant(level: Callable[[Real], Real], grid: Real, change: float = CHANGE) -> float:
    """The smallest discriminant along a fine grid, minima between samples included. Raises as `follow_dyad`."""
    values = level(grid)
    if np.min(values) < 0.0:
        _gap(level, grid, values)
    best = float(np.min(values))
    k = int(np.argmin(values))
    at = float(grid[k])
    for j in range(len(grid)):
        left, right = grid[max(j - 1, 0)], grid[min(j + 1, len(grid) - 1)]
        minimum = values[j] <= values[max(j - 1, 0)] and values[j] <= values[min(j + 1, len(grid) - 1)]
        if not minimum or left == right or values[j] > 0.05:
            continue
        x, y = _bottom(level, left, right)
        if y < best:
            best, at = y, x
    if best < -(change**2):
        fine = np.sort(np.append(grid, at))
        _gap(level, fine, level(fine))
    if best < change**2:
        raise ChangePoint(
            f"change point at {at:.9g} (sine of the transmission angle {np.sqrt(max(best, 0.0)):.2g}): two assembly modes "
            "meet here and either may follow. Stop before it, or state which one goes on by starting behind it.",
            at,
        )
    return best


def _bottom(level: Callable[[Real], Real], low: float, high: float) -> tuple[float, float]:
    """Minimum between low and high by repeated zooming."""
    for _ in range(24):
        grid = np.linspace(low, high, 9)
        values = level(grid)
        k = int(np.argmin(values))
        if values[k] < 0.0:
            return float(grid[k]), float(values[k])
        low, high = grid[max(k - 1, 0)], grid[min(k + 1, 8)]
    return float(grid[k]), float(values[k])


def _gap(level: Callable[[Real], Real], grid: Real, values: Real) -> None:
    """Raise NoSolution with the arc (as far as the grid shows it, its ends bisected)."""
    bad = np.flatnonzero(values < 0.0)
    first, last = int(bad[0]), int(bad[0])
    while last + 1 < len(grid) and values[last + 1] < 0.0:
        last += 1
    ends = []
    for inside, outside in ((first, first - 1), (last, last + 1)):
        if not 0 <= outside < len(grid):
            ends.append(float(grid[inside]))
            continue
        a, b = float(grid[outside]), float(grid[inside])
        for _ in range(60):
            middle = 0.5 * (a + b)
            a, b = (middle, b) if level(np.array([middle]))[0] >= 0.0 else (a, middle)
        ends.append(b)
    raise NoSolution(
        f"no assembly exists between {ends[0]:.9g} and {ends[1]:.9g} on the way from {grid[0]:.6g} to {grid[-1]:.6g}. "
        "Stay on one side of this arc, or change the lengths."
    )
