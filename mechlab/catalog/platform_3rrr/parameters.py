"""Parameters of the planar platform 3-RRR: a regular one, and what makes base, platform and chains unequal."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechlab.experiment.parameters import parameter
from mechlab.mechanism.geometry import Array

AZIMUTHS = (math.radians(-150.0), math.radians(-30.0), math.radians(90.0))
EQUAL = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class PlatformParameters:
    """Base pivots and platform corners at azimuths about the centres of base and platform, three chains crank, leg. Radii and
    lengths are common ones, times a ratio for each chain: all ratios 1 and the usual azimuths make the regular platform."""

    base: float = parameter(0.5, "m", "radius of the base pivots", low=0, strict=True)
    platform: float = parameter(0.15, "m", "radius of the platform corners", low=0, strict=True)
    crank: float = parameter(0.3, "m", "driven cranks", low=0, strict=True)
    leg: float = parameter(0.3, "m", "legs", low=0, strict=True)
    base_ratios: tuple[float, ...] = parameter(
        EQUAL, "", "radius of each base pivot as a multiple of base", low=0, strict=True
    )
    base_azimuths: tuple[float, ...] = parameter(
        AZIMUTHS, "rad", "directions of the base pivots from the base's centre"
    )
    platform_ratios: tuple[float, ...] = parameter(
        EQUAL, "", "radius of each platform corner as a multiple of platform", low=0, strict=True
    )
    platform_azimuths: tuple[float, ...] = parameter(
        AZIMUTHS, "rad", "directions of the corners from the platform's centre at alpha = 0"
    )
    crank_ratios: tuple[float, ...] = parameter(EQUAL, "", "each crank as a multiple of crank", low=0, strict=True)
    leg_ratios: tuple[float, ...] = parameter(EQUAL, "", "each leg as a multiple of leg", low=0, strict=True)
    home_x: float = parameter(0.0, "m", "x of the platform's centre in its home pose")
    home_y: float = parameter(0.0, "m", "y of the platform's centre in its home pose")
    home_alpha: float = parameter(0.0, "rad", "angle of the platform in its home pose")
    elbow: int = parameter(
        1, "", "+1: elbows left of the way from base pivot to platform corner, -1: right", low=-1, high=1
    )
    mode: int = parameter(1, "", "assembly mode: 1 is the nearest to the home pose, 2 the next, up to 6", low=1, high=6)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    amplitude: float = parameter(0.25, "rad", "swing of the drives in the driven scene")
    frequency: float = parameter(3.0, "rad/s", "angular frequency of the swing", low=0, strict=True)

    @property
    def pivots(self) -> Array:
        """(3,) complex base pivots."""
        return self.base * np.array(self.base_ratios) * np.exp(1j * np.array(self.base_azimuths))

    @property
    def corners(self) -> Array:
        """(3,) complex corners from the centre of the platform, in its axes."""
        return self.platform * np.array(self.platform_ratios) * np.exp(1j * np.array(self.platform_azimuths))

    @property
    def plate(self) -> tuple[complex, complex]:
        """The 2nd and 3rd corner seen from the 1st."""
        c = self.corners
        return complex(c[1] - c[0]), complex(c[2] - c[0])

    @property
    def cranks(self) -> tuple[float, float, float]:
        """Lengths of the cranks [m]."""
        a, b, c = (self.crank * r for r in self.crank_ratios)
        return a, b, c

    @property
    def legs(self) -> tuple[float, float, float]:
        """Lengths of the legs [m]."""
        a, b, c = (self.leg * r for r in self.leg_ratios)
        return a, b, c
