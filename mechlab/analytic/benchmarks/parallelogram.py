"""A02: a chain of N parallelograms, N + 1 equal rockers and N couplers, in a vertical plane. One freedom."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ParallelogramChain:
    """The couplers translate, so that every one of them moves like a point mass at a rocker's tip. With theta clockwise
    from upright (uniform slender rockers):

        theta'' = (g / L) sin(theta) [(N + 1) m_r / 2 + N m_c] / [(N + 1) m_r / 3 + N m_c]

    The tip of the first rocker stands at L (sin theta, cos theta). SI units.
    """

    count: int
    rocker_length: float
    rocker_mass: float
    coupler_mass: float
    gravity: float

    @property
    def stiffness(self) -> float:
        """theta'' / sin(theta) [1/s2]."""
        rockers, couplers = (self.count + 1) * self.rocker_mass, self.count * self.coupler_mass
        return self.gravity / self.rocker_length * (rockers / 2.0 + couplers) / (rockers / 3.0 + couplers)

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (theta, theta')."""
        return np.array([y[1], self.stiffness * math.sin(y[0])])
