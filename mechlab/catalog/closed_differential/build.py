"""The closed differential: parameters, its two stages and the Mechanism in three fidelities."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

from mechlab.analytic import differential as closed
from mechlab.catalog.bibliography import GEAR_CVT
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.parameters import parameter
from mechlab.kit.epicyclic_build import flat, on_circle
from mechlab.kit.palette import BLUE, BRASS, GREEN, RED, STEEL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Vector, axis_rotation
from mechlab.mechanism.parts import Color, Shape
from mechlab.shapes import external_phase, internal_phase

SOURCE = f"{GEAR_CVT.label}, example"
LAB = "chosen for the lab"
STATED_TEETH = (30, 30, 90, 40, 60, 160)
USED_TEETH = (80, 20, 120, 20, 80, 180)
"""Teeth of the source's example: as stated in its data, and as used in its computation (radii over the module)."""
WIDTH, GAP = 8.0, 9.0
"""Face width and clear distance of the two gear planes, in modules."""


@dataclass(frozen=True)
class Stage:
    """A carrier with its planets; teeth of sun, planet and ring, masses [kg], moments of inertia [kg m2].

    radius: of the planet axes [m]; plane: height of the gears [m]; outwards: +1 where the carrier lies above them, -1 below.
    """

    carrier: str
    planet: str
    meshes: tuple[str, str]
    teeth: tuple[int, ...]
    planets: int
    radius: float
    plane: float
    outwards: float
    color: Color
    carrier_inertia: float
    planet_mass: float
    planet_inertia: float

    def azimuth(self, k: int) -> float:
        """Angle [rad] of planet k on its carrier: the place nearest to equal spacing at which both its meshes fit."""
        sun, _, ring = self.teeth
        return 2.0 * math.pi * round(k * (sun + ring) / self.planets) / (sun + ring)

    def planet_axis(self, k: int) -> Vector:
        """Centre of planet k in the frame of its carrier [m]."""
        return on_circle(self.radius, self.azimuth(k), self.plane)

    def planet_phase(self, k: int) -> float:
        """Angle [rad] by which planet k is turned, so that its teeth stand in the gaps of the sun."""
        return external_phase(self.teeth[0], 0.0, self.teeth[1], self.azimuth(k))

    @property
    def ring_phase(self) -> float:
        """Angle [rad] by which the ring is turned, so that the teeth of the planets stand in its gaps."""
        return internal_phase(self.teeth[1], self.planet_phase(0), self.teeth[2], 0.0)

    def inertia(self, carried: int) -> Inertia:
        """Inertia of the carrier. `carried` of its planets are bodies; the others count as point masses on it."""
        bare, riding = self.carrier_inertia, (self.planets - carried) * self.planet_mass
        return flat(bare / self.radius**2 + riding, bare + riding * self.radius**2)


@dataclass(frozen=True)
class Parameters:
    """Teeth, inertias, loads and drags. The default teeth have the ratios that the source computes with, and can be
    assembled with three planets."""

    teeth: tuple[int, ...] = parameter((72, 18, 108, 18, 72, 162), "", "sun 1, planet 2, ring 3, sun 4, planet 5, ring 6",
                                       source="ours: the ratios that the source computes with", low=6)  # fmt: skip
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
    w_H2_0: float = parameter(50.0, "rad/s", "speed of H2 at the start", source="ours: the speed that (10) gives in the example")
    drag_14: float = parameter(0.0, "N m s", "viscous drag of block 14 against the housing", source=LAB, low=0)
    drag_36: float = parameter(0.0, "N m s", "viscous drag of block 36 against the housing", source=LAB, low=0)
    drag_internal: float = parameter(0.0, "N m s", "viscous drag between the blocks", source=LAB, low=0)
    lock_ratio: Fraction = parameter(Fraction(6), "", "w1/w3 of the scene locked-pair", source=LAB)
    motor_stall: float = parameter(200.0, "N m", "stall moment of the motor", source=LAB)
    motor_no_load: float = parameter(200.0, "rad/s", "no-load speed of the motor", source=LAB, low=0, strict=True)
    motor_power: float = parameter(1e4, "W", "power of the scene constant-power", source=SOURCE)
    load_drag: float = parameter(4.0, "N m s", "viscous load of H2 in the scenes with a motor", source=LAB, low=0)

    brake_moment: float = parameter(400.0, "N m", "dry brake on block 36 in the scene braked-start", source=LAB, low=0)
    converter_capacity: float = parameter(6e-4, "N m s2", "capacity of the torque converter", source=LAB, low=0, strict=True)
    converter_stall: float = parameter(5.0, "", "its moment ratio with the turbine at rest", source=LAB, low=1, strict=True)
    converter_efficiency: float = parameter(0.85, "", "its best efficiency", source=LAB, low=0, strict=True, high=1)

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

    def converter(self, lossless: bool = False) -> closed.Converter:
        """The torque converter of the figure 1 of the source, or one without losses."""
        return closed.Converter(self.converter_capacity, self.converter_stall, self.converter_efficiency, lossless)

    @property
    def radii(self) -> tuple[float, float]:
        """Radii of the planet axes on H1 and H2 [m]."""
        z1, z2, _, z4, z5, _ = self.teeth
        return 0.5 * self.module * (z1 + z2), 0.5 * self.module * (z4 + z5)

    @property
    def stages(self) -> tuple[Stage, Stage]:
        """The carriers H1 and H2 with their planets."""
        first, second = self.teeth[:3], self.teeth[3:]
        return (
            Stage("H1", "planet_2", ("mesh_12", "mesh_23"), first, self.planets, self.radii[0], 0.0, -1.0, RED,
                  self.J_H1, self.m2, self.J2),
            Stage("H2", "planet_5", ("mesh_45", "mesh_56"), second, self.planets, self.radii[1],
                  (WIDTH + GAP) * self.module, 1.0, GREEN, self.J_H2, self.m5, self.J5),
        )  # fmt: skip

    def bodies(self, fidelity: str) -> int:
        """How many planets of a stage are bodies of their own."""
        return {"minimal": 0, "parts": 1, "full": self.planets}[fidelity]

    @property
    def inertias(self) -> closed.Inertias:
        """The inertias for the closed forms."""
        return closed.Inertias(
            self.J_H1, self.J14, self.J36, self.J_H2, self.J2, self.m2, self.J5, self.m5, self.planets, *self.radii
        )


