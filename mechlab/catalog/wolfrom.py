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
from mechlab.experiment.check import Check, Measured
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Constant
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.reduction import Reduction, reduce
from mechlab.mechanism.shape import Shape
from mechlab.shapes import external_phase, internal_phase

Teeth = tuple[int, int, int, int, int]
BRASS, STEEL, BLUE, RED, GREEN = (
    (0.83, 0.68, 0.29, 1.0),
    (0.62, 0.66, 0.72, 1.0),
    (0.16, 0.42, 0.75, 1.0),
    (0.76, 0.27, 0.25, 1.0),
    (0.25, 0.58, 0.42, 1.0),
)
WIDTH, GAP = 7.0, 2.0
"""Face width and the gap between the two planes of gears, in modules."""


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
            planet_turn(self, k)

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


# -- looks ---------------------------------------------------------------------------------------------------------------


def azimuth(p: Parameters, k: int) -> float:
    """Angle of the axis of planet k round the sun [rad]."""
    return 2.0 * math.pi * k / p.planets


def planet_turn(p: Parameters, k: int) -> float:
    """How far planet k is turned against planet 0 so that both its gears mesh [rad]; planets are made alike.

    Tries every tooth of the first mesh. Raises MechlabError when none fits the second: the planets cannot be alike.
    """
    sun, first, _, second, ring = p.all_teeth
    start, a = external_phase(sun, 0.0, first, 0.0), azimuth(p, k)
    pitch = 2.0 * math.pi / ring
    zero = internal_phase(second, 0.0, ring, 0.0)
    for j in range(first):
        turn = external_phase(sun, 0.0, first, a) - start + 2.0 * math.pi * j / first
        gap = (internal_phase(second, turn, ring, a) - zero) / pitch
        if abs(gap - round(gap)) < 1e-6:
            return turn
    raise MechlabError(
        f"wolfrom: teeth = {p.teeth}: planet {k + 1} of {p.planets} alike planets fits the held ring but not the output ring; "
        "choose ring_1 - ring_2 a multiple of the number of planets (planet gears of equal teeth)."
    )


def _planes(p: Parameters) -> tuple[float, float]:
    return 0.0, (WIDTH + GAP) * p.module


def _gear(p: Parameters, kind: str, color: tuple[float, float, float, float], name: str, k: int, teeth: int, phase: float,
          **size: float) -> Shape:  # fmt: skip
    module = p.module if k == 0 else p.second_module
    place = Placement((0.0, 0.0, _planes(p)[k]))
    return shape(kind, place, color, name, teeth=teeth, module=module, width=WIDTH * p.module, phase=phase, **size)


def _sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    m, z = p.module, p.teeth[0]
    shaft = shape("cylinder", Placement((0.0, 0.0, -14 * m)), BRASS, "shaft", radius=0.16 * m * z, length=24 * m)
    return _gear(p, "spur_gear", BRASS, "sun", 0, z, 0.0, bore=0.12 * m * z), shaft


def _planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    sun, first, _, second, _ = p.all_teeth
    turn = planet_turn(p, k)
    bore = 0.09 * p.module * first
    return (
        _gear(p, "spur_gear", STEEL, "planet_gear_1", 0, first, external_phase(sun, 0.0, first, 0.0) + turn, bore=bore, holes=5),
        _gear(p, "spur_gear", STEEL, "planet_gear_2", 1, second, turn, bore=bore, holes=5),
    )  # fmt: skip


def _held_ring(p: Parameters) -> Shape:
    sun, first, ring, _, _ = p.all_teeth
    phase = internal_phase(first, external_phase(sun, 0.0, first, 0.0), ring, 0.0)
    return _gear(p, "internal_gear", BLUE, "held_ring", 0, ring, phase)


def _ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    _, _, _, second, ring = p.all_teeth
    return (_gear(p, "internal_gear", GREEN, "output_ring", 1, ring, internal_phase(second, 0.0, ring, 0.0)),)


def _carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
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
        a = azimuth(p, k)
        arm = Placement.of(
            axis_rotation((0, 0, 1.0), a), (0.3 * p.orbit * math.cos(a), 0.3 * p.orbit * math.sin(a), low)
        )
        out.append(shape("link", arm, RED, f"arm_{k + 1}", length=0.7 * p.orbit, width=0.2 * p.orbit, thickness=4 * m,
                         bore=0.05 * p.orbit))  # fmt: skip
        pin = (p.orbit * math.cos(a), p.orbit * math.sin(a), low + 0.5 * length)
        out.append(shape("cylinder", Placement(pin), RED, f"pin_{k + 1}", radius=0.088 * m * p.teeth[1], length=length))
    return tuple(out)


# -- mechanisms ------------------------------------------------------------------------------------------------------------


def _disc(inertia: float, radius: float) -> Inertia:
    return Inertia.axial(2.0 * inertia / radius**2, inertia, 0.5 * inertia)


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
    b.ground(_held_ring(p))
    b.body("sun", revolute("sun"), inertia=_disc(p.J_sun, 0.5 * m * sun), shapes=_sun_shapes(p))
    orbiting = (p.planets - planets) * p.planet_mass * p.orbit**2
    b.body("carrier", revolute("carrier"), inertia=_disc(p.J_carrier + orbiting, p.orbit), shapes=_carrier_shapes(p))
    b.body("ring", revolute("ring"), inertia=_disc(p.J_ring, 0.5 * m * ring), shapes=_ring_shapes(p))
    for k in range(planets):
        a, name = azimuth(p, k), f"planet_{k + 1}"
        spin = p.J_planet * (p.planets if planets == 1 else 1)
        b.body(name, revolute(name), parent="carrier", at=(p.orbit * math.cos(a), p.orbit * math.sin(a), 0.0),
               inertia=Inertia.axial(p.planet_mass, spin, 0.5 * spin), shapes=_planet_shapes(p, k))  # fmt: skip
        b.gears(f"sun_{name}", "sun", name, (sun, first), carrier="carrier")
        b.relation(f"held_ring_{name}", **{"carrier": 1, name: Fraction(first, ring)})
        b.gears(f"ring_{name}", "ring", name, (output, second), carrier="carrier", kind="internal")
    b.drive("sun", stiffness=5.0, damping=0.05)
    b.drive("ring", damping=1.0)
    return b.build()


