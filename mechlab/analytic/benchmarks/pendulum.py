"""A01: a point mass on a massless rod, in a vertical plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pendulum:
    """phi'' = -(g / L) cos phi, phi from the horizontal +x; the mass stands at L (cos phi, sin phi). SI units."""

    length: float
    gravity: float

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (phi, phi')."""
        return np.array([y[1], -self.gravity / self.length * math.cos(y[0])])

    def from_rest(self, start: float, t: Array) -> Array:
        """(n,) phi at times t [s] after a release at rest at `start` [rad], by elliptic functions (exact to rounding).

        With psi = phi + pi/2 from the lowest position: sin(psi/2) = k sn(K(k) + w t), k = sin(psi0/2), w^2 = g/L.
        """
        from scipy.special import ellipj, ellipk

        psi = math.remainder(start + 0.5 * math.pi, 2.0 * math.pi)
        turns = start + 0.5 * math.pi - psi
        k = math.sin(0.5 * psi)
        sn = ellipj(ellipk(k * k) + math.sqrt(self.gravity / self.length) * np.asarray(t), k * k)[0]
        return np.asarray(2.0 * np.arcsin(k * sn) - 0.5 * math.pi + turns)
