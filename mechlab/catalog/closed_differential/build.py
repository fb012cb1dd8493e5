"""The closed differential: parameters, shapes of its gears, and the Mechanism in three fidelities."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from mechlab.analytic import differential as closed
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.parameters import parameter
from mechlab.kit.palette import BLUE, BRASS, GREEN, RED, STEEL
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Vector, axis_rotation
from mechlab.mechanism.parts import Color, Shape
from mechlab.shapes import external_phase, internal_phase

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


WIDTH, GAP = 8.0, 9.0
"""Face width and clear distance of the two gear planes, in modules."""


def planet_name(stage: int) -> str:
    """Planets of stage 1 are wheels 2, of stage 2 wheels 5."""
    return "planet_2" if stage == 1 else "planet_5"


def _teeth(p: Parameters, stage: int) -> tuple[int, int, int]:
    z1, z2, z3, z4, z5, z6 = p.teeth
    return (z1, z2, z3) if stage == 1 else (z4, z5, z6)


def _plane(p: Parameters, stage: int) -> float:
    return 0.0 if stage == 1 else (WIDTH + GAP) * p.module


def azimuth(p: Parameters, stage: int, k: int) -> float:
    """Angle [rad] of planet k on its carrier: the place nearest to equal spacing at which both its meshes fit."""
    sun, _, ring = _teeth(p, stage)
    return 2.0 * math.pi * round(k * (sun + ring) / p.planets) / (sun + ring)


def planet_axis(p: Parameters, stage: int, k: int) -> Vector:
    """Centre of planet k in the frame of its carrier [m]."""
    radius, turn = p.radii[stage - 1], azimuth(p, stage, k)
    return radius * math.cos(turn), radius * math.sin(turn), _plane(p, stage)


def _phase(p: Parameters, stage: int, k: int) -> float:
    sun, planet_teeth, _ = _teeth(p, stage)
    return external_phase(sun, 0.0, planet_teeth, azimuth(p, stage, k))


def _bore(p: Parameters, teeth: int, wanted: float) -> float:
    """The bore `wanted` [m], made smaller where it would leave no material under the teeth."""
    return min(wanted, 0.3 * p.module * teeth)


def _shaft_radius(p: Parameters) -> float:
    return 0.2 * p.module * min(p.teeth[0], p.teeth[3])


def planet(p: Parameters, stage: int, k: int) -> tuple[Shape, ...]:
    """A planet in the frame of its own axis."""
    z = _teeth(p, stage)[1]
    return (
        shape("spur_gear", color=STEEL, name=planet_name(stage), teeth=z, module=p.module, width=WIDTH * p.module,
              bore=_bore(p, z, 0.09 * p.module * z), phase=_phase(p, stage, k), holes=5 if z >= 30 else 0),
    )  # fmt: skip


def block_14(p: Parameters) -> tuple[Shape, ...]:
    """Suns 1 and 4 on one shaft, which stands out beyond both."""
    m, bore = p.module, _shaft_radius(p)
    suns = [
        shape("spur_gear", Placement((0.0, 0.0, _plane(p, s))), BRASS, name, teeth=_teeth(p, s)[0], module=m,
              width=WIDTH * m, bore=bore, phase=0.0, holes=6 if _teeth(p, s)[0] >= 40 else 0)
        for s, name in ((1, "sun_1"), (2, "sun_4"))
    ]  # fmt: skip
    middle = Placement((0.0, 0.0, 0.5 * _plane(p, 2)))
    return (*suns, shape("cylinder", middle, BRASS, "shaft", radius=bore, length=_plane(p, 2) + 18.0 * m))


def _ring_phase(p: Parameters, stage: int) -> float:
    _, z, ring = _teeth(p, stage)
    return internal_phase(z, _phase(p, stage, 0), ring, 0.0)


def block_36(p: Parameters) -> tuple[Shape, ...]:
    """Rings 3 and 6 joined by a drum between the gear planes, and a flange where the rings differ in size."""
    m = p.module
    rings, sizes = [], []
    for s, name in ((1, "ring_3"), (2, "ring_6")):
        z = _teeth(p, s)[2]
        sizes.append((0.5 * m * z + 1.25 * m, 0.5 * m * z + 4.25 * m))
        place = Placement((0.0, 0.0, _plane(p, s)))
        rings.append(
            shape("internal_gear", place, BLUE, name, teeth=z, module=m, width=WIDTH * m, phase=_ring_phase(p, s))
        )
    low, high = 0.5 * WIDTH * m, _plane(p, 2) - 0.5 * WIDTH * m
    inner, outer = min(s[0] for s in sizes), max(s[1] for s in sizes)
    wide = max(s[0] for s in sizes)
    flange = shape(
        "tube", Placement((0.0, 0.0, 0.5 * (low + high))), BLUE, "flange", outer=outer, inner=inner, length=1.5 * m
    )
    drums = [
        shape(
            "tube",
            Placement((0.0, 0.0, z)),
            BLUE,
            f"drum_{s + 1}",
            outer=sizes[s][1],
            inner=sizes[s][0],
            length=high - low,
        )
        for s, z in ((0, 0.5 * (low + high)), (1, 0.5 * (low + high)))
    ]
    return (*rings, *(drums[:1] if inner == wide else (*_halves(drums, low, high), flange)))


def _halves(drums: list[Shape], low: float, high: float) -> tuple[Shape, ...]:
    """Each drum from its own ring to the flange in the middle."""
    out = []
    for k, drum in enumerate(drums):
        sizes = dict(drum.size) | {"length": 0.5 * (high - low)}
        z = low + (0.25 + 0.5 * k) * (high - low)
        out.append(shape("tube", Placement((0.0, 0.0, z)), BLUE, drum.name, **sizes))
    return tuple(out)


def carrier(p: Parameters, stage: int) -> tuple[Shape, ...]:
    """A carrier on the outer side of its gear plane: hub, arms, pins through the planets, and a shaft."""
    m, (radius, side) = p.module, (p.radii[stage - 1], -1.0 if stage == 1 else 1.0)
    z = _plane(p, stage) + side * (0.5 * WIDTH + 3.5) * m
    color: Color = RED if stage == 1 else GREEN
    name, bore = f"H{stage}", 1.15 * _shaft_radius(p)
    pin = _bore(p, _teeth(p, stage)[1], 0.09 * m * _teeth(p, stage)[1])
    out = [
        shape(
            "disc",
            Placement((0.0, 0.0, z)),
            color,
            f"{name}_hub",
            radius=max(0.28 * radius, 1.6 * bore),
            thickness=4 * m,
            bore=bore,
        ),
        shape(
            "tube",
            Placement((0.0, 0.0, z + side * 6 * m)),
            color,
            f"{name}_shaft",
            outer=1.5 * bore,
            inner=bore,
            length=10 * m,
        ),
    ]
    for k in range(p.planets):
        turn = azimuth(p, stage, k)
        start = max(0.2 * radius, 1.35 * bore)
        place = Placement.of(axis_rotation((0, 0, 1.0), turn), (start * math.cos(turn), start * math.sin(turn), z))
        width = max(2.8 * pin, 0.14 * radius)
        out.append(
            shape(
                "link",
                place,
                color,
                f"{name}_arm_{k + 1}",
                length=radius - start,
                width=width,
                thickness=4 * m,
                bore=0.3 * pin,
            )
        )
        x, y, plane = planet_axis(p, stage, k)
        middle = 0.5 * (z + plane - side * (0.5 * WIDTH + 0.5) * m)
        length = abs(z - plane) + (0.5 * WIDTH + 2.5) * m
        out.append(
            shape("cylinder", Placement((x, y, middle)), color, f"{name}_pin_{k + 1}", radius=pin, length=length)
        )
    return tuple(out)


MESHES = ("mesh_12", "mesh_23", "mesh_45", "mesh_56")
"""Names of the meshes, each followed by _ and the number of the planet."""


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
        _gears(b, p, 1 if fidelity == "parts" else p.planets)
    else:
        raise unknown("closed_differential: fidelity", fidelity, ("minimal", "parts", "full"))
    return b.drive("H1").build()


def _disc(inertia: float, mass: float) -> Inertia:
    """A flat part with the given moment about z."""
    return Inertia.axial(mass, inertia, 0.5 * inertia)


def _carrier(p: Parameters, stage: int, carried: int) -> Inertia:
    """Inertia of a carrier. `carried` of its planets are bodies; the others count as point masses on it."""
    bare, mass = (p.J_H1, p.m2) if stage == 1 else (p.J_H2, p.m5)
    radius, riding = p.radii[stage - 1], p.planets - carried
    return _disc(bare + riding * mass * radius**2, bare / radius**2 + riding * mass)


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
    (z1, z2, z3, z4, z5, z6), far = p.teeth, "H2_on_H1"
    b.body("H1", revolute("H1"), inertia=_carrier(p, 1, 0), shapes=carrier(p, 1))
    b.body("H2", revolute(far), parent="H1", inertia=_carrier(p, 2, 0), shapes=carrier(p, 2))
    b.shaft("H2", {"H1": 1, far: 1})
    b.shaft("block_14", {"H1": 1, far: w1}, inertia=p.J14, shapes=block_14(p))
    b.shaft("block_36", {"H1": 1, far: w3}, inertia=p.J36, shapes=block_36(p))
    spins = (z3 * w3 - z1 * w1) / (2 * z2), (z6 * w3 - z4 * w1) / (2 * z5)
    b.shaft("planet_2_spin", {"H1": 1, far: spins[0]}, inertia=p.planets * p.J2)
    b.shaft("planet_5_spin", {"H1": 1, far: spins[1]}, inertia=p.planets * p.J5)


def _gears(b: Builder, p: Parameters, planets: int) -> None:
    (z1, z2, z3, z4, z5, z6), r1 = p.teeth, p.radii[0]
    b.body("block_14", revolute("block_14"), inertia=_disc(p.J14, p.J14 / r1**2), shapes=block_14(p))
    b.body("block_36", revolute("block_36"), inertia=_disc(p.J36, p.J36 / r1**2), shapes=block_36(p))
    for stage, (sun, pinion, ring) in ((1, (z1, z2, z3)), (2, (z4, z5, z6))):
        arm, kind = f"H{stage}", planet_name(stage)
        mass, spin = (p.m2, p.J2) if stage == 1 else (p.m5, p.J5)
        spin *= p.planets if planets == 1 else 1
        b.body(arm, revolute(arm), inertia=_carrier(p, stage, planets), shapes=carrier(p, stage))
        for k in range(planets):
            name = f"{kind}_{k + 1}"
            b.body(name, revolute(name), parent=arm, at=planet_axis(p, stage, k), inertia=_disc(spin, mass),
                   shapes=planet(p, stage, k))  # fmt: skip
            inner, outer = MESHES[2 * stage - 2 : 2 * stage]
            b.gears(f"{inner}_{k + 1}", "block_14", name, (sun, pinion), carrier=arm)
            b.gears(f"{outer}_{k + 1}", "block_36", name, (ring, pinion), carrier=arm, kind="internal")
        b.shaft(f"{kind}_spin", {arm: 1, f"{kind}_1": 1})
