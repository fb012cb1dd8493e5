"""A simple planetary stage: sun, planets on a carrier, ring. Gears on a moving carrier, in three fidelities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from mechlab.analytic import planetary_stage as closed_form
from mechlab.errors import unknown
from mechlab.experiment.entry import Check, CheckResult, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.kit import epicyclic_build as parts
from mechlab.kit import epicyclic_teeth as meshing
from mechlab.kit.epicyclic_checks import inertia_check, mesh_check, neighbour_check, speeds_check, torque_check
from mechlab.kit.epicyclic_mass import CentralWheel, moving_carrier, moving_check, train_state
from mechlab.kit.epicyclic_motion import ConstantTorques, expand_by, speed_questions
from mechlab.kit.mass_check import State
from mechlab.kit.palette import BLUE, RED, STEEL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase


@dataclass(frozen=True)
class Parameters(parts.OnePlanetCircle):
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
        name = "planetary_stage"
        meshing.require_common_axes(f"{name}: teeth = {sun}, {planet}, {ring}", sun, planet, ring, self.planets)
        spacing = f"(sun + ring) / planets = {sun + ring}/{self.planets} is not whole"
        meshing.require_equal_angles(name, self.planets, sun + ring, spacing)
        meshing.require_room(name, sun, planet, ring, self.planets)

    @property
    def stage(self) -> closed_form.PlanetaryStage:
        """The same stage for the closed form."""
        (sun, planet, ring), n = self.teeth, self.planets
        inertias = (self.J_sun, self.J_planet, self.J_ring, self.J_carrier, self.planet_mass)
        return closed_form.PlanetaryStage(sun, planet, ring, n, *inertias, self.orbit)


def sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Sun and its shaft."""
    m, z = p.module, p.teeth[0]
    return parts.sun_on_shaft(z, m, 8 * m, radius=0.12 * m * z, middle=8 * m)


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    """Planet k, in phase with the sun."""
    m, (sun, planet, _) = p.module, p.teeth
    phase = external_phase(sun, 0.0, planet, p.planet_set.angles[k])
    return (parts.gear("planet", STEEL, planet, m, 8 * m, phase, bore=0.09 * m * planet, holes=5),)


def ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    """The ring, in phase with the planets."""
    m, ring = p.module, p.teeth[2]
    return (parts.gear("ring", BLUE, ring, m, 8 * m, meshing.ring_phase(*p.teeth), kind="internal_gear"),)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m, r = p.module, p.orbit
    hub = shape("disc", Placement((0.0, 0.0, -8 * m)), RED, "hub", radius=0.35 * r, thickness=4 * m)
    arm = parts.Arm(start=0.0, length=r, height=-8 * m, width=0.2 * r, thickness=4 * m, bore=0.05 * r)
    pin = parts.Pin(r, middle=-1.5 * m, radius=0.09 * m * p.teeth[1], length=14 * m)
    return hub, *parts.arms_and_pins(p.planet_set.angles, arm, [pin])


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: as many coordinates as freedoms, no rows. parts: one planet. full: all planets, redundant rows."""
    bodies = parts.planet_bodies("planetary_stage", fidelity, p.planets)
    b = Builder("planetary_stage", gravity=(0.0, 0.0, 0.0), summary="simple planetary stage")
    if bodies:
        _gears(b, p, bodies)
    else:
        _minimal(b, p)
    b.drive("sun", stiffness=50.0, damping=0.2)
    if p.ring == "free":
        b.drive("carrier", stiffness=50.0, damping=0.2)
    return b.build()


def _minimal(b: Builder, p: Parameters) -> None:
    (sun, planet, ring), planets = p.teeth, p.planet_set
    parts.add_carrier(b, p.J_carrier, p.orbit, [planets], 0, carrier_shapes(p))
    if p.ring == "held":
        b.shaft("sun", {"carrier": 1 + Fraction(ring, sun)}, inertia=p.J_sun, shapes=sun_shapes(p))
        b.ground(*ring_shapes(p))
        turn = {"carrier": -Fraction(ring, planet)}
    else:
        sun_inertia = parts.disc(p.J_sun, 0.5 * p.module * sun)
        b.body("sun", revolute("sun_on_carrier"), parent="carrier", inertia=sun_inertia, shapes=sun_shapes(p))
        b.shaft("sun", {"carrier": 1, "sun_on_carrier": 1})
        b.shaft("ring", {"carrier": 1, "sun_on_carrier": -Fraction(sun, ring)}, inertia=p.J_ring, shapes=ring_shapes(p))
        turn = {"sun_on_carrier": -Fraction(sun, planet)}
    for k in range(p.planets):
        planets.add_shafts(b, k, turn, planet_shapes(p, k))


def _gears(b: Builder, p: Parameters, bodies: int) -> None:
    (sun, planet, ring), planets = p.teeth, p.planet_set
    b.body("sun", revolute("sun"), inertia=parts.disc(p.J_sun, 0.5 * p.module * sun), shapes=sun_shapes(p))
    parts.add_carrier(b, p.J_carrier, p.orbit, [planets], bodies, carrier_shapes(p))
    if p.ring == "free":
        b.body("ring", revolute("ring"), inertia=parts.disc(p.J_ring, 0.5 * p.module * ring), shapes=ring_shapes(p))
    else:
        b.ground(*ring_shapes(p))
    for k in range(bodies):
        name = planets.add_body(b, k, bodies, planet_shapes(p, k))
        b.gears(f"sun_{name}", "sun", name, (sun, planet), carrier="carrier")
        if p.ring == "free":
            b.gears(f"ring_{name}", "ring", name, (ring, planet), carrier="carrier", kind="internal")
        else:
            b.relation(f"ring_{name}", **{"carrier": 1, name: Fraction(planet, ring)})


SPEEDS = ("sun_rate", "ring_rate", "carrier_rate")


def _speeds(p: Parameters, given: Mapping[str, Any]) -> dict[str, Any]:
    known = {k.removesuffix("_rate"): given[k] for k in SPEEDS if k in given}
    found = closed_form.speeds(p.teeth[0], p.teeth[2], planet_teeth=p.teeth[1], **known)
    return {f"{n}_rate": getattr(found, n) for n in ("sun", "ring", "carrier", "planet")}


def _free_ring(p: Parameters) -> Mechanism:
    """The model with a free ring, of which a held ring is a special case."""
    return build(replace(p, ring="free"), "parts")


PAIRS = combinations(SPEEDS, 2)
QUESTIONS = speed_questions(PAIRS, (*SPEEDS, "planet_rate"), {"planet_rate": "planet_1"}, _speeds, _free_ring)


def accelerations(p: Parameters) -> closed_form.StageAccelerations:
    """Accelerations [rad/s2] of all members under the torques of the scene, ring held or free."""
    if p.ring == "held":
        return closed_form.held_ring_accelerations(p.stage, p.sun_torque, p.carrier_torque)
    return closed_form.free_accelerations(p.stage, p.sun_torque, p.carrier_torque)


def joint_accelerations(p: Parameters) -> dict[str, float]:
    """Accelerations [rad/s2] of the joints of the minimal model."""
    found = accelerations(p)
    return {"carrier": float(found.carrier), "sun_on_carrier": float(found.sun - found.carrier)}


TORQUES = {"sun": "sun_torque", "carrier": "carrier_torque"}
MOTION = ConstantTorques(build, "sun and carrier", TORQUES, joint_accelerations)


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
    bodies = parts.planet_bodies("planetary_stage", fidelity, p.planets)
    free = p.ring == "free"
    sun, planet, ring = p.teeth
    w = closed_form.speeds(sun, ring, carrier=1.0, ring=RING if free else 0.0, planet_teeth=planet)
    # In `minimal` a free sun is the second body.
    wheels = {"sun": CentralWheel(p.J_sun, 0.5 * p.module * sun, float(w.sun), is_body=bool(bodies) or free)}
    if free:
        wheels["ring"] = CentralWheel(p.J_ring, 0.5 * p.module * ring, float(w.ring), is_body=bool(bodies))
    carrier = moving_carrier(p.J_carrier, p.orbit, [p.planet_set], bodies)
    planets = {p.planet_set: float(w.planet)}
    relative = {"sun_on_carrier": float(w.sun) - 1.0}
    return train_state(carrier, wheels, planets, bodies, freedoms=2 if free else 1, joints=relative)


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


WILLIS = "all members from each pair of speeds, Willis against constraint Jacobians"
CHECKS = (
    speeds_check("P1", QUESTIONS, (37.0, -5.0), WILLIS, lambda p: 1e-9),
    inertia_check(
        "P2",
        build,
        ("sun", "carrier"),
        lambda p: closed_form.mass_matrix(p.stage),
        "mass matrix in (sun, carrier), ring free, relative",
        "mass matrix of each fidelity against the closed form",
        change=lambda p: replace(p, ring="free"),
    ),
    torque_check("P3", MOTION, "sun", lambda p: float(accelerations(p).sun)),
    neighbour_check("P4", build),
    Check("P5", "torque that holds the ring", _held, "Lagrange with the ring free"),
    moving_check("P6", build, state),
    mesh_check("P7", build, meshes=2, wheels=1),
)

ENTRY = MOTION.entry(
    minimal="as many coordinates as freedoms, all other gears as shafts",
    name="planetary_stage",
    title="Planetary stage",
    family="gear-train",
    summary="Sun, planets on a moving carrier and ring: gears as exact linear relations.",
    plots=(
        PlotRecipe("input and output speed", ("sun_rate", "carrier_rate")),
        PlotRecipe("transmission ratio", ("sun_rate",), over="carrier_rate"),
        PlotRecipe("input and output angle", ("sun", "carrier")),
    ),
    parameters=Parameters,
    questions=QUESTIONS,
    checks=CHECKS,
    expand=expand_by(build, _angles),
    chain="2K-H epicyclic",
    formulas="Willis: z_sun (w_sun - w_carrier) = -z_ring (w_ring - w_carrier);\n"
    "z_planet (w_planet - w_carrier) = -z_sun (w_sun - w_carrier).",
    sources=("Willis 1841",),
)
