"""Pseudo-arclength along the closed curve of all positions of a driven group: it passes limit positions (Keller 1977)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.analytic.assur.folds import Family
from mechlab.analytic.assur.plane import Real, dot
from mechlab.analytic.assur.two_loops import closure_jacobian
from mechlab.errors import Untrustworthy


@dataclass(frozen=True)
class ClosedCurve:
    """Positions along the curve: crank, theta_t, theta_u (n,) continuous, the last one equal to the first modulo full turns.

    turning_points: crank angles at which the crank reversed (limit positions between samples). net_turns of the crank.
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
    family: Family, crank: float, theta_t: float, theta_u: float, step: float = 0.05, most: int = 20_000
) -> ClosedCurve:
    """The curve of positions through one mode, followed until it comes back to its start.

    Each step goes along the tangent by `step` [rad] and returns by Newton square to it; it is halved where the tangent
    turns by more than 0.1. Raises Untrustworthy when it does not close within `most` steps.
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
    path, turns, h, away = [x], [], step, False
    for _ in range(most):
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
        away = away or float(np.linalg.norm(miss)) > 3.0 * step
        if away and np.linalg.norm(miss) < 1.2 * step and miss @ along > -step * step:
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
