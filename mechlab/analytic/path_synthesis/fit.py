"""Least squares for many linkages at once: Levenberg's and Marquardt's method with the exact Jacobian.

Unknown are the numbers of each row and, where no timing is prescribed, the crank angle of every point but the first. An angle moves its
own point, or position, alone, so the angles are eliminated from the normal equations, and what is left has ten unknowns, of a six-bar
sixteen, however many points there are.
"""

from __future__ import annotations

import numpy as np

from mechlab.analytic.path_synthesis.curves import Array, Complex, Curve
from mechlab.lazy_dataclass import dataclass

STEEPEST = 1e9
"""Damping, relative to the diagonal of the normal matrix, at which a linkage is given up."""


@dataclass(frozen=True)
class Fitted:
    """Rows (k, m), modes (k,), crank angles (k, n), sums of squared distances (k,) at the points."""

    rows: Array
    modes: Array
    angles: Array
    missed: Array


@dataclass(frozen=True)
class Limits:
    """size: longest bar [m]; least: sine of the smallest angle between coupler and link at a point, and at so many places `between`
    two points."""

    size: float
    least: float = 0.0
    between: int = 0

    def places(self, angles: Array) -> Array:
        """Crank angles (k, m) at which `least` is kept, beside those of the points (k, n)."""
        shares = np.arange(1, self.between + 1) / (self.between + 1)
        way = angles[:, :-1, None] + np.diff(angles)[..., None] * shares
        return np.reshape(way, (len(angles), -1))


def fit(targets: Complex, start: Fitted, curve: Curve, timed: bool, limits: Limits, rounds: int) -> Fitted:
    """Moves the free numbers of every row, and the angles unless `timed`, towards the points (n,), or positions (n, 2) of `guided_body`.

    A step that leads where a linkage does not assemble, or beyond the limits, is not taken.
    """
    rows, angles, modes = start.rows.copy(), np.array(start.angles), start.modes
    missed = _missed(curve.points(rows, modes, angles).point, targets)
    damping = np.full(len(rows), 1e-3)
    enough = 1e-30 * len(targets) * limits.size**2
    for _ in range(rounds):
        live = np.flatnonzero((damping < STEEPEST) & (missed > enough) & np.isfinite(missed))
        if not len(live):
            break
        by_row, by_angle = _steps(targets, rows[live], modes[live], angles[live], curve, timed, damping[live])
        tried, turned = rows[live].copy(), angles[live] + by_angle
        tried[:, curve.free] += by_row
        there = curve.points(tried, modes[live], turned)
        after = _missed(there.point, targets)
        with np.errstate(invalid="ignore"):
            flat = np.min(np.abs(there.margin), axis=1) < limits.least
            if limits.between:
                on_way = np.abs(curve.points(tried, modes[live], limits.places(turned)).margin)
                flat |= ~(np.min(on_way, axis=1) >= limits.least)
        after[flat | (curve.widest(tried) > limits.size) | (np.min(tried[:, list(curve.lengths)], axis=1) <= 0.0)] = np.inf
        better = after < missed[live]
        stalled = better & (after > missed[live] * (1.0 - 1e-9))
        taken = live[better]
        rows[taken], angles[taken], missed[taken] = tried[better], turned[better], after[better]
        damping[live] = np.where(better, np.maximum(damping[live] * 0.2, 1e-15), damping[live] * 6.0)
        damping[live[stalled]] = STEEPEST
    return Fitted(rows, modes, angles, missed)


def _steps(
    targets: Complex, rows: Array, modes: Array, angles: Array, curve: Curve, timed: bool, damping: Array
) -> tuple[Array, Array]:
    """Steps of the free numbers (k, m) and of the angles (k, n)."""
    here = curve.points(rows, modes, angles)
    by_size, by_angle = curve.slopes(rows, here, angles)
    k, n, m = *angles.shape, len(curve.free)
    complex_j = by_size[..., curve.free].reshape(k, n, -1, m)
    j = np.concatenate([complex_j.real, complex_j.imag], axis=2)
    rate, gap = (np.concatenate([z.real, z.imag], axis=2) for z in (by_angle.reshape(k, n, -1), (here.point - targets).reshape(k, n, -1)))
    flat, r = j.reshape(k, -1, m), gap.reshape(k, -1)
    normal, slope = np.swapaxes(flat, 1, 2) @ flat, (np.swapaxes(flat, 1, 2) @ r[..., None])[..., 0]
    diagonal = np.arange(m)
    weight = normal[:, diagonal, diagonal].copy()
    normal[:, diagonal, diagonal] += damping[:, None] * weight + 1e-15 * np.max(weight, axis=1, keepdims=True) + 1e-300
    if timed:
        return np.linalg.solve(normal, -slope[..., None])[..., 0], np.zeros_like(angles)
    # rows of the angles: own = |dP/dt|^2, coupling = dP/dt . dP/dx, pull = dP/dt . gap; the first angle stays, as the crank's phase is free
    own = (1.0 + damping[:, None]) * np.sum(rate * rate, axis=-1)
    own[:, 0] = np.inf
    coupling, pull = np.sum(rate[..., None] * j, axis=2), np.sum(rate * gap, axis=-1)
    shared = np.swapaxes(coupling / own[..., None], 1, 2)
    normal = normal - shared @ coupling
    step = np.linalg.solve(normal, -(slope - (shared @ pull[..., None])[..., 0])[..., None])[..., 0]
    return step, -(pull + (coupling @ step[..., None])[..., 0]) / own


def _missed(found: Complex, targets: Complex) -> Array:
    gap = (found - targets).reshape(len(found), -1)
    out = np.sum(gap.real**2 + gap.imag**2, axis=-1)
    return np.where(np.isfinite(out), out, np.inf)
