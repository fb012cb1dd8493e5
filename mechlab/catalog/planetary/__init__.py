"""The planetary gear with series planets (2A-AA): sun 1 - planet 2 - planet 3 - fixed central gear 4, all meshes external.

Carrier output; the axes of sun, planet 2 and planet 3 stand on one ray, planet 3 outermost and wide: it meshes with
planet 2 in the plane of the sun and with gear 4 in a second plane. Its teeth come from `mechlab synthesize planetary`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import planetary_synthesis as closed_form
from mechlab.catalog.bibliography import PLANETARY
from mechlab.catalog.planetary.claims import CLAIMS
from mechlab.catalog.planetary.figures import FIGURES
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Check, CheckResult, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.kit import epicyclic_build as parts
from mechlab.kit import epicyclic_teeth as meshing
from mechlab.kit.epicyclic_checks import inertia_check, mesh_check, room_check, speeds_check, torque_check
from mechlab.kit.epicyclic_mass import CentralWheel, moving_carrier, moving_check, train_state
from mechlab.kit.epicyclic_motion import ConstantTorques, expand_by, speed_questions
from mechlab.kit.mass_check import State
from mechlab.kit.palette import BLUE, BRASS, RED, STEEL, TEAL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase


@dataclass(frozen=True)
class Parameters:
    """Teeth, sizes, inertias and torques."""

    teeth: tuple[int, ...] = parameter(
        (18, 36, 18, 90), "", "teeth z1, z2, z3, z4", low=6, source="ours: ratio 6 with the fewest teeth; the source prints none"
    )
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
        spacing = f"(z1 + z4) / planets = {z1 + z4}/{self.planets} is not whole"
        meshing.require_equal_angles(what, self.planets, z1 + z4, spacing)
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
    def planet_sets(self) -> tuple[parts.Planets, parts.Planets]:
        """Planets 2 and planets 3 of the carrier."""
        (r2, r3), angles = self.radii, meshing.azimuths(self.planets)
        return (
            parts.Planets("planet_2", self.mass_2, self.J_planet_2, r2, angles),
            parts.Planets("planet_3", self.mass_3, self.J_planet_3, r3, angles),
        )

    @property
    def rates(self) -> dict[str, Fraction]:
        """Absolute speeds for a carrier speed of 1: sun and the planets."""
        _, z2, z3, z4 = self.teeth
        return {"sun": self.ratio, "planet_2": 1 - Fraction(z4, z2), "planet_3": 1 + Fraction(z4, z3)}

    @property
    def inertia(self) -> float:
        """Inertia I of the train reduced to the carrier [kg m2]: kinetic energy = I (carrier speed)^2 / 2."""
        r2, r3 = self.radii
        c = {k: float(v) ** 2 for k, v in self.rates.items()}
        orbit = (
            self.mass_2 * r2**2
            + self.mass_3 * r3**2
            + self.J_planet_2 * c["planet_2"]
            + self.J_planet_3 * c["planet_3"]
        )
        return self.J_carrier + self.J_sun * c["sun"] + self.planets * orbit


def phases(p: Parameters, k: int) -> tuple[float, float, float]:
    """Phases of planet 2, planet 3 and gear 4 for ray k, the sun at phase 0: a tooth stands in a gap at every mesh."""
    z1, z2, z3, z4 = p.teeth
    a = meshing.azimuth(k, p.planets)
    two = external_phase(z1, 0.0, z2, a)
    three = external_phase(z2, two, z3, a)
    return two, three, external_phase(z3, three, z4, a + math.pi)


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, Shape]:
    """Planets 2 and 3 of ray k, in phase with the sun; planet 3 reaches into the plane of gear 4."""
    m, (_, z2, z3, _), (two, three, _) = p.module, p.teeth, phases(p, k)
    return (
        parts.gear("planet_2", STEEL, z2, m, 8 * m, two, bore=0.09 * m * z2, holes=5),
        parts.gear("planet_3", TEAL, z3, m, 18 * m, three, -4.5 * m, bore=0.09 * m * z3),
    )


def fixed_gear(p: Parameters) -> Shape:
    """Gear 4 in the second plane; it carries the whole profile shift of its mesh (the other two have none)."""
    z4 = p.teeth[3]
    x = min(float(closed_form.profile_shift(*p.teeth)), 1.0)
    m, phase = p.module, phases(p, 0)[2]
    return parts.gear("gear_4", BLUE, z4, m, 8 * m, phase, -9.0 * m, bore=0.3 * m * z4, profile_shift=x)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m, (r2, r3) = p.module, p.radii
    hub = shape("disc", Placement((0.0, 0.0, 8 * m)), RED, "hub", radius=0.3 * r2, thickness=4 * m)
    arm = parts.Arm(start=0.0, length=r3, height=8 * m, width=0.16 * r2, thickness=3 * m, bore=0.03 * r2)
    pins = [
        parts.Pin(r, middle=0.5 * (low + 9.0) * m, radius=0.03 * r2, length=(9.0 - low) * m, suffix=suffix)
        for suffix, r, low in (("a", r2, -5.0), ("b", r3, -14.0))
    ]
    return hub, *parts.arms_and_pins(meshing.azimuths(p.planets), arm, pins)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: one coordinate, no rows. parts: one ray of planets, each mesh a row. full: all rays, redundant rows."""
    bodies = parts.planet_bodies("planetary", fidelity, p.planets)
    b = Builder("planetary", gravity=(0.0, 0.0, 0.0), summary="planetary gear with series planets, all meshes external")
    (z1, z2, z3, z4), m = p.teeth, p.module
    b.ground(fixed_gear(p))
    sun = parts.gear("sun", BRASS, z1, m, 8 * m, bore=0.09 * m * z1)
    parts.add_carrier(b, p.J_carrier, p.radii[1], p.planet_sets, bodies, carrier_shapes(p))
    if bodies:
        b.body("sun", revolute("sun"), inertia=parts.disc(p.J_sun, 0.5 * m * z1), shapes=(sun,))
    else:
        b.shaft("sun", {"carrier": p.ratio}, inertia=p.J_sun, shapes=(sun,))
        relative = (-Fraction(z4, z2), Fraction(z4, z3))
        for k in range(p.planets):
            for planets, turn, look in zip(p.planet_sets, relative, planet_shapes(p, k), strict=True):
                planets.add_shafts(b, k, {"carrier": turn}, (look,))
    for k in range(bodies):
        looks = zip(p.planet_sets, planet_shapes(p, k), strict=True)
        two, three = (planets.add_body(b, k, bodies, (look,)) for planets, look in looks)
        b.gears(f"sun_{two}", "sun", two, (z1, z2), carrier="carrier")
        b.gears(f"{two}_{three}", two, three, (z2, z3), carrier="carrier")
        b.relation(f"{three}_gear_4", **{three: 1, "carrier": -Fraction(z4, z3)})
    b.drive("sun", stiffness=50.0, damping=0.2)
    return b.build()