# -- scenes, reference, checks -----------------------------------------------------------------------------------------------


def _scene(p: Parameters, fidelity: str) -> Scene:
    laws = (Constant("sun", p.sun_torque), Constant("ring", p.ring_torque))
    return Scene("constant-torques", fidelity, 0.5, laws, needs=("poses", "drive_forces"), tolerance=1e-6)


def carrier_acceleration(p: Parameters) -> float:
    """Of the carrier under the two torques, without losses [rad/s2], in closed form."""
    w = closed_form.speeds(p.all_teeth)
    inertia = closed_form.reflected_inertia(
        p.all_teeth, p.planets, p.J_sun, p.J_ring, p.J_carrier, p.J_planet, p.planet_mass * p.orbit**2
    )
    return (p.sun_torque + p.ring_torque * float(w.ring / w.sun)) / inertia / float(w.sun)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant acceleration in closed form."""
    m = build(p, "minimal")
    t = np.linspace(0.0, scene.duration, 251)
    a = np.array([carrier_acceleration(p)])
    q, v = 0.5 * t[:, None] ** 2 * a, t[:, None] * a
    channels, units = basic_channels(m, q, v)
    return Recording(
        m, t, q, v, channels, units, settings=Settings(engine="analytic"), scene=scene.name, fidelity="minimal"
    )


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All parts along a recording of any fidelity, from the carrier by exact ratios."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    return full, reduction(p).basis.angles(recording.channel("carrier")[:, None])


def _check_speeds(p: Parameters) -> Measured:
    from mechlab.study.witness import engine_answer

    w = closed_form.speeds(p.all_teeth)
    names = ("carrier_rate", "ring_rate", "planet_1_rate")
    expected = np.array([1.0, float(w.ring), float(w.planet) - 1.0]) / float(w.sun) * 100.0
    said = {}
    for fidelity in ("parts", "full"):
        for engine in ("pinocchio", "mujoco"):
            answer = engine_answer(engine, build(p, fidelity), {"sun_rate": 100.0}, names)
            said[f"{engine} {fidelity}"] = [answer.values[n] for n in names]
    return Measured(said, 1e-9, expected, "rates of carrier, output and planet in carrier at 100 rad/s of the sun")


def _check_mass(p: Parameters) -> Measured:
    from mechlab.mechanism import TreeKinematics
    from mechlab.mechanism.angle_basis import dependent_angles

    expected = (
        closed_form.reflected_inertia(
            p.all_teeth, p.planets, p.J_sun, p.J_ring, p.J_carrier, p.J_planet, p.planet_mass * p.orbit**2
        )
        * float(closed_form.speeds(p.all_teeth).sun) ** 2
    )
    said = {"minimal": float(TreeKinematics(build(p, "minimal")).mass_matrix()[0, 0]) / expected}
    for fidelity in ("parts", "full"):
        m = build(p, fidelity)
        k = dependent_angles(m, ("carrier",)).matrix
        said[fidelity] = float((k.T @ TreeKinematics(m).mass_matrix() @ k)[0, 0]) / expected
    return Measured(said, 1e-12, 1.0, "inertia seen at the carrier, relative to the closed form")


def _check_run(p: Parameters) -> Measured:
    from mechlab.simulate import run as run_mujoco
    from mechlab.solve import run as run_pinocchio

    said = {}
    for fidelity in ("minimal", "parts", "full"):
        scene = _scene(p, fidelity)
        said[f"mujoco {fidelity}"] = run_mujoco(build(p, fidelity), scene, Settings()).channel("sun_rate")[-1]
    said["pinocchio full"] = run_pinocchio(build(p, "full"), _scene(p, "full"), Settings(engine="pinocchio")).channel(
        "sun_rate"
    )[-1]
    w = closed_form.speeds(p.all_teeth)
    expected = carrier_acceleration(p) * float(w.sun) * 0.5
    # RK4 is exact for a constant acceleration; soft rows take at most one time constant (2 ms) to take up their slip.
    return Measured(
        {k: v / expected for k, v in said.items()},
        1e-5,
        1.0,
        f"sun speed after 0.5 s, relative to {expected:.6g} rad/s",
    )


CHECKS = (
    Check("W1", "speeds of all members from two engines against Willis", _check_speeds, "Willis equation"),
    Check("W2", "inertia of each fidelity against the closed form", _check_mass, "Lagrange"),
    Check("W3", "run under constant torques against the closed form", _check_run, "Lagrange"),
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
    scenes={"constant-torques": SceneRecipe(_scene, "minimal", "constant torques on sun and output ring from rest")},
    default_scene="constant-torques",
    checks=CHECKS,
    reference=reference,
    expand=expand,
    chain="3K epicyclic (Wolfrom)",
    formulas="w_sun / w_ring = (1 + z_r1 / z_s) / (1 - z_r1 z_p2 / (z_p1 z_r2)).",
    sources=("Wolfrom 1912", "Mueller 1998, Die Umlaufgetriebe"),
)