def _gear(p: Parameters, kind: str, color: Color, name: str, plane: float, teeth: int, **size: float) -> Shape:
    return shape(kind, _at(plane), color, name, teeth=teeth, module=p.module, width=WIDTH * p.module, **size)


def _tube(color: Color, name: str, z: float, outer: float, inner: float, length: float) -> Shape:
    return shape("tube", _at(z), color, name, outer=outer, inner=inner, length=length)


def _at(z: float) -> Placement:
    return Placement((0.0, 0.0, z))


def _shaft_radius(p: Parameters) -> float:
    return 0.2 * p.module * min(p.teeth[0], p.teeth[3])


def planet(p: Parameters, s: Stage, k: int) -> tuple[Shape, ...]:
    """Planet k in the frame of its own axis."""
    z = s.teeth[1]
    bore, holes = 0.09 * p.module * z, 5 if z >= 30 else 0
    return (_gear(p, "spur_gear", STEEL, s.planet, 0.0, z, bore=bore, phase=s.planet_phase(k), holes=holes),)


def block_14(p: Parameters) -> tuple[Shape, ...]:
    """Suns 1 and 4 on one shaft, which stands out beyond both."""
    bore, end = _shaft_radius(p), p.stages[1].plane
    suns = []
    for s, name in zip(p.stages, ("sun_1", "sun_4"), strict=True):
        z = s.teeth[0]
        suns.append(_gear(p, "spur_gear", BRASS, name, s.plane, z, bore=bore, phase=0.0, holes=6 if z >= 40 else 0))
    return (*suns, shape("cylinder", _at(0.5 * end), BRASS, "shaft", radius=bore, length=end + 18.0 * p.module))


def block_36(p: Parameters) -> tuple[Shape, ...]:
    """Rings 3 and 6 joined by a drum between the gear planes. Where they differ in size each has a drum of its own as far as
    a flange in the middle."""
    m = p.module
    rings = [
        _gear(p, "internal_gear", BLUE, name, s.plane, s.teeth[2], phase=s.ring_phase)
        for s, name in zip(p.stages, ("ring_3", "ring_6"), strict=True)
    ]
    inner, outer = ([0.5 * m * s.teeth[2] + wall * m for s in p.stages] for wall in (1.25, 4.25))
    low, high = 0.5 * WIDTH * m, p.stages[1].plane - 0.5 * WIDTH * m
    middle, length = 0.5 * (low + high), high - low
    if inner[0] == inner[1]:
        return (*rings, _tube(BLUE, "drum_1", middle, outer[0], inner[0], length))
    drums = [
        _tube(BLUE, f"drum_{k + 1}", low + (0.25 + 0.5 * k) * length, outer[k], inner[k], 0.5 * length) for k in (0, 1)
    ]
    return (*rings, *drums, _tube(BLUE, "flange", middle, max(outer), min(inner), 1.5 * m))


