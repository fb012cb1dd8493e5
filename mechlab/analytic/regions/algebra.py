"""Boolean algebra on functions whose sign says inside (f >= 0) or outside (f < 0).

`EXACT` is the lattice min, max: every law holds in value, and the meet of signed distances is the exact distance inside.
An R-function has the sign of min and max but is smooth except where both arguments vanish; its value is no margin any
more (ten margins of 1 meet in 0.16), so margins are for `EXACT` and gradients for `SMOOTH`.

The complement is -f in both. The sets {f >= 0} are closed, so -f >= 0 is the complement only off the border f = 0, where
a set and its "complement" both say inside (V. L. Rvachev, Theory of R-functions, 1982).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError

FloatArray = NDArray[np.float64]
Operation = Callable[[ArrayLike, ArrayLike], FloatArray]


@dataclass(frozen=True)
class Algebra:
    """How two functions are joined: `meet` for and, `join` for or; arrays that broadcast in, an array out."""

    name: str
    meet: Operation
    join: Operation


def indicator(values: ArrayLike) -> NDArray[np.int64]:
    """1 where f >= 0, else 0: chi = (1 + sgn f) / 2 with sgn 0 = +1. Any shape, same shape."""
    return (np.asarray(values, dtype=np.float64) >= 0.0).astype(np.int64)


def _lower(x: ArrayLike, y: ArrayLike) -> FloatArray:
    return np.minimum(x, y, dtype=np.float64)


def _upper(x: ArrayLike, y: ArrayLike) -> FloatArray:
    return np.maximum(x, y, dtype=np.float64)


def r_functions(alpha: float = 0.0) -> Algebra:
    """The R-functions R_alpha: meet (x + y - s) / (1 + alpha), join (x + y + s) / (1 + alpha), with
    s = sqrt(x^2 + y^2 - 2 alpha x y); alpha = 0 is R0, alpha -> 1 tends to min and max.

    The difference x + y - s cancels when one argument is tiny, and loses its sign; where x + y > 0 the meet is computed as
    2 min(x, y) (max(x, y) / (x + y + s)), which keeps the sign down to the smallest double. The join is -meet(-x, -y).
    Raises MechlabError for alpha outside [0, 1).
    """
    if not 0.0 <= alpha < 1.0:
        raise MechlabError(f"r_functions: alpha = {alpha!r}; expected 0 <= alpha < 1 (for alpha = 1 use EXACT).")
    square = float(np.sqrt(1.0 - alpha * alpha))

    def meet(x: ArrayLike, y: ArrayLike) -> FloatArray:
        low, high = _lower(x, y), _upper(x, y)
        total = low + high
        s = np.hypot(low - alpha * high, square * high)  # x^2 + y^2 - 2 alpha x y as a sum of squares
        positive = total > 0.0
        share = np.divide(high, total + s, out=np.zeros(np.shape(total)), where=positive)
        return np.asarray(np.where(positive, 2.0 * low * share, (total - s) / (1.0 + alpha)))

    def join(x: ArrayLike, y: ArrayLike) -> FloatArray:
        return -meet(np.negative(x), np.negative(y))

    return Algebra(f"R_{alpha:g}", meet, join)


EXACT = Algebra("min and max", _lower, _upper)
"""The lattice: exact margins."""
SMOOTH = r_functions(0.0)
"""R0: smooth away from corners."""
