"""Roots of functions of one variable by bracketing; scipy is loaded when the first one is asked for, not with the formulas."""

from __future__ import annotations

import sys
from collections.abc import Callable


def brentq(
    f: Callable[..., float],
    a: float,
    b: float,
    args: tuple[object, ...] = (),
    xtol: float = 2e-12,
    rtol: float = 4.0 * sys.float_info.epsilon,
) -> float:
    """The root of f(x, *args) between a and b, where f has opposite signs, by Brent's method: `scipy.optimize.brentq`, whose
    defaults these are. Raises ValueError where the signs are equal."""
    from scipy.optimize import brentq as brent

    return float(brent(f, a, b, args=args, xtol=xtol, rtol=rtol))