SPEEDS = ("sun_rate", "carrier_rate", "planet_2_rate", "planet_3_rate")


def _speeds(p: Parameters, given: Mapping[str, Any]) -> dict[str, Any]:
    carrier = given["carrier_rate"] if "carrier_rate" in given else given["sun_rate"] / float(p.ratio)
    return {f"{n}_rate": carrier * float(c) for n, c in p.rates.items()} | {"carrier_rate": carrier}


PLANETS = {"planet_2_rate": "planet_2_1", "planet_3_rate": "planet_3_1"}
QUESTIONS = speed_questions([("sun_rate",), ("carrier_rate",)], SPEEDS, PLANETS, _speeds, lambda p: build(p, "parts"))


def acceleration(p: Parameters) -> float:
    """Carrier acceleration under the torques of the scene [rad/s2]."""
    return (p.sun_torque * float(p.ratio) + p.carrier_torque) / p.inertia


TORQUES = {"sun": "sun_torque", "carrier": "carrier_torque"}
MOTION = ConstantTorques(build, "sun and carrier", TORQUES, lambda p: {"carrier": acceleration(p)})


def _angles(p: Parameters, recording: Recording) -> dict[str, Array]:
    factor = {"sun": float(p.ratio), "carrier": 1.0}
    factor |= {f"planet_{n}_{k + 1}": float(p.rates[f"planet_{n}"] - 1) for n in (2, 3) for k in range(p.planets)}
    return {name: x * recording.channel("carrier") for name, x in factor.items()}


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE. Planets that are no bodies ride on the carrier, a flat disc as wide as its outer circle; in
    `minimal` all wheels turn as shafts, in `parts` one ray turns for all."""
    bodies = parts.planet_bodies("planetary", fidelity, p.planets)
    turns = {name: float(x) for name, x in p.rates.items()}
    carrier = moving_carrier(p.J_carrier, p.radii[1], p.planet_sets, bodies)
    wheels = {"sun": CentralWheel(p.J_sun, 0.5 * p.module * p.teeth[0], turns["sun"], is_body=bool(bodies))}
    return train_state(carrier, wheels, {x: turns[x.name] for x in p.planet_sets}, bodies)


def _teeth(p: Parameters) -> CheckResult:
    """Phase left over at gear 4 on every ray, in pitches: 0 when a tooth stands in a gap there."""
    pitch = 2.0 * math.pi / p.teeth[3]
    off = [(phases(p, k)[2] - phases(p, 0)[2]) / pitch for k in range(p.planets)]
    measured = {"drawn": max(abs(x - round(x)) for x in off)}
    return CheckResult(measured, 1e-9, 0.0, "gear 4 meshes with planet 3 on every ray [pitches]")


def _neighbours(p: Parameters) -> list[tuple[str, str, int]]:
    """Pairs of neighbouring planets, and the sum of their tip radii, (z + 2) half modules each."""
    _, z2, z3, _ = p.teeth
    return [
        ("planet_2_1", "planet_2_2", z2 + z2 + 4),
        ("planet_3_1", "planet_3_2", z3 + z3 + 4),
        ("planet_2_1", "planet_3_2", z2 + z3 + 4),
    ]


def _gaps(p: Parameters) -> Array:
    z1, z2, z3, _ = p.teeth
    return closed_form.neighbour_gaps(z1, z2, z3, p.planets)


WILLIS = "all members from the sun and from the carrier"
ROOM = "room between neighbouring planets [half modules]"
CHECKS = (
    speeds_check("S1", QUESTIONS, (7.0,), WILLIS, lambda p: 1e-9 * float(p.ratio)),
    inertia_check(
        "S2",
        build,
        ("carrier",),
        lambda p: p.inertia,
        "inertia reduced to the carrier, relative to the closed form",
        "reduced inertia of each fidelity against the closed form",
    ),
    torque_check("S3", MOTION, "carrier", acceleration),
    Check("S4", "teeth in phase on every ray", _teeth, "assembly condition (z1 + z4) / planets whole"),
    room_check("S5", build, _neighbours, 0.5, _gaps, "law of cosines", ROOM),
    moving_check("S6", build, state),
    mesh_check("S7", build, meshes=3, wheels=2),
)

ENTRY = MOTION.entry(
    minimal="one coordinate, all gears as shafts",
    ray="ray",
    name="planetary",
    title="Planetary gear with series planets",
    family="gear-train",
    summary="Sun, two planets in series on each ray, fixed central gear, all meshes external; ratio 1 + z4 / z1.",
    plots=(
        PlotRecipe("input and output speed", ("sun_rate", "carrier_rate")),
        PlotRecipe("transmission ratio", ("sun_rate",), over="carrier_rate"),
        PlotRecipe("input and output angle", ("sun", "carrier")),
    ),
    parameters=Parameters,
    questions=QUESTIONS,
    checks=CHECKS,
    claims=CLAIMS,
    figures=FIGURES,
    expand=expand_by(build, _angles),
    chain="2A-AA epicyclic, series planets",
    formulas="w_sun = (1 + z4 / z1) w_carrier; planet 3 turns against the carrier by z4 / z3, planet 2 by -z4 / z2.",
    sources=(PLANETARY.citation, "Willis 1841"),
)
