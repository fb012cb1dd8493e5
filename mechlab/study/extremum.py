"""Extrema of a sampled curve, found between its samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from mechlab.mechanism.geometry import Array

FINE = 1e-7
"""Width at which the search for a place ends, as a share of the distance of two samples: at a smooth extremum the value is
then right to rounding, at a kink to this share of the change from sample to sample."""


@dataclass(frozen=True)
class Extremum:
    """A value, and the position where it is met."""

    value: float
    at: float


def extremum(
    positions: Array, values: Array, sign: int, function: Callable[[float], float] | None = None, closed: bool = False
) -> Extremum | None:
    """The largest (sign 1) or least (-1) value; None where no sample is finite.

    positions, values (n,): samples, NaN where there is no value. function(position): the curve; where it is given, every
    sample that is better than its neighbours is followed between them (Brent), unless even twice its lead over a neighbour
    would not make it the best. closed: the last sample is the first one again, so that both are neighbours.
    """
    x, y = np.asarray(positions, dtype=float), sign * np.asarray(values, dtype=float)
    if not np.isfinite(y).any():
        return None
    y = np.where(np.isfinite(y), y, -np.inf)
    best = int(np.argmax(y))
    found = Extremum(float(sign * y[best]), float(x[best]))
    if function is None or len(x) < 3 or np.ptp(y[np.isfinite(y)]) <= 1e-13 * max(1.0, abs(y[best])):
        return found
    period = x[-1] - x[0]
    if closed:
        x, y = np.concatenate([[x[-2] - period], x, [x[1] + period]]), np.concatenate([[y[-2]], y, [y[1]]])
    inner = np.arange(1, len(x) - 1)
    top = inner[(y[inner] >= y[inner - 1]) & (y[inner] >= y[inner + 1]) & np.isfinite(y[inner])]
    top = top[~np.isneginf(y[top - 1]) | ~np.isneginf(y[top + 1])]
    if not closed:  # beside an end the extremum may lie between the end and its neighbour
        top = np.union1d(top, [k for k in (1, len(x) - 2) if y[0 if k == 1 else -1] >= y[k] > -np.inf]).astype(int)
    for k in top[np.argsort(-y[top])]:
        beside = [d for d in (abs(y[k] - y[k - 1]), abs(y[k] - y[k + 1])) if np.isfinite(d)]
        if y[k] + 2.0 * max(beside, default=0.0) < sign * found.value:
            continue
        here = _climb(lambda p: sign * function(p), float(x[k - 1]), float(x[k + 1]))
        if here.value > sign * found.value:
            at = here.at + (period if closed and here.at < positions[0] else 0.0)
            found = Extremum(sign * here.value, at - (period if closed and at > positions[-1] else 0.0))
    return found


def _climb(function: Callable[[float], float], low: float, high: float) -> Extremum:
    """The largest finite value between two positions."""

    def cost(p: float) -> float:
        value = float(function(p))
        return -value if np.isfinite(value) else np.inf

    done = minimize_scalar(
        cost, bounds=(low, high), method="bounded", options={"xatol": FINE * (high - low), "maxiter": 60}
    )
    return Extremum(-float(done.fun), float(done.x))
