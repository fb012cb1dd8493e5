"""The physical pendulum in closed form: theta'' = -w^2 sin theta, theta from its lowest position, by Jacobi's elliptic
functions.

With k^2 = sin^2(theta0 / 2) + (theta0' / 2w)^2, the energy over that of the upright position at rest:

k < 1, it swings:    sin(theta / 2) = k sn(w t + u0 | k^2),      theta' = 2 w k cn
k > 1, it goes over: theta / 2 = am(+-k w t + u0 | 1 / k^2),     theta' = +-2 w k dn

Whittaker, Analytical Dynamics, section 44; functions as in NIST DLMF 22.19(i).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import NoSolution
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
SEPARATRIX = 1e-6
"""Smallest |k^2 - 1| that is solved: nearer to 1, rounding hides the difference from the motion that ends upright."""


@dataclass(frozen=True)
class PhysicalPendulum:
    """frequency w > 0 [rad/s] of small swings; angle theta0 [rad] and rate [rad/s] at t = 0."""

    frequency: float
    angle: float
    rate: float

    @property
    def modulus_squared(self) -> float:
        """k^2."""
        return math.sin(0.5 * self.angle) ** 2 + (0.5 * self.rate / self.frequency) ** 2

    @property
    def goes_over(self) -> bool:
        """True when the pendulum passes the top again and again (k > 1)."""
        return self.modulus_squared > 1.0

    def motion(self, t: ArrayLike) -> tuple[Array, Array]:
        """theta (n,) [rad], continuous, and theta' (n,) [rad/s] at times t (n,) [s]; exact to rounding.

        Raises NoSolution where it would come to rest upright (|k^2 - 1| <= SEPARATRIX).
        """
        from scipy.special import ellipj, ellipkinc

        w, m = self.frequency, self._apart()
        k = math.sqrt(m)
        here = math.remainder(self.angle, 2.0 * math.pi)
        turns = self.angle - here
        t = np.asarray(t, dtype=float)
        if m < 1.0:
            # the amplitude from both sine and cosine: well defined at the turning points, too
            first = ellipkinc(math.atan2(math.sin(0.5 * here), 0.5 * self.rate / w), m)
            sn, cn, dn, _ = ellipj(first + w * t, m)
            return turns + 2.0 * np.arctan2(k * sn, dn), 2.0 * w * k * cn
        way = math.copysign(k * w, self.rate)
        _, _, dn, am = ellipj(ellipkinc(0.5 * here, 1.0 / m) + way * t, 1.0 / m)
        return turns + 2.0 * am, 2.0 * way * dn

    def sensitivity(self) -> tuple[float, float]:
        """By how much theta changes with k^2: (a, b) of the bound |d theta| <= (a |theta'| t + b) |d k^2|.

        a = |d ln T / d k^2| of the period T, from dK/dm = (E - (1 - m) K) / (2 m (1 - m)); b bounds the change of the shape.
        Raises NoSolution where `motion` does, and at rest in the lowest position.
        """
        from scipy.special import ellipe, ellipk

        m = self._apart()
        if not m > 0.0:
            raise NoSolution("a pendulum that hangs at rest")
        low = min(m, 1.0 / m)
        k_of, e_of = float(ellipk(low)), float(ellipe(low))
        grown = (e_of - (1.0 - low) * k_of) / (2.0 * low * (1.0 - low) * k_of) if low > 1e-6 else 0.25
        slower = grown if m < 1.0 else 0.5 / m + grown / (m * m)
        return slower, 1.0 / (math.sqrt(m) * abs(1.0 - m))

    def _apart(self) -> float:
        """k^2. Raises NoSolution where it is within SEPARATRIX of 1."""
        m = self.modulus_squared
        if not abs(m - 1.0) > SEPARATRIX:
            raise NoSolution("a pendulum with the energy of its upright position: it takes for ever to get there")
        return m
