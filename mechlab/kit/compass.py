"""Ruler and compasses: points of the plane as complex numbers, for numbers from outside that are constructed by hand."""

from __future__ import annotations

import cmath
import math


def meet(a: complex, r: float, b: complex, s: float, side: int) -> complex:
    """Where circles of radii r about a and s about b meet, left (+1) or right (-1) of the way from a to b."""
    way = b - a
    along = (abs(way) ** 2 + r * r - s * s) / (2.0 * abs(way))
    return a + way / abs(way) * complex(along, side * math.sqrt(r * r - along * along))


def corner(a: float, b: float, opposite: float) -> float:
    """Angle [rad] between the sides a and b of a triangle (law of cosines)."""
    return math.acos((a * a + b * b - opposite * opposite) / (2.0 * a * b))


def at(radius: float, angle: float) -> complex:
    """A point at a radius and an angle [rad]."""
    return cmath.rect(radius, angle)
