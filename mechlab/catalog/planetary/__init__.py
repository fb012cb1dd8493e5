"""The planetary gear with series planets (2A-AA): sun 1 - planet 2 - planet 3 - fixed central gear 4, all meshes external.

Carrier output; the axes of sun, planet 2 and planet 3 stand on one ray, planet 3 outermost and wide: it meshes with
planet 2 in the plane of the sun and with gear 4 in a second plane. Its teeth come from `mechlab synthesize planetary`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import planetary_synthesis as closed_form
from mechlab.analytic.planetary_synthesis import neighbour_gaps
from mechlab.catalog.planetary.claims import CLAIMS, SOURCE
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
    distance,
    engine_speeds,
    expand_by,
    inertia_check,
    measured_speeds,
    mesh_check,
    moving_check,
    moving_disc,
    on_circle,
    seats,
    speed_question,
    steady_recording,
    torque_check,
    train_state,
    wheel,
)
from mechlab.kit.mass_check import NOTHING, State
from mechlab.kit.palette import BLUE, BRASS, RED, STEEL, TEAL
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase


@dataclass(frozen=True)
class Parameters:
    """Teeth, sizes, inertias and torques."""

    teeth: tuple[int, ...] = parameter((18, 36, 18, 90), "", "teeth z1, z2, z3, z4", low=6, source=SOURCE)
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
        if (z1 + z4) % self.planets:
            raise MechlabError(
                f"{what}: {self.planets} planets cannot stand at equal angles: (z1 + z4) / planets = "
                f"{z1 + z4}/{self.planets} is not whole."
            )
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
    a = azimuth(k, p.planets)
    two = external_phase(z1, 0.0, z2, a)
    three = external_phase(z2, two, z3, a)
    return two, three, external_phase(z3, three, z4, a + math.pi)


def gear(
    p: Parameters, z: int, name: str, color: tuple[float, float, float, float], lift: float, **more: float
) -> Shape:
    """A spur gear of z teeth, `lift` modules above the plane of the sun."""
    m = p.module
    sizes = {"width": 8 * m, "bore": 0.09 * m * z, "phase": 0.0} | more
    return shape("spur_gear", Placement((0.0, 0.0, lift * m)), color, name, teeth=z, module=m, **sizes)


def fixed_gear(p: Parameters) -> Shape:
    """Gear 4 in the second plane; it carries the whole profile shift of its mesh (the other two have none)."""
    z1, z2, z3, z4 = p.teeth
    aw = float(closed_form.working_angle(z1, z2, z3, z4))
    shift = (z3 + z4) * (closed_form.involute(aw) - closed_form.involute(closed_form.STANDARD))
    x = min(float(shift / (2.0 * math.tan(closed_form.STANDARD))), 1.0)
    return gear(p, z4, "gear_4", BLUE, -9.0, bore=0.3 * p.module * z4, phase=phases(p, 0)[2], profile_shift=x)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m, (r2, r3) = p.module, p.radii
    out = [shape("disc", Placement((0.0, 0.0, 8 * m)), RED, "hub", radius=0.3 * r2, thickness=4 * m)]
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        arm = Placement.of(axis_rotation((0.0, 0.0, 1.0), a), (0.0, 0.0, 8 * m))
        out.append(shape("link", arm, RED, f"arm_{k + 1}", length=r3, width=0.16 * r2, thickness=3 * m, bore=0.03 * r2))
        for name, r, low in (("a", r2, -5.0), ("b", r3, -14.0)):
            pin = Placement(on_circle(r, a, 0.5 * (low + 9.0) * m))
            out.append(shape("cylinder", pin, RED, f"pin_{k + 1}{name}", radius=0.03 * r2, length=(9.0 - low) * m))
    return tuple(out)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: one coordinate, no rows. parts: one ray of planets, each mesh a row. full: all rays, redundant rows."""
    if fidelity not in ("minimal", "parts", "full"):
        raise unknown("planetary: fidelity", fidelity, ("minimal", "parts", "full"))
    b = Builder("planetary", gravity=(0.0, 0.0, 0.0), summary="planetary gear with series planets, all meshes external")
    z1, z2, z3, z4 = p.teeth
    sun = gear(p, z1, "sun", BRASS, 0.0)
    b.ground(fixed_gear(p))
    bodies = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    r2, r3 = p.radii
    orbit = (p.planets - bodies) * (p.mass_2 * r2**2 + p.mass_3 * r3**2)
    b.body("carrier", revolute("carrier"), inertia=disc(p.J_carrier + orbit, r3), shapes=carrier_shapes(p))
    if fidelity == "minimal":
        b.shaft("sun", {"carrier": p.ratio}, inertia=p.J_sun, shapes=(sun,))
    else:
        b.body("sun", revolute("sun"), inertia=disc(p.J_sun, 0.5 * p.module * z1), shapes=(sun,))
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        two, three, _ = phases(p, k)
        looks = {
            2: gear(p, z2, "planet_2", STEEL, 0.0, phase=two, holes=5),
            3: gear(p, z3, "planet_3", TEAL, -4.5, phase=three, width=18 * p.module),
        }
        for n, r, moment, mass, relative in (
            (2, r2, p.J_planet_2, p.mass_2, -Fraction(z4, z2)), (3, r3, p.J_planet_3, p.mass_3, Fraction(z4, z3)),
        ):  # fmt: skip
            name, at = f"planet_{n}_{k + 1}", on_circle(r, a)
            if fidelity == "minimal":
                b.shaft(f"{name}_spin", {"carrier": 1 + relative}, inertia=moment)
                b.shaft(name, {"carrier": relative}, body="carrier", placement=Placement(at), shapes=(looks[n],))
            elif k < bodies:
                spin = moment * (p.planets if bodies == 1 else 1)
                inertia = Inertia.axial(mass, spin, 0.5 * spin)
                b.body(name, revolute(name), parent="carrier", at=at, inertia=inertia, shapes=(looks[n],))
        if fidelity != "minimal" and k < bodies:
            two_name, three_name = f"planet_2_{k + 1}", f"planet_3_{k + 1}"
            b.gears(f"sun_{two_name}", "sun", two_name, (z1, z2), carrier="carrier")
            b.gears(f"{two_name}_{three_name}", two_name, three_name, (z2, z3), carrier="carrier")
            b.relation(f"{three_name}_gear_4", **{three_name: 1, "carrier": -Fraction(z4, z3)})
    b.drive("sun", stiffness=50.0, damping=0.2)
    return b.build()


