"""Sizes and places that several groups of parts share. Shapes carry no mass; tooth counts are for the eye, the nearest whole numbers."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mechlab.catalog.delta6.masses import PLANET_OFFSET
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.mechanism import Placement, Shape
from mechlab.mechanism.geometry import Array

SPUR_LEVEL = (-0.014, -0.024, -0.034)
"""Heights of the three lower gears below the lower crosses [m]."""
PLANET_LEVEL = (0.017, 0.024)
"""Heights of the planets above the head centre [m]."""
Shapes = tuple[Shape, ...]


def at(position: Array | tuple[float, float, float], rotation: Array | None = None) -> Placement:
    """A placement; not turned by default."""
    return Placement.of(np.eye(3) if rotation is None else rotation, position)


def columns(x: Array, y: Array) -> Array:
    """Rotation whose first two columns are the orthonormal x and y."""
    return np.column_stack([x, y, np.cross(x, y)])


@lru_cache(maxsize=256)
def teeth(ratio: float, low: int = 60, high: int = 140) -> tuple[int, int]:
    """Whole numbers (a, b), a + b within limits, with b / a nearest to `ratio`."""
    pairs = [
        (a, round(a * ratio)) for a in range(12, high) if low <= a + round(a * ratio) <= high and round(a * ratio) >= 12
    ]
    if not pairs:
        return (40, 40)
    return min(pairs, key=lambda ab: (round(abs(ab[1] / ab[0] - ratio), 6), ab[0]))


def spur_sizes(p: Delta6Parameters, i: int) -> tuple[int, int, float]:
    """Teeth of lower gear and central gear, and module, for the centre distance `platform_radius`."""
    a, b = teeth(float(p.k_spur)) if i < 3 else (24, 24)
    return a, b, 2.0 * p.platform_radius / (a + b) if i < 3 else 2.0 * p.platform_radius / (a + b + 48)


def planet_sizes(p: Delta6Parameters) -> tuple[int, int, float]:
    """Teeth of the inner rim and of the planet, and their module."""
    c, d = teeth(float(p.k_transfer / p.k_spur))
    return c, d, 2.0 * PLANET_OFFSET / (c + d)
