"""Parameters of a planetary stage."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.analytic import planetary_stage as closed_form
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.parameters import parameter


@dataclass(frozen=True)
class Parameters:
    """Teeth, sizes, inertias and torques of a stage."""

    teeth: tuple[int, ...] = parameter((24, 30, 84), "", "teeth of sun, planet, ring", low=6)
    module: float = parameter(0.002, "m", "module of the gears", low=0, strict=True)
    planets: int = parameter(3, "", "number of planets", low=1, high=12)
    ring: str = parameter("held", "", "'held' or 'free'")
    J_sun: float = parameter(2e-4, "kg m2", "sun with its shaft", low=0, strict=True)
    J_planet: float = parameter(5e-5, "kg m2", "each planet about its own axis", low=0, strict=True)
    J_ring: float = parameter(4e-3, "kg m2", "ring", low=0, strict=True)
    J_carrier: float = parameter(1e-3, "kg m2", "carrier without planets", low=0, strict=True)
    planet_mass: float = parameter(0.12, "kg", "each planet", low=0, strict=True)
    sun_torque: float = parameter(0.5, "N m", "driving torque on the sun")
    carrier_torque: float = parameter(-1.0, "N m", "load torque on the carrier")

    def __post_init__(self) -> None:
        sun, planet, ring = self.teeth
        if self.ring not in ("held", "free"):
            raise unknown("planetary_stage: ring", self.ring, ("held", "free"))
        found = closed_form.conditions(sun, planet, ring, self.planets)
        if not found.coaxial:
            raise MechlabError(
                f"planetary_stage: teeth = {sun}, {planet}, {ring}: the axes do not align; the ring needs {sun + 2 * planet} teeth."
            )
        if not found.even:
            raise MechlabError(
                f"planetary_stage: {self.planets} planets cannot stand at equal angles: "
                f"(sun + ring) / planets = {sun + ring}/{self.planets} is not whole."
            )
        if not found.neighbours:
            raise MechlabError(
                f"planetary_stage: {self.planets} planets of {planet} teeth overlap; take fewer planets or smaller ones."
            )

    @property
    def orbit(self) -> float:
        """Radius of the planet axes [m]."""
        return 0.5 * self.module * (self.teeth[0] + self.teeth[1])

    @property
    def stage(self) -> closed_form.PlanetaryStage:
        """The same stage for the closed form."""
        sun, planet, ring = self.teeth
        return closed_form.PlanetaryStage(
            sun,
            planet,
            ring,
            self.planets,
            self.J_sun,
            self.J_planet,
            self.J_ring,
            self.J_carrier,
            self.planet_mass,
            self.orbit,
        )
