"""Limit positions of a driven class III or IV group: where two modes merge, solved exactly, and the arcs between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechlab.analytic.assur.plane import Real
from mechlab.analytic.assur.two_loops import TwoLoops, all_modes, determinant
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

Family = Callable[[Real], TwoLoops]
"""Gives a group at angles (n,) [rad] of its crank, with wd and wdd for a crank rate of 1 rad/s."""

SCAN = 720  # samples of a turn of the crank
_STEP = 1e-6  # [rad] of the central differences
_LEVELS = 14  # zooms by four


@dataclass(frozen=True)
class Fold:
    """A limit position: crank, theta_t, theta_u [rad]. opens = +1: two modes appear as the crank angle grows; -1: they
    merge and vanish there."""

    crank: float
    theta_t: float
    theta_u: float
    opens: int


def solve_fold(family: Family, crank: float, theta_t: float, theta_u: float, opens: int = 0) -> Fold:
    """Newton on both closures and det J = 0 in (theta_t, theta_u, crank), from a start nearby.

    The gradient is a central difference; the solution is as exact as the residual, about 1e-15. Raises MechlabError when
    it does not converge or leaves the neighbourhood.
    """
    x = np.array([theta_t, theta_u, crank])
    start = x.copy()
    size = float(family(np.array([crank])).scale.ravel()[0])

    def residual(points: Real) -> Real:
        """(k, 3) rows of points -> (k, 3) scaled residuals."""
        group = family(points[:, 2])
        closure = group.residual(points[:, 0], points[:, 1]) / size
        return np.column_stack([*closure, determinant(group, points[:, 0], points[:, 1]) / size**2])

    for _ in range(40):
        shifts = np.vstack([np.zeros(3), _STEP * np.eye(3), -_STEP * np.eye(3)])
        f = residual(x + shifts)
        jacobian = ((f[1:4] - f[4:7]) / (2.0 * _STEP)).T
        dx = -np.linalg.lstsq(jacobian, f[0], rcond=1e-12)[0]
        dx *= min(1.0, 0.1 / max(float(np.max(np.abs(dx))), 1e-300))
        x = x + dx
        if np.max(np.abs(dx)) < 1e-14:
            break
    if np.max(np.abs(residual(x[None])[0])) > 1e-12 or np.max(np.abs(x - start)) > 1.0:
        raise MechlabError(f"no limit position was found near the crank angle {crank:.6g} rad; start nearer to one.")
    return Fold(float(x[2]), float(x[0]), float(x[1]), opens)


def folds(family: Family, start: float = -np.pi, stop: float = np.pi, scan: int = SCAN) -> tuple[Fold, ...]:
    """All limit positions between two crank angles, in order.

    Where the number of modes changes between two samples of the scan, the change is bisected and solved exactly.
    Elsewhere the minima of |det J| are located, so that an arc narrower than a sample is found as well.
    """
    grid = np.linspace(start, stop, scan + 1)
    modes = all_modes(family(grid))
    found: list[Fold] = []
    for k in np.flatnonzero(np.diff(modes.count)):
        found += _between(family, grid[k], grid[k + 1], int(modes.count[k]), int(modes.count[k + 1]))
    for low, high in _suspects(grid, modes.count, modes.det):
        found += _hidden(family, low, high)
    return _sorted(found)


def empty_arcs(family: Family, scan: int = SCAN) -> tuple[tuple[float, float], ...]:
    """Arcs of crank angle (low, high) without any mode, low in [-pi, pi), high > low; ((-pi, pi),) when it never closes."""
    cut = folds(family, scan=scan)
    if not cut:
        return () if int(all_modes(family(np.array([0.0]))).count[0]) else ((-np.pi, np.pi),)
    ends = [f.crank for f in cut]
    bounds = [*ends, ends[0] + 2 * np.pi]
    middles = np.array([0.5 * (a + b) for a, b in zip(bounds, bounds[1:], strict=False)])
    empty = all_modes(family(middles)).count == 0
    return tuple((bounds[k], bounds[k + 1]) for k in range(len(ends)) if empty[k] and bounds[k + 1] - bounds[k] > 1e-12)


def _between(family: Family, low: float, high: float, before: int, after: int) -> list[Fold]:
    """Folds in an interval at whose ends the number of modes differs."""
    out: list[Fold] = []
    for _ in range(3):
        if before == after:
            break
        a, b, first = low, high, before
        while b - a > 1e-7:
            middle = 0.5 * (a + b)
            now = int(all_modes(family(np.array([middle]))).count[0])
            a, b = (middle, b) if now == first else (a, middle)
        fold = _solve_from(family, a, b, first)
        if fold is None:
            break
        out.append(fold)
        low, before = b, int(all_modes(family(np.array([b]))).count[0])
    return out


def _solve_from(family: Family, a: float, b: float, before: int) -> Fold | None:
    """The fold between a and b, from the pair of modes that is about to merge on the side that has more."""
    after = int(all_modes(family(np.array([b]))).count[0])
    side, opens = (a, -1) if before > after else (b, 1)
    modes = all_modes(family(np.array([side])))
    m = int(modes.count[0])
    order = np.argsort(np.abs(modes.det[0, :m]))
    for k in order[:2]:
        try:
            return solve_fold(family, side, float(modes.theta_t[0, k]), float(modes.theta_u[0, k]), opens)
        except MechlabError:
            continue
    return None


def _suspects(grid: Real, count: np.ndarray, det: Real) -> list[tuple[float, float]]:
    """Intervals round local minima of the smallest |det J|, where the number of modes does not change at the samples."""
    smallest = np.where(count > 0, np.nanmin(np.where(np.isnan(det), np.inf, np.abs(det)), axis=1), np.inf)
    out = []
    for k in range(1, len(grid) - 1):
        same = count[k - 1] == count[k] == count[k + 1] > 0
        if same and smallest[k] <= smallest[k - 1] and smallest[k] <= smallest[k + 1]:
            out.append((grid[k - 1], grid[k + 1]))
    return out


def _hidden(family: Family, low: float, high: float) -> list[Fold]:
    """Folds near the smallest |det J| between low and high: zoom in until modes vanish, or |det J| no longer falls."""
    first = int(all_modes(family(np.array([low]))).count[0])
    last = np.inf
    for _ in range(_LEVELS):
        grid = np.linspace(low, high, 9)
        modes = all_modes(family(grid))
        change = np.flatnonzero(modes.count != first)
        if len(change):
            i, j = max(change[0] - 1, 0), min(change[-1] + 1, 8)
            lost, back = int(modes.count[change[0]]), int(modes.count[change[-1]])
            pieces = _between(family, grid[i], grid[change[0]], int(modes.count[i]), lost)
            return pieces + _between(family, grid[change[-1]], grid[j], back, int(modes.count[j]))
        smallest = np.min(np.where(np.isnan(modes.det), np.inf, np.abs(modes.det)), axis=1)
        k = int(np.argmin(smallest))
        if smallest[k] > 0.9 * last:
            return []
        last = float(smallest[k])
        low, high = grid[max(k - 1, 0)], grid[min(k + 1, 8)]
    return []


def _sorted(found: list[Fold]) -> tuple[Fold, ...]:
    out: list[Fold] = []
    for fold in sorted(found, key=lambda f: f.crank):
        near = [
            g for g in out if abs(g.crank - fold.crank) < 1e-9 and abs(np.sin(0.5 * (g.theta_t - fold.theta_t))) < 1e-6
        ]
        if not near:
            out.append(fold)
    return tuple(out)
