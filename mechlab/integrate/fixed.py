"""One loop for every explicit Runge-Kutta tableau, at a fixed step, for one state or many at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.integrate.tableau import Tableau
from mechlab.integrate.work import FIXED_STAGE, count_work

Array = NDArray[np.float64]
RightSide = Callable[[float, Array], Array]


@dataclass(frozen=True)
class Stopped:
    """Where an integration ended: time, state, steps done, and in `reason` why it stopped early (empty: it did not)."""

    t: float
    y: Array
    steps: int
    reason: str = ""

    @property
    def complete(self) -> bool:
        """True when all steps were done."""
        return not self.reason


def step(tableau: Tableau, f: RightSide, t: float, y: Array, h: float) -> Array:
    """The state after one step of size h from (t, y); y has any shape (..., n), f keeps it."""
    rows, weights, times = tableau.floats
    slopes: list[Array] = []
    for row, c in zip(rows, times, strict=True):
        stage = y
        for a, k in zip(row, slopes, strict=True):
            if a:
                stage = stage + (h * a) * k
        slopes.append(f(t + c * h, stage))
    out = y
    for b, k in zip(weights, slopes, strict=True):
        out = out + (h * b) * k
    return out


def integrate_fixed(
    tableau: Tableau,
    f: RightSide,
    t0: float,
    y0: ArrayLike,
    h: float,
    steps: int,
    observe: Callable[[int, float, Array], None] | None = None,
    project: Callable[[float, Array], Array] | None = None,
) -> Stopped:
    """`steps` steps of size h from y0 (..., n) at t0; f(t, y) -> dy/dt of the same shape, vectorised over leading axes.

    After each step `project(t, y) -> y` brings the state back onto constraints, then `observe(k, t, y)` sees it; k =
    0 is the start. Times are t0 + k h, not sums. Stops at the first state that is not finite and says when; that
    state is not returned. Raises MechlabError for a step that is not a positive finite number.
    """
    if not np.isfinite(h) or h <= 0:
        raise MechlabError(f"step size: expected a number > 0, got {h!r}.")
    y = np.array(y0, dtype=float)
    price = FIXED_STAGE * len(tableau.floats[1])
    if observe is not None:
        observe(0, t0, y)
    for k in range(steps):
        t = t0 + k * h
        count_work(price)
        with np.errstate(over="ignore", invalid="ignore"):
            new = step(tableau, f, t, y, h)
        after = t0 + (k + 1) * h
        if np.all(np.isfinite(new)) and project is not None:
            new = project(after, new)
        if not np.all(np.isfinite(new)):
            return Stopped(t, y, k, f"the state is not finite after t = {t:.6g} (step {k + 1}, size {h:g})")
        y = new
        if observe is not None:
            observe(k + 1, after, y)
    return Stopped(t0 + steps * h, y, steps)
