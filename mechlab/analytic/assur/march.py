"""A dyad over a path of its drive: kept in its mode where that is one path, stopped where two paths meet or none goes on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.dyads import ChangePoint, Dyad
from mechlab.analytic.assur.plane import Real
from mechlab.errors import NoSolution

CHANGE = 1e-6
"""A sine of the transmission angle below this on the way is a change point: rounding alone would decide the mode."""
_GRID = np.radians(0.5)


def march(family: Callable[[Real], Dyad], drive: ArrayLike, change: float = CHANGE) -> Dyad:
    """The dyad at the drive positions (n,) [rad or m], in its fixed mode, when the way between them stays in one mode.

    family: drive positions to the Dyad there. Between the samples the discriminant (quality squared) is looked at every
    half degree and each of its minima is searched to the bottom, whatever the step. Below 0 there is a gap: NoSolution,
    that names the arc. Below `change` squared two modes meet: ChangePoint, because either continuation is a path.
    """
    asked = np.atleast_1d(np.asarray(drive, dtype=float))

    def level(x: ArrayLike) -> Real:
        return np.asarray(family(np.atleast_1d(np.asarray(x, dtype=float))).discriminant)

    pieces = [
        np.linspace(a, b, max(2, int(np.ceil(abs(b - a) / _GRID))), endpoint=False)
        for a, b in zip(asked[:-1], asked[1:], strict=True)
    ]
    lowest(level, np.concatenate([*pieces, asked[-1:]]), change)
    return family(asked).require()


def lowest(level: Callable[[Real], Real], grid: Real, change: float = CHANGE) -> float:
    """The smallest discriminant along a fine grid, minima between samples included. Raises as `march`."""
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
