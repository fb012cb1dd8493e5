"""Parameters of the four-bar: flat, frozen, each with unit, meaning, limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mechlab.experiment.parameters import parameter


@dataclass(frozen=True)
class Parameters:
    """Lengths, mass, gravity and assembly mode of a four-bar."""

    crank: float = parameter(0.1, "m", "crank A-B", low=0, strict=True)
    coupler: float = parameter(0.3, "m", "coupler B-C", low=0, strict=True)
    rocker: float = parameter(0.25, "m", "rocker D-C", low=0, strict=True)
    ground: float = parameter(0.3, "m", "ground A-D", low=0, strict=True)
    mode: int = parameter(1, "", "+1: C left of the vector from B to D, -1: right", low=-1, high=1)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(2 * math.pi, "rad/s", "crank speed of the scenes")
    torque: float = parameter(0.2, "N m", "crank torque of the scene constant-torque")

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Crank, coupler, rocker, ground."""
        return self.crank, self.coupler, self.rocker, self.ground
