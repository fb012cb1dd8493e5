"""A Wolfrom train 116:1: high ratio, much rolling power, poor efficiency. The `minimal` model is the exact reduction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np

from mechlab.analytic import wolfrom as closed_form
from mechlab.analytic.planetary_stage import conditions
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import Check, CheckResult, Entry, SceneRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit.epicyclic import (
    RATE,
    azimuth,
    constant_torques,
    disc,
    inertia_check,
    mesh_check,
    moving_check,
    moving_disc,
    neighbour_check,
    on_circle,
    seats,
    steady_recording,
    torque_check,
    train_state,
    wheel,
)
from mechlab.kit.mass_check import State
from mechlab.kit.palette import BLUE, BRASS, GREEN, RED, STEEL
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.parts import Shape
from mechlab.mechanism.reduction import Reduction, reduce
from mechlab.shapes import external_phase, internal_phase

Teeth = tuple[int, int, int, int, int]
"""Sun, planet 1, held ring, planet 2, output ring."""


def planet_turn(teeth: Teeth, planets: int, k: int) -> float:
    """Angle [rad] of planet k relative to planet 0 at which both its gears mesh; all planets are identical.

    Tries every tooth of the first mesh. Raises MechlabError when none fits the second: no identical planets assemble.
    """
    sun, first, _, second, ring = teeth
    start, a = external_phase(sun, 0.0, first, 0.0), azimuth(k, planets)
    pitch = 2.0 * math.pi / ring
    zero = internal_phase(second, 0.0, ring, 0.0)
    for j in range(first):
        turn = external_phase(sun, 0.0, first, a) - start + 2.0 * math.pi * j / first
        gap = (internal_phase(second, turn, ring, a) - zero) / pitch
        if abs(gap - round(gap)) < 1e-6:
            return turn
    raise MechlabError(
        f"wolfrom: teeth = {teeth}: planet {k + 1} of {planets} alike planets fits the held ring but not the output ring; "
        "choose ring_1 - ring_2 a multiple of the number of planets (planet gears of equal teeth)."
    )


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


WIDTH, GAP = 7.0, 2.0
"""Face width and the gap between the two planes of gears, in modules."""


def _planes(p: Parameters) -> tuple[float, float]:
    return 0.0, (WIDTH + GAP) * p.module


def _gear(p: Parameters, kind: str, color: tuple[float, float, float, float], name: str, k: int, teeth: int, phase: float,
          **size: float) -> Shape:  # fmt: skip
    module = p.module if k == 0 else p.second_module
    place = Placement((0.0, 0.0, _planes(p)[k]))
    return shape(kind, place, color, name, teeth=teeth, module=module, width=WIDTH * p.module, phase=phase, **size)


def sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Sun and its shaft."""
    m, z = p.module, p.teeth[0]
    shaft = shape("cylinder", Placement((0.0, 0.0, -14 * m)), BRASS, "shaft", radius=0.16 * m * z, length=24 * m)
    return _gear(p, "spur_gear", BRASS, "sun", 0, z, 0.0, bore=0.12 * m * z), shaft


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    """The two gears of planet k."""
    sun, first, _, second, _ = p.all_teeth
    turn = planet_turn(p.all_teeth, p.planets, k)
    bore = 0.09 * p.module * first
    return (
        _gear(p, "spur_gear", STEEL, "planet_gear_1", 0, first, external_phase(sun, 0.0, first, 0.0) + turn, bore=bore, holes=5),
        _gear(p, "spur_gear", STEEL, "planet_gear_2", 1, second, turn, bore=bore, holes=5),
    )  # fmt: skip


def held_ring(p: Parameters) -> Shape:
    """The ring that is fixed to the ground."""
    sun, first, ring, _, _ = p.all_teeth
    phase = internal_phase(first, external_phase(sun, 0.0, first, 0.0), ring, 0.0)
    return _gear(p, "internal_gear", BLUE, "held_ring", 0, ring, phase)


def ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    """The output ring."""
    _, _, _, second, ring = p.all_teeth
    return (_gear(p, "internal_gear", GREEN, "output_ring", 1, ring, internal_phase(second, 0.0, ring, 0.0)),)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m = p.module
    low = -(WIDTH + 1.0) * m
    out = [
        shape(
            "disc",
            Placement((0.0, 0.0, low)),
            RED,
            "hub",
            radius=0.35 * p.orbit,
            thickness=4 * m,
            bore=0.2 * m * p.teeth[0],
        )
    ]
    length = (2.0 * WIDTH + GAP + 6.0) * m
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        arm = Placement.of(axis_rotation((0, 0, 1.0), a), on_circle(0.3 * p.orbit, a, low))
        out.append(shape("link", arm, RED, f"arm_{k + 1}", length=0.7 * p.orbit, width=0.2 * p.orbit, thickness=4 * m,
                         bore=0.05 * p.orbit))  # fmt: skip
        pin = on_circle(p.orbit, a, low + 0.5 * length)
        out.append(shape("cylinder", Placement(pin), RED, f"pin_{k + 1}", radius=0.088 * m * p.teeth[1], length=length))
    return tuple(out)


def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: one coordinate (the carrier), all gears as shafts. parts: one planet stands for all. full: every planet."""
    if fidelity == "minimal":
        return reduction(p).mechanism
    if fidelity not in ("parts", "full"):
        raise unknown("wolfrom: fidelity", fidelity, ("minimal", "parts", "full"))
    return _gears(p, 1 if fidelity == "parts" else p.planets)


@lru_cache(maxsize=32)
def reduction(p: Parameters) -> Reduction:
    """The exact reduction of the full train."""
    return reduce(_gears(p, p.planets), ("carrier",))


@lru_cache(maxsize=32)
def _gears(p: Parameters, planets: int) -> Mechanism:
    b = Builder("wolfrom", gravity=(0.0, 0.0, 0.0), summary=f"Wolfrom train {p.ratio}:1")
    sun, first, ring, second, output = p.all_teeth
    m = p.module
    b.ground(held_ring(p))
    b.body("sun", revolute("sun"), inertia=disc(p.J_sun, 0.5 * m * sun), shapes=sun_shapes(p))
    orbiting = (p.planets - planets) * p.planet_mass * p.orbit**2
    b.body("carrier", revolute("carrier"), inertia=disc(p.J_carrier + orbiting, p.orbit), shapes=carrier_shapes(p))
    b.body("ring", revolute("ring"), inertia=disc(p.J_ring, 0.5 * m * ring), shapes=ring_shapes(p))
    for k in range(planets):
        a, name = azimuth(k, p.planets), f"planet_{k + 1}"
        spin = p.J_planet * (p.planets if planets == 1 else 1)
        b.body(name, revolute(name), parent="carrier", at=on_circle(p.orbit, a),
               inertia=Inertia.axial(p.planet_mass, spin, 0.5 * spin), shapes=planet_shapes(p, k))  # fmt: skip
        b.gears(f"sun_{name}", "sun", name, (sun, first), carrier="carrier")
        b.relation(f"held_ring_{name}", **{"carrier": 1, name: Fraction(first, ring)})
        b.gears(f"ring_{name}", "ring", name, (output, second), carrier="carrier", kind="internal")
    b.drive("sun", stiffness=5.0, damping=0.05)
    b.drive("ring", damping=1.0)
    return b.build()


def scene(p: Parameters, fidelity: str) -> Scene:
    """Constant torques on sun and output ring."""
    return constant_torques(fidelity, {"sun": p.sun_torque, "ring": p.ring_torque})


def inertia_at_sun(p: Parameters) -> float:
    """Inertia of the whole train reduced to the sun [kg m2]."""
    orbit = p.planet_mass * p.orbit**2
    return closed_form.reflected_inertia(p.all_teeth, p.planets, p.J_sun, p.J_ring, p.J_carrier, p.J_planet, orbit)


def carrier_acceleration(p: Parameters) -> float:
    """Acceleration of the carrier under the two torques, without losses [rad/s2], in closed form."""
    w = closed_form.speeds(p.all_teeth)
    return (p.sun_torque + p.ring_torque * float(w.ring / w.sun)) / inertia_at_sun(p) / float(w.sun)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant acceleration in closed form."""
    return steady_recording(build(p, "minimal"), {"carrier": carrier_acceleration(p)}, scene)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All parts along a recording of any fidelity, from the carrier by exact ratios."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    return full, reduction(p).basis.angles(recording.channel("carrier")[:, None])


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE, a flat disc of the radius of the planet axes. In `parts` one planet turns for all, the others
    ride on the carrier; in `minimal` all ride on it, with their mass, and all wheels turn as shafts, the planets on one."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    sun, _, ring, _, _ = p.all_teeth
    found = closed_form.speeds(p.all_teeth)
    w = {"sun": float(found.sun), "ring": float(found.ring)}
    spin = float(found.planet)
    turns = {"carrier": 1.0, **w} | {f"planet_{k + 1}": spin - 1.0 for k in range(rays or p.planets)}
    if not rays:
        rotors = p.J_sun * w["sun"] ** 2 + p.J_ring * w["ring"] ** 2 + p.planets * p.J_planet * spin**2
        turns["planet_1_spin"] = spin
        riding = p.planets * p.planet_mass
        carrier = wheel(2.0 * p.J_carrier / p.orbit**2 + riding, p.J_carrier + riding * p.orbit**2, RATE)
        return train_state(turns, carrier, rotors)
    parts = moving_disc(p.J_carrier + (p.planets - rays) * p.planet_mass * p.orbit**2, p.orbit, RATE)
    parts = parts + moving_disc(p.J_sun, 0.5 * p.module * sun, w["sun"] * RATE)
    parts = parts + moving_disc(p.J_ring, 0.5 * p.module * ring, w["ring"] * RATE)
    moment = p.J_planet * (p.planets if rays == 1 else 1)
    for at in seats(p.orbit, p.planets)[:rays]:
        parts = parts + wheel(p.planet_mass, moment, spin * RATE, at, RATE)
    return train_state(turns, parts)


