"""Parameters of the governor."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mechlab.experiment.parameters import parameter

SOURCE = "IFToMM benchmark library, A05"


@dataclass(frozen=True)
class Parameters:
    """Bars of square section on a shaft along z, a slider on the shaft, two arms with balls."""

    spring_stiffness: float = parameter(8e5, "N/m", "springs between slider and arms", source=SOURCE, low=0)
    damping: float = parameter(4e4, "N s/m", "dampers beside them", source=SOURCE, low=0)
    spring_length: float = parameter(0.5, "m", "length of the springs without force", source=SOURCE, low=0)
    ball_mass: float = parameter(5.0, "kg", "point mass at the end of each arm", source=SOURCE, low=0, strict=True)
    start_rate: float = parameter(2 * math.pi, "rad/s", "speed of the shaft at the start", source=SOURCE)
    density: float = parameter(3000.0, "kg/m3", "density of shaft, slider and arms", source=SOURCE, low=0, strict=True)
    arm_length: float = parameter(1.0, "m", "arms", source=SOURCE, low=0, strict=True)
    section: float = parameter(0.01, "m", "width of shaft and arms", source=SOURCE, low=0, strict=True)
    shaft_length: float = parameter(1.0, "m", "shaft; the arms hang at its top", source=SOURCE, low=0, strict=True)
    slider_size: float = parameter(0.1, "m", "edge of the slider, a cube", source=SOURCE, low=0, strict=True)
    pivot: float = parameter(0.05, "m", "distance of the pivots from the axis", source=SOURCE, low=0, strict=True)
    start_angle: float = parameter(math.radians(30.0), "rad", "arms below the horizontal at the start", source=SOURCE)
    start_height: float = parameter(0.5, "m", "height of the slider at the start", source=SOURCE)
    gravity: float = parameter(9.81, "m/s2", "gravity, along -z", source=SOURCE)
    duration: float = parameter(10.0, "s", "duration of the scene", source=SOURCE, low=0, strict=True)

    @property
    def arm_mass(self) -> float:
        """Mass of an arm without its ball [kg]."""
        return self.density * self.arm_length * self.section**2

    @property
    def slider_mass(self) -> float:
        """Mass of the slider [kg]."""
        return self.density * self.slider_size**3