def carrier(p: Parameters, s: Stage) -> tuple[Shape, ...]:
    """A carrier on the outer side of its gear plane: hub, shaft, arms, and pins through the planets."""
    m, name, color, bore = p.module, s.carrier, s.color, 1.15 * _shaft_radius(p)
    z = s.plane + s.outwards * (0.5 * WIDTH + 3.5) * m
    hub, pin = max(0.28 * s.radius, 1.6 * bore), 0.09 * m * s.teeth[1]
    out = [
        shape("disc", _at(z), color, f"{name}_hub", radius=hub, thickness=4 * m, bore=bore),
        _tube(color, f"{name}_shaft", z + s.outwards * 6 * m, 1.5 * bore, bore, 10 * m),
    ]
    start, width = max(0.2 * s.radius, 1.35 * bore), max(2.8 * pin, 0.14 * s.radius)
    middle = 0.5 * (z + s.plane - s.outwards * (0.5 * WIDTH + 0.5) * m)
    for k in range(s.planets):
        turn = s.azimuth(k)
        arm = Placement.of(axis_rotation((0, 0, 1.0), turn), on_circle(start, turn, z))
        out.append(shape("link", arm, color, f"{name}_arm_{k + 1}", length=s.radius - start, width=width, thickness=4 * m,
                         bore=0.3 * pin))  # fmt: skip
        out.append(shape("cylinder", Placement(on_circle(s.radius, turn, middle)), color, f"{name}_pin_{k + 1}", radius=pin,
                         length=abs(z - s.plane) + (0.5 * WIDTH + 2.5) * m))  # fmt: skip
    return tuple(out)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: two coordinates, no rows; all dependent parts are shafts. parts: one planet a stage. full: all planets.

    H1, H2, block_14, block_36 and the absolute turns planet_2_spin, planet_5_spin are joints or shafts of every fidelity.
    One drive, the input H1. No gravity: the axis stands upright.
    Raises MechlabError for `minimal` when both carriers turn as one.
    """
    b = Builder("closed_differential", gravity=(0.0, 0.0, 0.0), summary="closed gear differential, two freedoms")
    if fidelity == "minimal":
        _minimal(b, p)
    elif fidelity in ("parts", "full"):
        _gears(b, p, p.bodies(fidelity))
    else:
        raise unknown("closed_differential: fidelity", fidelity, ("minimal", "parts", "full"))
    return b.drive("H1").build()


def _minimal(b: Builder, p: Parameters) -> None:
    """H2 is a child of H1, so that every shaft speed is a sum over one path: w = w_H1 + coefficient x (w_H2 - w_H1).
    The planets of a stage are one shaft, which is not drawn: a page shows the full train instead."""
    if not p.train.regular:
        raise MechlabError(
            f"closed_differential: teeth {p.teeth}: both carriers turn as one (z1/z3 = z4/z6), their speeds do not fix "
            "the blocks. Change the teeth, or take the fidelity 'parts'."
        )
    a, c = p.train.exact_shares
    w1, w3 = -(1 - a) / (a - c), a / (a - c)  # coefficients of w_H2 - w_H1; that of w_H1 is 1
    (first, second), far = p.stages, "H2_on_H1"
    b.body("H1", revolute("H1"), inertia=first.inertia(0), shapes=carrier(p, first))
    b.body("H2", revolute(far), parent="H1", inertia=second.inertia(0), shapes=carrier(p, second))
    b.shaft("H2", {"H1": 1, far: 1})
    b.shaft("block_14", {"H1": 1, far: w1}, inertia=p.J14, shapes=block_14(p))
    b.shaft("block_36", {"H1": 1, far: w3}, inertia=p.J36, shapes=block_36(p))
    for s in p.stages:
        sun, pinion, ring = s.teeth
        spin = (ring * w3 - sun * w1) / (2 * pinion)
        b.shaft(f"{s.planet}_spin", {"H1": 1, far: spin}, inertia=p.planets * s.planet_inertia)


def _gears(b: Builder, p: Parameters, planets: int) -> None:
    r1 = p.radii[0]
    b.body("block_14", revolute("block_14"), inertia=flat(p.J14 / r1**2, p.J14), shapes=block_14(p))
    b.body("block_36", revolute("block_36"), inertia=flat(p.J36 / r1**2, p.J36), shapes=block_36(p))
    for s in p.stages:
        (sun, pinion, ring), (inner, outer), arm = s.teeth, s.meshes, s.carrier
        inertia = flat(s.planet_mass, s.planet_inertia * (p.planets if planets == 1 else 1))
        b.body(arm, revolute(arm), inertia=s.inertia(planets), shapes=carrier(p, s))
        for k in range(planets):
            name = f"{s.planet}_{k + 1}"
            b.body(name, revolute(name), parent=arm, at=s.planet_axis(k), inertia=inertia, shapes=planet(p, s, k))
            b.gears(f"{inner}_{k + 1}", "block_14", name, (sun, pinion), carrier=arm)
            b.gears(f"{outer}_{k + 1}", "block_36", name, (ring, pinion), carrier=arm, kind="internal")
        b.shaft(f"{s.planet}_spin", {arm: 1, f"{s.planet}_1": 1})
