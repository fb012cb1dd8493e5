"""A simple planetary stage: sun, planets on a carrier, ring. Gears on a moving carrier, in three fidelities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from mechlab.analytic import planetary_stage as closed_form
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import Check, CheckResult, Entry, SceneRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.question import Answer
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit.epicyclic import (
    RATE,
    azimuth,
    constant_torques,
    disc,
    engine_speeds,
    expand_by,
    inertia_check,
    measured_speeds,
    mesh_check,
    moving_check,
    moving_disc,
    neighbour_check,
    on_circle,
    seats,
    speed_question,
    steady_recording,
    torque_check,
    train_state,
    wheel,
)
from mechlab.kit.mass_check import NOTHING, State
from mechlab.kit.palette import BLUE, BRASS, RED, STEEL
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase, internal_phase


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


def sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Sun and its shaft."""
    m, z = p.module, p.teeth[0]
    return (
        shape("spur_gear", color=BRASS, name="sun", teeth=z, module=m, width=8 * m, bore=0.12 * m * z, phase=0.0),
        shape("cylinder", Placement((0.0, 0.0, 8 * m)), BRASS, "shaft", radius=0.12 * m * z, length=24 * m),
    )


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    """Planet k, in phase with the sun."""
    m, (sun, planet, _) = p.module, p.teeth
    return (
        shape("spur_gear", color=STEEL, name="planet", teeth=planet, module=m, width=8 * m, bore=0.09 * m * planet,
              phase=external_phase(sun, 0.0, planet, azimuth(k, p.planets)), holes=5),
    )  # fmt: skip


def ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    """The ring, in phase with the planets."""
    m, (sun, planet, ring) = p.module, p.teeth
    phase = internal_phase(planet, external_phase(sun, 0.0, planet, 0.0), ring, 0.0)
    return (shape("internal_gear", color=BLUE, name="ring", teeth=ring, module=m, width=8 * m, phase=phase),)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m = p.module
    out = [shape("disc", Placement((0.0, 0.0, -8 * m)), RED, "hub", radius=0.35 * p.orbit, thickness=4 * m)]
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        arm = Placement.of(axis_rotation((0, 0, 1.0), a), (0.0, 0.0, -8 * m))
        out.append(
            shape(
                "link",
                arm,
                RED,
                f"arm_{k + 1}",
                length=p.orbit,
                width=0.2 * p.orbit,
                thickness=4 * m,
                bore=0.05 * p.orbit,
            )
        )
        pin = on_circle(p.orbit, a, -1.5 * m)
        out.append(shape("cylinder", Placement(pin), RED, f"pin_{k + 1}", radius=0.09 * m * p.teeth[1], length=14 * m))
    return tuple(out)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: as many coordinates as freedoms, no rows. parts: one planet. full: all planets, redundant rows."""
    b = Builder("planetary_stage", gravity=(0.0, 0.0, 0.0), summary="simple planetary stage")
    if fidelity == "minimal":
        _minimal(b, p)
    elif fidelity in ("parts", "full"):
        _gears(b, p, 1 if fidelity == "parts" else p.planets)
    else:
        raise unknown("planetary_stage: fidelity", fidelity, ("minimal", "parts", "full"))
    b.drive("sun", stiffness=50.0, damping=0.2)
    if p.ring == "free":
        b.drive("carrier", stiffness=50.0, damping=0.2)
    return b.build()


def _carrier_inertia(p: Parameters, carried: int) -> Inertia:
    """Inertia of the carrier. `carried` planets are bodies; the others count as point masses on their orbit."""
    orbiting = (p.planets - carried) * p.planet_mass * p.orbit**2
    return disc(p.J_carrier + orbiting, p.orbit)


def _minimal(b: Builder, p: Parameters) -> None:
    sun, planet, ring = p.teeth
    shapes = carrier_shapes(p)
    b.body("carrier", revolute("carrier"), inertia=_carrier_inertia(p, 0), shapes=shapes)
    if p.ring == "held":
        b.shaft("sun", {"carrier": 1 + Fraction(ring, sun)}, inertia=p.J_sun, shapes=sun_shapes(p))
        spin: dict[str, object] = {"carrier": 1 - Fraction(ring, planet)}
        turn: dict[str, object] = {"carrier": -Fraction(ring, planet)}
        b.ground(*ring_shapes(p))
    else:
        b.body(
            "sun",
            revolute("sun_on_carrier"),
            parent="carrier",
            inertia=disc(p.J_sun, 0.5 * p.module * sun),
            shapes=sun_shapes(p),
        )
        b.shaft("sun", {"carrier": 1, "sun_on_carrier": 1})
        b.shaft("ring", {"carrier": 1, "sun_on_carrier": -Fraction(sun, ring)}, inertia=p.J_ring, shapes=ring_shapes(p))
        spin = {"carrier": 1, "sun_on_carrier": -Fraction(sun, planet)}
        turn = {"sun_on_carrier": -Fraction(sun, planet)}
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        place = Placement(on_circle(p.orbit, a))
        b.shaft(f"planet_{k + 1}_spin", spin, inertia=p.J_planet)
        b.shaft(f"planet_{k + 1}", turn, body="carrier", placement=place, shapes=planet_shapes(p, k))


def _gears(b: Builder, p: Parameters, planets: int) -> None:
    sun, planet, ring = p.teeth
    b.body("sun", revolute("sun"), inertia=disc(p.J_sun, 0.5 * p.module * sun), shapes=sun_shapes(p))
    carrier = _carrier_inertia(p, planets)
    b.body("carrier", revolute("carrier"), inertia=carrier, shapes=carrier_shapes(p))
    if p.ring == "free":
        b.body("ring", revolute("ring"), inertia=disc(p.J_ring, 0.5 * p.module * ring), shapes=ring_shapes(p))
    else:
        b.ground(*ring_shapes(p))
    for k in range(planets):
        a, name = azimuth(k, p.planets), f"planet_{k + 1}"
        spin = p.J_planet * (p.planets if planets == 1 else 1)
        b.body(name, revolute(name), parent="carrier", at=on_circle(p.orbit, a),
               inertia=Inertia.axial(p.planet_mass, spin, 0.5 * spin), shapes=planet_shapes(p, k))  # fmt: skip
        b.gears(f"sun_{name}", "sun", name, (sun, planet), carrier="carrier")
        if p.ring == "free":
            b.gears(f"ring_{name}", "ring", name, (ring, planet), carrier="carrier", kind="internal")
        else:
            b.relation(f"ring_{name}", **{"carrier": 1, name: Fraction(planet, ring)})


SPEEDS = ("sun_rate", "ring_rate", "carrier_rate")


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    known = {k.removesuffix("_rate"): given[k] for k in SPEEDS if k in given}
    found = closed_form.speeds(p.teeth[0], p.teeth[2], planet_teeth=p.teeth[1], **known)
    values = {f"{n}_rate": getattr(found, n) for n in ("sun", "ring", "carrier", "planet")}
    return Answer({k: v for k, v in values.items() if k not in given})


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    """The speeds by a model with a free ring, of which a held ring is a special case."""
    free = build(replace(p, ring="free"), "parts")
    return engine_speeds(engine, free, given, SPEEDS, {"planet_rate": "planet_1"})


QUESTIONS = tuple(
    speed_question(pair, (*SPEEDS, "planet_rate"), _analytic, _engine) for pair in combinations(SPEEDS, 2)
)


def scene(p: Parameters, fidelity: str) -> Scene:
    """Constant torques on sun and carrier."""
    return constant_torques(fidelity, {"sun": p.sun_torque, "carrier": p.carrier_torque})


def accelerations(p: Parameters) -> closed_form.StageAccelerations:
    """Accelerations [rad/s2] of all members under the torques of the scene, ring held or free."""
    if p.ring == "held":
        return closed_form.held_ring_accelerations(p.stage, p.sun_torque, p.carrier_torque)
    return closed_form.free_accelerations(p.stage, p.sun_torque, p.carrier_torque)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant accelerations in closed form."""
    found = accelerations(p)
    by_joint = {"carrier": float(found.carrier), "sun_on_carrier": float(found.sun - found.carrier)}
    return steady_recording(build(p, "minimal"), by_joint, scene)


def _angles(p: Parameters, recording: Recording) -> dict[str, Array]:
    sun, carrier = recording.channel("sun"), recording.channel("carrier")
    ratio = p.teeth[0] / p.teeth[1]
    values = {"sun": sun, "carrier": carrier, "ring": carrier - p.teeth[0] / p.teeth[2] * (sun - carrier)}
    return values | {f"planet_{k + 1}": -ratio * (sun - carrier) for k in range(p.planets)}


