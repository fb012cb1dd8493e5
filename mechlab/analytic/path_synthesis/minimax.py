"""Least largest deviation under constraints: a sequence of linear programmes within a trust region."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linprog

from mechlab.analytic.path_synthesis.curves import Array

STEP = 1e-7
"""Step of the differences."""
DEAR = 20.0
"""Price of what a constraint lacks, in deviations."""
NARROWEST = 1e-7
"""Trust region at which the search ends."""

Model = Callable[[Array], tuple[Array, Array]]
"""Rows (k, m) -> deviations (k, n) and constraints (k, c), kept where they are at least 0; NaN where there is no linkage."""


def least_largest(model: Model, start: Array, rounds: int = 40) -> tuple[Array, float]:
    """The row (m,) for which the largest deviation is least, and that deviation with what the constraints lack, from a start (m,)."""
    x, radius = start.copy(), 0.1
    deviation, kept = (v[0] for v in model(x[None]))
    value = _value(deviation, kept)
    for _ in range(rounds):
        if not np.isfinite(value) or radius < NARROWEST:
            break
        scale = np.maximum(np.abs(x), 0.3)
        moved, bounds = model(x + np.diag(STEP * scale))
        by_x, limits = (moved - deviation).T / STEP, (bounds - kept).T / STEP
        if not (np.all(np.isfinite(by_x)) and np.all(np.isfinite(limits))):
            break
        step = _step(deviation, by_x, kept, limits, radius)
        if step is None:
            break
        tried = x + scale * step
        there = tuple(v[0] for v in model(tried[None]))
        after = _value(*there)
        if after < value:
            gain = value - after
            x, (deviation, kept), value = tried, there, after
            radius = min(2.0 * radius, 0.4)
            if gain < 1e-7 * value:
                break
        else:
            radius *= 0.25
    return x, value


def _value(deviation: Array, kept: Array) -> float:
    value = float(np.max(np.abs(deviation))) + DEAR * float(np.sum(np.maximum(0.0, -kept)))
    return value if np.isfinite(value) else np.inf


def _step(deviation: Array, by_x: Array, kept: Array, limits: Array, radius: float) -> Array | None:
    """Scaled step (m,) of the linear model: unknown are the step, the largest deviation, and what the constraints lack in all."""
    m, one, none = by_x.shape[1], np.ones((len(deviation), 1)), np.zeros((len(deviation), 1))
    table = np.block([[by_x, -one, none], [-by_x, -one, none], [-limits, np.zeros((len(kept), 1)), -np.ones((len(kept), 1))]])
    right = np.concatenate([-deviation, deviation, kept])
    price = np.concatenate([np.zeros(m), [1.0, DEAR]])
    found = linprog(price, table, right, bounds=[(-radius, radius)] * m + [(0.0, None)] * 2, method="highs")
    return np.asarray(found.x[:m]) if found.status == 0 else None
