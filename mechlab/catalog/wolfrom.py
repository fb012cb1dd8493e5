"""A Wolfrom train 116:1: high ratio, much rolling power, poor efficiency. The `minimal` model is the exact reduction."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import wolfrom as closed_form
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Check, CheckResult, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.kit import epicyclic_build as parts
from mechlab.kit import epicyclic_teeth as meshing
from mechlab.kit.epicyclic_checks import inertia_check, mesh_check, neighbour_check, torque_check
from mechlab.kit.epicyclic_mass import RATE, CentralWheel, moving_carrier, moving_check, train_state, wheel
from mechlab.kit.epicyclic_motion import ConstantTorques
from mechlab.kit.mass_check import State
from mechlab.kit.palette import BLUE, GREEN, RED, STEEL
from mechlab.kit.witness import engine_answer
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Color, Shape
from mechlab.mechanism.reduction import Reduction, reduce
from mechlab.shapes import external_phase, internal_phase

Teeth = tuple[int, int, int, int, int]
"""Sun, planet 1, held ring, planet 2, output ring."""


@dataclass(frozen=True)
class Parameters(parts.OnePlanetCircle):
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
        what = f"wolfrom: teeth = {self.teeth}"
        meshing.require_common_axes(what, sun, planet, ring, self.planets, "held ring")
        if output <= second:
            raise MechlabError(f"{what}: the output ring must have more teeth than planet 2 ({second}).")
        spacing = f"(sun + ring) / planets = {sun + ring}/{self.planets}"
        meshing.require_equal_angles("wolfrom", self.planets, sun + ring, spacing)
        meshing.require_room("wolfrom", sun, planet, ring, self.planets)
        for k in range(self.planets):
            self.planet_turn(k)

    def planet_turn(self, k: int) -> float:
        """Angle [rad] of planet k relative to planet 0 at which both its gears mesh."""
        sun, first, _, second, output = self.all_teeth
        return meshing.stepped_planet_turn(
            f"wolfrom: teeth = {self.teeth}", (sun, first, second, output), self.planets, k
        )

    @property
    def all_teeth(self) -> Teeth:
        """The five tooth counts."""
        a, b, c, d, e = self.teeth
        return a, b, c, d, e

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


def _gear(p: Parameters, plane: int, name: str, color: Color, z: int, phase: float, **more: Any) -> Shape:
    """A gear of z teeth in plane 0 (sun, planet 1, held ring) or plane 1 (planet 2, output ring)."""
    module = (p.module, p.second_module)[plane]
    return parts.gear(name, color, z, module, WIDTH * p.module, phase, plane * (WIDTH + GAP) * p.module, **more)


def sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Sun and its shaft."""
    m, z = p.module, p.teeth[0]
    return parts.sun_on_shaft(z, m, WIDTH * m, radius=0.16 * m * z, middle=-14 * m)


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    """The two gears of planet k."""
    sun, first, _, second, _ = p.all_teeth
    turn, bore = p.planet_turn(k), 0.09 * p.module * first
    phase = external_phase(sun, 0.0, first, 0.0) + turn
    return (
        _gear(p, 0, "planet_gear_1", STEEL, first, phase, bore=bore, holes=5),
        _gear(p, 1, "planet_gear_2", STEEL, second, turn, bore=bore, holes=5),
    )


def held_ring(p: Parameters) -> Shape:
    """The ring that is fixed to the ground."""
    sun, first, ring, _, _ = p.all_teeth
    return _gear(p, 0, "held_ring", BLUE, ring, meshing.ring_phase(sun, first, ring), kind="internal_gear")


def ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    """The output ring."""
    _, _, _, second, ring = p.all_teeth
    phase = internal_phase(second, 0.0, ring, 0.0)
    return (_gear(p, 1, "output_ring", GREEN, ring, phase, kind="internal_gear"),)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m, r = p.module, p.orbit
    low, length = -(WIDTH + 1.0) * m, (2.0 * WIDTH + GAP + 6.0) * m
    place, bore = Placement((0.0, 0.0, low)), 0.2 * m * p.teeth[0]
    hub = shape("disc", place, RED, "hub", radius=0.35 * r, thickness=4 * m, bore=bore)
    arm = parts.Arm(start=0.3 * r, length=0.7 * r, height=low, width=0.2 * r, thickness=4 * m, bore=0.05 * r)
    pin = parts.Pin(r, middle=low + 0.5 * length, radius=0.088 * m * p.teeth[1], length=length)
    return hub, *parts.arms_and_pins(p.planet_set.angles, arm, [pin])


