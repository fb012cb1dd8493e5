"""Rest: Newton on the constraint manifold for the pose in which weight, springs, servos and constant loads balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.errors import NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.study.modes.dynamics import Dynamics, Linear, linear

ITERATIONS = 300
LARGEST = 0.3
"""No coordinate moves farther in one step [rad or m]."""
BALANCED = 1e-9
"""Share of the load that may stay when rounding stops the descent."""


@dataclass(frozen=True)
class Rest:
    """An equilibrium: the engine's pose x, what stays unbalanced along the motions that are allowed [N m or N], steps."""

    x: Array
    residual: float
    steps: int


def settle(dynamics: Dynamics, q: Array) -> Rest:
    """The equilibrium that one reaches downhill from coordinates q (nq,); one that q already is stays, stable or not.

    Newton where the potential is convex; elsewhere the curvatures are taken positive, so that the step goes downhill and
    away from a saddle. Directions without any force stay where they are. Raises NoSolution when the pose does not close, or
    when no rest is found: something keeps pushing.
    """
    found = dynamics.closed(dynamics.pose(q))
    if not found.closed:
        raise NoSolution(
            f"{dynamics.mechanism.name}: the start does not close (open by {found.residual:.3g}): {found.status.value}."
        )
    x, load, last = found.q, 0.0, np.inf
    for k in range(ITERATIONS):
        now = linear(dynamics, x, with_damping=False)
        load = max(load, now.load, 0.1 * now.stiffest)
        residual = _unbalanced(dynamics, now)
        if residual <= 1e-15 * load or (residual < BALANCED * load and residual >= 0.5 * last):
            return Rest(x, residual, k)
        last = residual
        x = _step(dynamics, x, now, _direction(now, load))
    raise NoSolution(
        f"{dynamics.mechanism.name}: no equilibrium at rest from this start: after {ITERATIONS} steps {residual:.3g} N m or N stay "
        f"unbalanced at {_culprit(dynamics, now)}. Something keeps pushing (a constant load on a free part), or the position is "
        "singular; give another start (X_0=...) or hold the part."
    )


def _unbalanced(dynamics: Dynamics, now: Linear) -> float:
    """Largest generalised force along the allowed motions, each scaled to a largest coordinate of 1."""
    if not len(now.gradient):
        return 0.0
    return float(np.max(np.abs(now.gradient) / np.max(np.abs(now.basis), axis=0)))


def _direction(now: Linear, load: float) -> Array:
    """Displacement in the coordinates of `now`, downhill."""
    g, values, vectors = now.gradient, *np.linalg.eigh(0.5 * (now.stiffness + now.stiffness.T))
    sizes = np.max(np.abs(now.basis @ vectors), axis=0)
    floor = 1e-9 * max(load, now.stiffest) * sizes**2
    along = vectors.T @ g
    idle = (np.abs(values) <= floor) & (np.abs(along) <= 1e-12 * load * sizes)
    if np.all((values > floor) | idle):
        keep = vectors[:, ~idle]
        return -keep @ np.linalg.solve(keep.T @ now.stiffness @ keep, keep.T @ g) if keep.shape[1] else 0.0 * g
    curved = np.where(idle, 0.0, along / np.maximum(np.abs(values), np.maximum(floor, 1e-300)))
    return np.asarray(-vectors @ curved)


def _step(dynamics: Dynamics, x: Array, now: Linear, y: Array) -> Array:
    """The next pose: the step is halved while it does not close, or while it passes the bottom by far."""
    dv = now.basis @ y
    biggest = float(np.max(np.abs(dv), initial=0.0))
    scale = min(1.0, LARGEST / biggest) if biggest > 0.0 else 1.0
    slope = float(now.gradient @ y)
    trial = x
    for _ in range(12):
        found = dynamics.closed(dynamics.moved(x, scale * dv))
        if found.closed:
            trial = found.q
            if _slope(dynamics, trial, dv) <= max(0.5 * abs(slope), 1e-13 * now.load * biggest):
                return trial
        scale *= 0.5
    return trial


def _slope(dynamics: Dynamics, x: Array, dv: Array) -> float:
    """Slope of the potential at x along dv, as far as the constraints allow dv there."""
    rows = dynamics.rows(x)
    along = dv - np.linalg.lstsq(rows, rows @ dv, rcond=1e-11)[0] if len(rows) else dv
    return float(dynamics.force(x) @ along)


def _culprit(dynamics: Dynamics, now: Linear) -> str:
    push = dynamics.rates((now.basis @ now.gradient)[:, None])[:, 0]
    return dynamics.mechanism.rate_names[int(np.argmax(np.abs(push)))]
