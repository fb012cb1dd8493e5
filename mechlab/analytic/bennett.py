"""Angles of overconstrained loops that consist of Bennett linkages.

A Bennett linkage has opposite bars alike, (length a, twist alpha) and (b, beta) with a / sin(alpha) = b / sin(beta); by Denavit-Hartenberg
its hinges turn by x, y, -x, -y. Two of them with a bar in common make Goldberg's five-bar when that bar is left out (Goldberg 1943).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.float64]
Bar = tuple[float, float]
"""Length [m] and twist [rad]."""


def ratio(alpha: float, beta: float) -> float:
    """tan(x / 2) tan(y / 2) of neighbouring hinges = sin((beta + alpha) / 2) / sin((beta - alpha) / 2) (Bennett 1903)."""
    return math.sin(0.5 * (beta + alpha)) / math.sin(0.5 * (beta - alpha))


def five_bar(shared: Bar, first: Bar, second: Bar, theta: ArrayLike, sign: int = 1) -> tuple[Real, Real, Real, Real, Real]:
    """Angles (n,) [rad] of the hinges of a loop of the bars shared, first, second, shared, and first + second (sign = 1) or first - second.

    First linkage theta, phi, -theta, -phi; second theta', phi', -theta', -phi'. The hinge between them has a half turn more, as the shared
    bar is passed there and back; at the hinge left out the bars are made one, phi + phi' = pi (sum) or 0 (difference).
    """
    one, two = ratio(shared[1], first[1]), ratio(second[1], shared[1])
    x = np.asarray(theta, dtype=float)
    phi = 2.0 * np.arctan2(one, np.tan(0.5 * x))
    if sign > 0:
        other, x2 = np.pi - phi, 2.0 * np.arctan2(one * two, np.tan(0.5 * x))
        return x, phi, np.pi - x + x2, other, -x2
    x2 = -2.0 * np.arctan(two / one * np.tan(0.5 * x))
    return x, phi, np.pi - x + x2, -phi, np.pi - x2
