"""Parameters of the series-planet gear, and what follows from them at once."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from mechlab.analytic import planetary_synthesis as closed_form
from mechlab.catalog.planetary.claims import SOURCE
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import parameter


@dataclass(frozen=True)
class Parameters:
    """Teeth, sizes, inertias and torques."""

    teeth: tuple[int, ...] = parameter((18, 36, 18, 90), "", "teeth z1, z2, z3, z4", low=6, source=SOURCE)
    planets: int = parameter(3, "", "rays of planets", low=1, high=12)
    module: float = parameter(0.002, "m", "module", low=0, strict=True)
    J_sun: float = parameter(1e-4, "kg m2", "sun with its shaft", low=0, strict=True)
    J_planet_2: float = parameter(6e-5, "kg m2", "each planet 2 about its axis", low=0, strict=True)
    J_planet_3: float = parameter(1e-5, "kg m2", "each planet 3 about its axis", low=0, strict=True)
    J_carrier: float = parameter(4e-3, "kg m2", "carrier without planets", low=0, strict=True)
    mass_2: float = parameter(0.12, "kg", "each planet 2", low=0, strict=True)
    mass_3: float = parameter(0.08, "kg", "each planet 3", low=0, strict=True)
    sun_torque: float = parameter(0.5, "N m", "driving torque on the sun")
    carrier_torque: float = parameter(-1.0, "N m", "load torque on the carrier")

    def __post_init__(self) -> None:
        z1, z2, z3, z4 = self.teeth
        what = f"planetary: teeth = {z1}, {z2}, {z3}, {z4}"
        if z3 + z4 > z1 + 2 * z2 + z3:
            raise MechlabError(
                f"{what}: gear 4 and planet 3 do not fit on one ray; z4 must be at most z1 + 2 z2 = {z1 + 2 * z2}."
            )
        if (z1 + z4) % self.planets:
            raise MechlabError(
                f"{what}: {self.planets} planets cannot stand at equal angles: (z1 + z4) / planets = "
                f"{z1 + z4}/{self.planets} is not whole."
            )
        if self.planets > 1 and float(np.min(closed_form.neighbour_gaps(z1, z2, z3, self.planets))) < 0.0:
            pair = ("2-2", "3-3", "2-3'")[int(np.argmin(closed_form.neighbour_gaps(z1, z2, z3, self.planets)))]
            raise MechlabError(f"{what}: {self.planets} planets overlap ({pair}); take fewer planets or other teeth.")

    @property
    def ratio(self) -> Fraction:
        """Turns of the sun for one turn of the carrier: 1 + z4 / z1."""
        return 1 + Fraction(self.teeth[3], self.teeth[0])

    @property
    def radii(self) -> tuple[float, float]:
        """Distances of the axes of planets 2 and 3 from the centre [m]."""
        z1, z2, z3, _ = self.teeth
        return 0.5 * self.module * (z1 + z2), 0.5 * self.module * (z1 + 2 * z2 + z3)

    @property
    def rates(self) -> dict[str, Fraction]:
        """Absolute speeds for a carrier speed of 1: sun and the planets."""
        _, z2, z3, z4 = self.teeth
        return {"sun": self.ratio, "planet_2": 1 - Fraction(z4, z2), "planet_3": 1 + Fraction(z4, z3)}

    @property
    def inertia(self) -> float:
        """Kinetic energy is this times the square of the carrier speed over 2 [kg m2]."""
        r2, r3 = self.radii
        c = {k: float(v) ** 2 for k, v in self.rates.items()}
        orbit = (
            self.mass_2 * r2**2
            + self.mass_3 * r3**2
            + self.J_planet_2 * c["planet_2"]
            + self.J_planet_3 * c["planet_3"]
        )
        return self.J_carrier + self.J_sun * c["sun"] + self.planets * orbit