MOVING = (moving_check("W5", build, state), mesh_check("W6", build, meshes=3, wheels=1))


def _speeds(p: Parameters) -> CheckResult:
    w = closed_form.speeds(p.all_teeth)
    names = ("carrier_rate", "ring_rate", "planet_1_rate")
    expected = np.array([1.0, float(w.ring), float(w.planet) - 1.0]) / float(w.sun) * 100.0
    measured = {}
    for fidelity in ("parts", "full"):
        for engine in ("pinocchio", "mujoco"):
            answer = engine_answer(engine, build(p, fidelity), {"sun_rate": 100.0}, names)
            measured[f"{engine} {fidelity}"] = [answer.values[n] for n in names]
    return CheckResult(
        measured, 1e-9, expected, "rates of carrier, output and planet in carrier at 100 rad/s of the sun"
    )


CHECKS = (
    Check("W1", "speeds of all members from two engines against Willis", _speeds, "Willis equation"),
    inertia_check(
        "W2",
        "inertia of each fidelity against the closed form",
        build,
        ("carrier",),
        lambda p: inertia_at_sun(p) * float(closed_form.speeds(p.all_teeth).sun) ** 2,
        "inertia seen at the carrier, relative to the closed form",
    ),
    torque_check(
        "W3", build, scene, "sun", lambda p: carrier_acceleration(p) * float(closed_form.speeds(p.all_teeth).sun), True
    ),
    neighbour_check("W4", build),
    *MOVING,
)

ENTRY = Entry(
    name="wolfrom",
    title="Wolfrom train",
    summary="A sun, stepped planets, a held and a turning ring: 116:1 in one stage, and what that costs in efficiency.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "Willis equation",
        "minimal": "exact reduction: one coordinate, all gears as shafts",
        "parts": "one planet that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    },
    default_fidelity="minimal",
    scenes={"constant-torques": SceneRecipe(scene, "minimal", "constant torques on sun and output ring from rest")},
    default_scene="constant-torques",
    checks=CHECKS,
    reference=reference,
    expand=expand,
    chain="3K epicyclic (Wolfrom)",
    formulas="w_sun / w_ring = (1 + z_r1 / z_s) / (1 - z_r1 z_p2 / (z_p1 z_r2)).",
    sources=("Wolfrom 1912", "Mueller 1998, Die Umlaufgetriebe"),
)
