"""A05: a flyball governor with stiff spring-dampers between slider and arms; both arms move alike."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Governor:
    """Coordinates: arm angle alpha below the horizontal, slider height s, shaft angle phi. The angular momentum
    I(alpha) phi' = H is constant, which leaves

        2 (I_a) alpha'' = I'(alpha) phi'^2 / 2 + gravity + spring,    m_s s'' = -m_s g + spring

    SI units. pivot: distance of the arm pivots (and of the spring ends on the slider) from the axis; height: of the pivots;
    arm moments about its centre: `along`, `across` its axis; upright: moments of shaft and slider about the axis, summed.
    """

    pivot: float
    height: float
    arm_length: float
    arm_mass: float
    arm_along: float
    arm_across: float
    ball_mass: float
    slider_mass: float
    upright: float
    spring_stiffness: float
    damping: float
    spring_length: float
    gravity: float

    def moment(self, alpha: float) -> tuple[float, float]:
        """Moment of inertia about the axis and its derivative by alpha."""
        c, s, a, half = math.cos(alpha), math.sin(alpha), self.pivot, 0.5 * self.arm_length
        one = self.arm_along * s * s + self.arm_across * c * c
        one += self.arm_mass * (a + half * c) ** 2 + self.ball_mass * (a + 2.0 * half * c) ** 2
        slope = 2.0 * (self.arm_along - self.arm_across) * s * c
        slope -= 2.0 * self.arm_mass * (a + half * c) * half * s
        slope -= 4.0 * self.ball_mass * (a + 2.0 * half * c) * half * s
        return self.upright + 2.0 * one, 2.0 * slope

    def slope(self, t: float, y: Array) -> Array:
        """Rate (6,) of y = (alpha, s, phi, alpha', s', H)."""
        alpha, s, _, dalpha, ds, momentum = y.tolist()
        sine, cosine, half = math.sin(alpha), math.cos(alpha), 0.5 * self.arm_length
        moment, bend = self.moment(alpha)
        spin = momentum / moment
        x, z = half * cosine, self.height - half * sine - s
        length = math.hypot(x, z)
        by_alpha = (-half * sine * x - half * cosine * z) / length
        by_s = -z / length
        tension = self.spring_stiffness * (length - self.spring_length)
        tension += self.damping * (by_alpha * dalpha + by_s * ds)
        own = self.arm_across + self.arm_mass * half**2 + self.ball_mass * self.arm_length**2
        weight = self.gravity * cosine * (self.arm_mass * half + self.ball_mass * self.arm_length)
        accel = (0.25 * bend * spin * spin + weight - tension * by_alpha) / own
        return np.array([dalpha, ds, spin, accel, -self.gravity - 2.0 * tension * by_s / self.slider_mass, 0.0])