RING = 0.4
"""Speed of a free ring over that of the carrier."""


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE, a free ring at RING of that. Planets that are no bodies ride on the carrier, a flat disc of
    the radius of their axes; in `parts` one planet turns for all."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    free = p.ring == "free"
    sun, planet, ring = p.teeth
    found = closed_form.speeds(sun, ring, carrier=1.0, ring=RING if free else 0.0, planet_teeth=planet)
    w = {"carrier": 1.0, "sun": float(found.sun), "planet": float(found.planet), "ring": float(found.ring)}
    parts = moving_disc(p.J_carrier + (p.planets - rays) * p.planet_mass * p.orbit**2, p.orbit, RATE)
    moment = p.J_planet * (p.planets if rays == 1 else 1)
    places = seats(p.orbit, p.planets)[:rays]
    parts = sum((wheel(p.planet_mass, moment, w["planet"] * RATE, at, RATE) for at in places), NOTHING) + parts
    turns = {n: w[n] for n in (("carrier", "sun", "ring") if free else ("carrier", "sun"))}
    turns |= {f"planet_{k + 1}": w["planet"] - 1.0 for k in range(rays or p.planets)}
    rotors = 0.0
    if rays or free:  # in `minimal` a free sun is the second body
        parts = parts + moving_disc(p.J_sun, 0.5 * p.module * sun, w["sun"] * RATE)
    else:
        rotors += p.J_sun * w["sun"] ** 2
    if rays and free:
        parts = parts + moving_disc(p.J_ring, 0.5 * p.module * ring, w["ring"] * RATE)
    if not rays:
        rotors += p.planets * p.J_planet * w["planet"] ** 2 + (p.J_ring * w["ring"] ** 2 if free else 0.0)
        turns |= {f"planet_{k + 1}_spin": w["planet"] for k in range(p.planets)} | {"sun_on_carrier": w["sun"] - 1.0}
    return train_state(turns, parts, rotors, freedoms=2 if free else 1)


MOVING = (moving_check("P6", build, state), mesh_check("P7", build, meshes=2, wheels=1))


def _speeds(p: Parameters) -> CheckResult:
    note = "all members from each pair of speeds, Willis against constraint Jacobians"
    return measured_speeds(p, QUESTIONS, (37.0, -5.0), 1e-9, note)


def _held(p: Parameters) -> CheckResult:
    """With its holding torque applied, a free ring stays at rest and the sun accelerates as with the ring held."""
    held = closed_form.held_ring_accelerations(p.stage, p.sun_torque, p.carrier_torque)
    free = closed_form.free_accelerations(p.stage, p.sun_torque, p.carrier_torque, held.ring_torque)
    scale = max(abs(float(held.sun)), 1.0)
    measured, expected = (
        [float(x) / scale for x in (a.ring, a.sun, a.carrier, a.planet, a.ring_torque)]
        for a in (free, replace(held, ring=np.zeros(())))
    )
    return CheckResult({"free ring": measured}, 1e-12, expected, "ring, sun, carrier, planet, torque; relative")


CHECKS = (
    Check("P1", "speeds of all members from three witnesses", _speeds, "Willis equation"),
    inertia_check(
        "P2",
        "mass matrix of each fidelity against the closed form",
        build,
        ("sun", "carrier"),
        lambda p: closed_form.mass_matrix(p.stage),
        "mass matrix in (sun, carrier), ring free, relative",
        lambda p: replace(p, ring="free"),
    ),
    torque_check("P3", build, scene, "sun", lambda p: float(accelerations(p).sun)),
    neighbour_check("P4", build),
    Check("P5", "torque that holds the ring", _held, "Lagrange with the ring free"),
    *MOVING,
)

ENTRY = Entry(
    name="planetary_stage",
    title="Planetary stage",
    summary="Sun, planets on a moving carrier and ring: gears as exact linear relations.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "Willis equation",
        "minimal": "as many coordinates as freedoms, all other gears as shafts",
        "parts": "one planet that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    },
    default_fidelity="minimal",
    scenes={"constant-torques": SceneRecipe(scene, "minimal", "constant torques on sun and carrier from rest")},
    default_scene="constant-torques",
    questions=QUESTIONS,
    checks=CHECKS,
    reference=reference,
    expand=expand_by(build, _angles),
    chain="2K-H epicyclic",
    formulas="Willis: z_sun (w_sun - w_carrier) = -z_ring (w_ring - w_carrier);\n"
    "z_planet (w_planet - w_carrier) = -z_sun (w_sun - w_carrier).",
    sources=("Willis 1841",),
)
