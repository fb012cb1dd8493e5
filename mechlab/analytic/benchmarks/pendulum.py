"""A01: a point mass on a massless rod, in a vertical plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.physical_pendulum import PhysicalPendulum

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pendulum:
    """phi'' = -(g / L) cos phi, phi from the horizontal +x; the mass stands at L (cos phi, sin phi). SI units."""

    length: float
    gravity: float

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (phi, phi')."""
        return np.array([y[1], -self.gravity / self.length * math.cos(y[0])])

    def in_closed_form(self, start: float, rate: float, t: Array) -> Array:
        """(n,) phi at times t [s] from `start` [rad] at `rate` [rad/s], by elliptic functions (exact to rounding).

        Raises NoSolution as `PhysicalPendulum.motion`, of which this is the angle and that of the lowest position.
        """
        if self.gravity == 0.0:
            return start + rate * np.asarray(t)
        lowest = -math.copysign(0.5 * math.pi, self.gravity)
        motion = PhysicalPendulum(math.sqrt(abs(self.gravity) / self.length), start - lowest, rate)
        return motion.motion(t)[0] + lowest
