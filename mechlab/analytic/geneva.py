"""The external Geneva wheel: its angle for that of the crank, in closed form.

The crank turns by a, measured from the line of centres towards the wheel; the pin at radius r = c sin(pi / n) enters and leaves the slot
at right angles, at |a| = pi/2 - pi/n, and the wheel rests else. With l = r / c = sin(pi / n):

    b   = atan2(l sin a, 1 - l cos a)               the wheel turns by -b
    b'  = l (cos a - l) / (1 - 2 l cos a + l^2)
    b'' = -l (1 - l^2) sin a / (1 - 2 l cos a + l^2)^2

(Bickford, Mechanisms for Intermittent Motion, 1972, chapter 9.) At the ends b' = 0 and |b''| = tan(pi / n): the acceleration jumps there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def engaged_from(slots: int) -> float:
    """Angle of the crank before the line of centres [rad] at which the pin enters its slot: pi/2 - pi/slots."""
    return 0.5 * math.pi - math.pi / slots


def slot_law(slots: int, crank: ArrayLike) -> tuple[Array, Array, Array]:
    """b, b' and b'' while the pin is in the slot, at crank angles (n,) [rad]."""
    a, ratio = np.asarray(crank, dtype=float), math.sin(math.pi / slots)
    d = 1.0 - 2.0 * ratio * np.cos(a) + ratio**2
    b = np.arctan2(ratio * np.sin(a), 1.0 - ratio * np.cos(a))
    return b, ratio * (np.cos(a) - ratio) / d, -ratio * (1.0 - ratio**2) * np.sin(a) / d**2


def wheel_law(slots: int, crank: ArrayLike) -> tuple[Array, Array, Array]:
    """Angle of the wheel, 0 on the line of centres, and its two derivatives by the crank angle (n,) [rad], turns and rests."""
    a = np.asarray(crank, dtype=float)
    turns = np.floor((a + math.pi) / (2.0 * math.pi))
    a = a - 2.0 * math.pi * turns
    end = engaged_from(slots)
    b, v, w = slot_law(slots, np.clip(a, -end, end))
    moves = np.abs(a) < end
    return -b - 2.0 * math.pi / slots * turns, np.where(moves, -v, 0.0), np.where(moves, -w, 0.0)


def fastest(slots: int) -> tuple[float, float]:
    """Crank angle [rad] of the largest acceleration, and its size |b''|: cos a = sqrt(g^2 + 2) - g with g = (1 + l^2) / (4 l)."""
    ratio = math.sin(math.pi / slots)
    g = (1.0 + ratio**2) / (4.0 * ratio)
    a = math.acos(math.sqrt(g * g + 2.0) - g)
    return a, float(abs(slot_law(slots, a)[2]))