SPEEDS = ("sun_rate", "carrier_rate", "planet_2_rate", "planet_3_rate")


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    carrier = given["carrier_rate"] if "carrier_rate" in given else given["sun_rate"] / float(p.ratio)
    values = {f"{n}_rate": carrier * float(c) for n, c in p.rates.items()} | {"carrier_rate": carrier}
    return Answer({k: v for k, v in values.items() if k not in given})


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    planets = {f"planet_{n}_rate": f"planet_{n}_1" for n in (2, 3)}
    return engine_speeds(engine, build(p, "parts"), given, SPEEDS[:2], planets)


QUESTIONS = tuple(speed_question((key,), SPEEDS, _analytic, _engine) for key in SPEEDS[:2])


def scene(p: Parameters, fidelity: str) -> Scene:
    """Constant torques on sun and carrier."""
    return constant_torques(fidelity, {"sun": p.sun_torque, "carrier": p.carrier_torque})


def acceleration(p: Parameters) -> float:
    """Carrier acceleration under the torques of the scene [rad/s2]."""
    return (p.sun_torque * float(p.ratio) + p.carrier_torque) / p.inertia


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant acceleration in closed form."""
    return steady_recording(build(p, "minimal"), {"carrier": acceleration(p)}, scene)


def _angles(p: Parameters, recording: Recording) -> dict[str, Array]:
    factor = {"sun": float(p.ratio), "carrier": 1.0}
    factor |= {f"planet_{n}_{k + 1}": float(p.rates[f"planet_{n}"] - 1) for n in (2, 3) for k in range(p.planets)}
    return {name: x * recording.channel("carrier") for name, x in factor.items()}


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE. Planets that are no bodies ride on the carrier, a flat disc as wide as its outer circle; in
    `minimal` all wheels turn as shafts, in `parts` one ray turns for all."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    per_turn = {name: float(x) for name, x in p.rates.items()}
    radii = dict(zip((2, 3), p.radii, strict=True))
    masses, moments = {2: p.mass_2, 3: p.mass_3}, {2: p.J_planet_2, 3: p.J_planet_3}
    riding = (p.planets - rays) * sum(masses[n] * radii[n] ** 2 for n in (2, 3))
    parts = moving_disc(p.J_carrier + riding, radii[3], RATE)
    turns = {"carrier": 1.0, "sun": per_turn["sun"]}
    rotors = 0.0
    if rays:
        parts = parts + moving_disc(p.J_sun, 0.5 * p.module * p.teeth[0], per_turn["sun"] * RATE)
    else:
        rotors = p.J_sun * per_turn["sun"] ** 2
    for n in (2, 3):
        spin = per_turn[f"planet_{n}"]
        moment = moments[n] * (p.planets if rays == 1 else 1)
        places = seats(radii[n], p.planets)[:rays]
        parts = sum((wheel(masses[n], moment, spin * RATE, at, RATE) for at in places), NOTHING) + parts
        turns |= {f"planet_{n}_{k + 1}": spin - 1.0 for k in range(rays or p.planets)}
        if not rays:
            turns |= {f"planet_{n}_{k + 1}_spin": spin for k in range(p.planets)}
            rotors += p.planets * moments[n] * spin**2
    return train_state(turns, parts, rotors)


MOVING = (moving_check("S6", build, state), mesh_check("S7", build, meshes=3, wheels=2))


def _speeds(p: Parameters) -> CheckResult:
    return measured_speeds(p, QUESTIONS, (7.0,), 1e-9 * float(p.ratio), "all members from the sun and from the carrier")


def _teeth(p: Parameters) -> CheckResult:
    """Phase left over at gear 4 on every ray, in pitches: 0 when a tooth stands in a gap there."""
    pitch = 2.0 * math.pi / p.teeth[3]
    off = [(phases(p, k)[2] - phases(p, 0)[2]) / pitch for k in range(p.planets)]
    measured = {"drawn": max(abs(x - round(x)) for x in off)}
    return CheckResult(measured, 1e-9, 0.0, "gear 4 meshes with planet 3 on every ray [pitches]")


def _room(p: Parameters) -> CheckResult:
    """Clearances between planets: distances of their centres less their tip radii, (z + 2) / 2 modules each."""
    if p.planets == 1:
        return CheckResult({"drawn": np.zeros(0)}, 1e-9, np.zeros(0), "one planet has no neighbour")
    m, (z1, z2, z3, _) = build(p, "full"), p.teeth
    pairs = (
        ("planet_2_1", "planet_2_2", z2 + z2),
        ("planet_3_1", "planet_3_2", z3 + z3),
        ("planet_2_1", "planet_3_2", z2 + z3),
    )
    measured = [distance(m, a, b) / (0.5 * p.module) - z - 4 for a, b, z in pairs]
    expected = neighbour_gaps(z1, z2, z3, p.planets)
    return CheckResult({"drawn": measured}, 1e-9, expected, "room between neighbouring planets [half modules]")


CHECKS = (
    Check("S1", "speeds of all members from three witnesses", _speeds, "Willis equation"),
    inertia_check(
        "S2",
        "reduced inertia of each fidelity against the closed form",
        build,
        ("carrier",),
        lambda p: p.inertia,
        "inertia reduced to the carrier, relative to the closed form",
    ),
    torque_check("S3", build, scene, "carrier", acceleration),
    Check("S4", "teeth in phase on every ray", _teeth, "assembly condition (z1 + z4) / planets whole"),
    Check("S5", "room between the planets", _room, "law of cosines"),
    *MOVING,
)

ENTRY = Entry(
    name="planetary",
    title="Planetary gear with series planets",
    summary="Sun, two planets in series on each ray, fixed central gear, all meshes external; ratio 1 + z4 / z1.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "Willis equation",
        "minimal": "one coordinate, all gears as shafts",
        "parts": "one ray that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    },
    default_fidelity="minimal",
    scenes={"constant-torques": SceneRecipe(scene, "minimal", "constant torques on sun and carrier from rest")},
    default_scene="constant-torques",
    questions=QUESTIONS,
    checks=CHECKS,
    claims=CLAIMS,
    reference=reference,
    expand=expand_by(build, _angles),
    chain="2A-AA epicyclic, series planets",
    formulas="w_sun = (1 + z4 / z1) w_carrier; planet 3 turns against the carrier by z4 / z3, planet 2 by -z4 / z2.",
    sources=(SOURCE, "Willis 1841"),
)
