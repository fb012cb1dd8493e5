"""Sticking or sliding: the modes in which a state goes on (Coulomb's law, set-valued at standstill)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.integrate.hybrid.problem import Array, Modes, RoughProblem

FLOOR = 1e-12
"""Rates below this share of the terms that they are summed from, or of 1, are standstill."""
GRAZING = 1e-9
"""A holding force is beyond its limit when it exceeds it by this share: rounding must not break an element loose."""


def floor(problem: RoughProblem, y: Array) -> Array:
    """(k,) rates that rounding cannot tell from zero."""
    return np.asarray(FLOOR * (1.0 + np.abs(problem.rates) @ np.abs(y)))


def modes_at(problem: RoughProblem, t: float, y: Array, modes: Modes | None = None, still: ArrayLike = ()) -> Modes:
    """The modes in which a state goes on: signs of the rates; elements at standstill, and those in `still`, stick if
    their limits allow it, else they slide against the holding force. Modes of moving elements are kept when given."""
    rate = problem.rates @ y
    resting = {int(k) for k in np.flatnonzero(np.abs(rate) <= floor(problem, y))} | {
        int(k) for k in np.asarray(still, dtype=int)
    }
    out = [0 if k in resting else (modes[k] if modes and modes[k] else int(np.sign(x))) for k, x in enumerate(rate)]
    for _ in range(len(out) + 1):
        stuck = [k for k in range(len(out)) if out[k] == 0]
        if not stuck:
            break
        force = problem.holding(t, y, tuple(out))
        over = {k: abs(force[k]) / problem.limits[k] for k in stuck}
        worst = max(stuck, key=lambda k: over[k])
        if over[worst] <= 1.0 + GRAZING:
            break
        out[worst] = against(force[worst])
    return tuple(out)


def against(holding: float) -> int:
    """The mode of an element that breaks loose from a holding force."""
    return -1 if holding > 0 else 1
