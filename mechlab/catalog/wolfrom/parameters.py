"""Parameters of the Wolfrom train, and what follows from them at once."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from mechlab.analytic import wolfrom as closed_form
from mechlab.analytic.planetary_stage import conditions
from mechlab.catalog.wolfrom.meshing import Teeth, planet_turn
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import parameter


@dataclass(frozen=True)
class Parameters:
    """Teeth, sizes, inertias and torques. The second module follows from the common centre distance."""

    teeth: tuple[int, ...] = parameter(
        (22, 44, 110, 44, 116), "", "sun, planet 1, held ring, planet 2, output ring", low=6
    )
    module: float = parameter(0.0012, "m", "module of sun, planet 1 and held ring", low=0, strict=True)
    planets: int = parameter(3, "", "number of planets", low=1, high=12)
    J_sun: float = parameter(2e-5, "kg m2", "sun with its shaft and rotor", low=0, strict=True)
    J_planet: float = parameter(1.5e-5, "kg m2", "each stepped planet about its own axis", low=0, strict=True)
    J_carrier: float = parameter(1.2e-4, "kg m2", "carrier without planets", low=0, strict=True)
    J_ring: float = parameter(2e-3, "kg m2", "output ring with what it turns", low=0, strict=True)
    planet_mass: float = parameter(0.06, "kg", "each planet", low=0, strict=True)
    sun_torque: float = parameter(0.05, "N m", "driving torque on the sun")
    ring_torque: float = parameter(-4.0, "N m", "load torque on the output ring")

    def __post_init__(self) -> None:
        sun, planet, ring, second, output = self.all_teeth
        closed_form.ratio(self.all_teeth)
        found = conditions(sun, planet, ring, self.planets)
        if not found.coaxial:
            raise MechlabError(
                f"wolfrom: teeth = {self.teeth}: the axes do not align; the held ring needs {sun + 2 * planet} teeth."
            )
        if output <= second:
            raise MechlabError(
                f"wolfrom: teeth = {self.teeth}: the output ring must have more teeth than planet 2 ({second})."
            )
        if not found.even:
            raise MechlabError(
                f"wolfrom: {self.planets} planets cannot stand at equal angles: (sun + ring) / planets = {sun + ring}/{self.planets}."
            )
        if not found.neighbours:
            raise MechlabError(
                f"wolfrom: {self.planets} planets of {planet} teeth overlap; take fewer planets or smaller ones."
            )
        for k in range(self.planets):
            planet_turn(self.all_teeth, self.planets, k)

    @property
    def all_teeth(self) -> Teeth:
        """The five tooth counts."""
        a, b, c, d, e = self.teeth
        return a, b, c, d, e

    @property
    def orbit(self) -> float:
        """Radius of the planet axes [m]."""
        return 0.5 * self.module * (self.teeth[0] + self.teeth[1])

    @property
    def second_module(self) -> float:
        """Module of planet 2 and the output ring [m]: the same centre distance."""
        return 2.0 * self.orbit / (self.teeth[4] - self.teeth[3])

    @property
    def ratio(self) -> Fraction:
        """Sun rate over output rate."""
        return closed_form.ratio(self.all_teeth)