def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: one coordinate (the carrier), all gears as shafts. parts: one planet stands for all. full: every planet."""
    bodies = parts.planet_bodies("wolfrom", fidelity, p.planets)
    return _gears(p, bodies) if bodies else reduction(p).mechanism


@lru_cache(maxsize=32)
def reduction(p: Parameters) -> Reduction:
    """The exact reduction of the full train."""
    return reduce(_gears(p, p.planets), ("carrier",))


@lru_cache(maxsize=32)
def _gears(p: Parameters, bodies: int) -> Mechanism:
    b = Builder("wolfrom", gravity=(0.0, 0.0, 0.0), summary=f"Wolfrom train {p.ratio}:1")
    (sun, first, ring, second, output), m, planets = p.all_teeth, p.module, p.planet_set
    b.ground(held_ring(p))
    b.body("sun", revolute("sun"), inertia=parts.disc(p.J_sun, 0.5 * m * sun), shapes=sun_shapes(p))
    parts.add_carrier(b, p.J_carrier, p.orbit, [planets], bodies, carrier_shapes(p))
    b.body("ring", revolute("ring"), inertia=parts.disc(p.J_ring, 0.5 * m * ring), shapes=ring_shapes(p))
    for k in range(bodies):
        name = planets.add_body(b, k, bodies, planet_shapes(p, k))
        b.gears(f"sun_{name}", "sun", name, (sun, first), carrier="carrier")
        b.relation(f"held_ring_{name}", **{"carrier": 1, name: Fraction(first, ring)})
        b.gears(f"ring_{name}", "ring", name, (output, second), carrier="carrier", kind="internal")
    b.drive("sun", stiffness=5.0, damping=0.05)
    b.drive("ring", damping=1.0)
    return b.build()


def inertia_at_sun(p: Parameters) -> float:
    """Inertia of the whole train reduced to the sun [kg m2]."""
    orbit = p.planet_mass * p.orbit**2
    return closed_form.reflected_inertia(p.all_teeth, p.planets, p.J_sun, p.J_ring, p.J_carrier, p.J_planet, orbit)


def inertia_at_carrier(p: Parameters) -> float:
    """Inertia of the whole train reduced to the carrier [kg m2]."""
    return inertia_at_sun(p) * float(closed_form.speeds(p.all_teeth).sun) ** 2


def carrier_acceleration(p: Parameters) -> float:
    """Acceleration of the carrier under the two torques, without losses [rad/s2], in closed form."""
    w = closed_form.speeds(p.all_teeth)
    return (p.sun_torque + p.ring_torque * float(w.ring / w.sun)) / inertia_at_sun(p) / float(w.sun)


def sun_acceleration(p: Parameters) -> float:
    """Acceleration of the sun under the two torques [rad/s2]."""
    return carrier_acceleration(p) * float(closed_form.speeds(p.all_teeth).sun)


def _accelerations(p: Parameters) -> dict[str, float]:
    return {"carrier": carrier_acceleration(p)}


TORQUES = {"sun": "sun_torque", "ring": "ring_torque"}
MOTION = ConstantTorques(build, "sun and output ring", TORQUES, _accelerations)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All parts along a recording of any fidelity, from the carrier by exact ratios."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    return full, reduction(p).basis.angles(recording.channel("carrier")[:, None])


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE, a flat disc of the radius of the planet axes. In `parts` one planet turns for all, the others
    ride on the carrier; in `minimal` all ride on it, with their mass, and all wheels turn as shafts, the planets on one."""
    bodies = parts.planet_bodies("wolfrom", fidelity, p.planets)
    sun, _, ring, _, _ = p.all_teeth
    w = closed_form.speeds(p.all_teeth)
    wheels = {
        "sun": CentralWheel(p.J_sun, 0.5 * p.module * sun, float(w.sun), is_body=bool(bodies)),
        "ring": CentralWheel(p.J_ring, 0.5 * p.module * ring, float(w.ring), is_body=bool(bodies)),
    }
    if bodies:
        carrier = moving_carrier(p.J_carrier, p.orbit, [p.planet_set], bodies)
    else:
        riding = p.planets * p.planet_mass
        carrier = wheel(2.0 * p.J_carrier / p.orbit**2 + riding, p.J_carrier + riding * p.orbit**2, RATE)
    return train_state(carrier, wheels, {p.planet_set: float(w.planet)}, bodies)


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


INERTIA = "inertia seen at the carrier, relative to the closed form"
CHECKS = (
    Check("W1", "speeds of all members from two engines against Willis", _speeds, "Willis equation"),
    inertia_check("W2", build, ("carrier",), inertia_at_carrier, INERTIA),
    torque_check("W3", MOTION, "sun", sun_acceleration, relative=True),
    neighbour_check("W4", build),
    moving_check("W5", build, state),
    mesh_check("W6", build, meshes=3, wheels=1),
)

ENTRY = MOTION.entry(
    minimal="exact reduction: one coordinate, all gears as shafts",
    name="wolfrom",
    title="Wolfrom train",
    family="gear-train",
    summary="A sun, stepped planets, a held and a turning ring: 116:1 in one stage, and what that costs in efficiency.",
    plots=(
        PlotRecipe("input and output speed", ("sun_rate", "ring_rate")),
        PlotRecipe("transmission ratio", ("sun_rate",), over="ring_rate"),
        PlotRecipe("input and output angle", ("sun", "ring")),
    ),
    parameters=Parameters,
    checks=CHECKS,
    expand=expand,
    chain="3K epicyclic (Wolfrom)",
    formulas="w_sun / w_ring = (1 + z_r1 / z_s) / (1 - z_r1 z_p2 / (z_p1 z_r2)).",
    sources=("Wolfrom 1912", "Mueller 1998, Die Umlaufgetriebe"),
)
