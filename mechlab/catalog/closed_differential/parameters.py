"""Parameters of the closed gear differential."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from mechlab.analytic import differential as closed
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import parameter

SOURCE = "paper on a gear CVT as a closed differential, Problems of Mechanical Engineering 15 (2012) 5-6"
LAB = "chosen for the lab"
STATED_TEETH = (30, 30, 90, 40, 60, 160)
USED_TEETH = (80, 20, 120, 20, 80, 180)
"""Teeth of the source's example: as stated in its data, and as used in its computation (radii over the module)."""


@dataclass(frozen=True)
class Parameters:
    """Teeth, inertias, loads and drags. The default teeth have the ratios that the source computes with, and can be
    assembled with three planets."""

    teeth: tuple[int, ...] = parameter((72, 18, 108, 18, 72, 162), "", "sun 1, planet 2, ring 3, sun 4, planet 5, ring 6",
                                       source=SOURCE, low=6)  # fmt: skip
    module: float = parameter(0.2 / 45, "m", "module of all gears", source=LAB, low=0, strict=True)
    planets: int = parameter(3, "", "planets on each carrier", source=LAB, low=1, high=12)
    J_H1: float = parameter(0.02, "kg m2", "input carrier without planets", source=LAB, low=0, strict=True)
    J14: float = parameter(0.03, "kg m2", "block of both suns", source=LAB, low=0, strict=True)
    J36: float = parameter(0.15, "kg m2", "block of both rings", source=LAB, low=0, strict=True)
    J_H2: float = parameter(0.02, "kg m2", "output carrier without planets", source=LAB, low=0, strict=True)
    J2: float = parameter(2.4e-4, "kg m2", "each planet 2 about its own axis", source=LAB, low=0, strict=True)
    m2: float = parameter(0.3, "kg", "mass of each planet 2", source=LAB, low=0, strict=True)
    J5: float = parameter(0.0512, "kg m2", "each planet 5 about its own axis", source=LAB, low=0, strict=True)
    m5: float = parameter(4.0, "kg", "mass of each planet 5", source=LAB, low=0, strict=True)
    M_H1: float = parameter(100.0, "N m", "moment that drives H1", source=SOURCE)
    M_H2: float = parameter(200.0, "N m", "moment that resists H2", source=SOURCE)
    w_H1_0: float = parameter(100.0, "rad/s", "speed of H1 at the start; of the held input", source=SOURCE)
    w_H2_0: float = parameter(50.0, "rad/s", "speed of H2 at the start", source=SOURCE)
    drag_14: float = parameter(0.0, "N m s", "viscous drag of block 14 against the housing", source=LAB, low=0)
    drag_36: float = parameter(0.0, "N m s", "viscous drag of block 36 against the housing", source=LAB, low=0)
    drag_internal: float = parameter(0.0, "N m s", "viscous drag between the blocks", source=LAB, low=0)
    lock_ratio: Fraction = parameter(Fraction(6), "", "w1/w3 of the scene locked-pair", source=LAB)
    motor_stall: float = parameter(200.0, "N m", "stall moment of the motor", source=LAB)
    motor_no_load: float = parameter(200.0, "rad/s", "no-load speed of the motor", source=LAB, low=0, strict=True)
    motor_power: float = parameter(1e4, "W", "power of the scene constant-power", source=SOURCE)
    load_drag: float = parameter(4.0, "N m s", "viscous load of H2 in the scenes with a motor", source=LAB, low=0)

    def __post_init__(self) -> None:
        closed.Train(*self.teeth)
        if self.teeth[2] < 16 or self.teeth[5] < 16:
            raise MechlabError(
                f"teeth: a ring needs at least 16 teeth, got z3 = {self.teeth[2]}, z6 = {self.teeth[5]}."
            )

    @property
    def train(self) -> closed.Train:
        """The train for the closed forms."""
        return closed.Train(*self.teeth)

    @property
    def radii(self) -> tuple[float, float]:
        """Radii of the planet axes on H1 and H2 [m]."""
        z1, z2, _, z4, z5, _ = self.teeth
        return 0.5 * self.module * (z1 + z2), 0.5 * self.module * (z4 + z5)

    @property
    def inertias(self) -> closed.Inertias:
        """The inertias for the closed forms."""
        return closed.Inertias(
            self.J_H1, self.J14, self.J36, self.J_H2, self.J2, self.m2, self.J5, self.m5, self.planets, *self.radii
        )
