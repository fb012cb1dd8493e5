"""A simple planetary stage: sun, planets on a carrier, ring. Gears on a moving carrier, in three fidelities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from mechlab.analytic import planetary_stage as closed_form
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.check import Check, Measured
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Constant
from mechlab.experiment.parameters import parameter
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.shape import Shape
from mechlab.shapes import external_phase, internal_phase
from mechlab.study.witness import engine_answer

BRASS, STEEL, BLUE, RED = (
    (0.83, 0.68, 0.29, 1.0),
    (0.62, 0.66, 0.72, 1.0),
    (0.16, 0.42, 0.75, 1.0),
    (0.76, 0.27, 0.25, 1.0),
)


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


# -- looks ---------------------------------------------------------------------------------------------------------------


def _azimuth(p: Parameters, k: int) -> float:
    return 2.0 * math.pi * k / p.planets


def _sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    m, z = p.module, p.teeth[0]
    return (
        shape("spur_gear", color=BRASS, name="sun", teeth=z, module=m, width=8 * m, bore=0.12 * m * z, phase=0.0),
        shape("cylinder", Placement((0.0, 0.0, 8 * m)), BRASS, "shaft", radius=0.12 * m * z, length=24 * m),
    )


def _planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    m, (sun, planet, _) = p.module, p.teeth
    return (
        shape("spur_gear", color=STEEL, name="planet", teeth=planet, module=m, width=8 * m, bore=0.09 * m * planet,
              phase=external_phase(sun, 0.0, planet, _azimuth(p, k)), holes=5),
    )  # fmt: skip


def _ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    m, (sun, planet, ring) = p.module, p.teeth
    phase = internal_phase(planet, external_phase(sun, 0.0, planet, 0.0), ring, 0.0)
    return (shape("internal_gear", color=BLUE, name="ring", teeth=ring, module=m, width=8 * m, phase=phase),)


def _carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    m = p.module
    out = [shape("disc", Placement((0.0, 0.0, -8 * m)), RED, "hub", radius=0.35 * p.orbit, thickness=4 * m)]
    for k in range(p.planets):
        a = _azimuth(p, k)
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
        pin = (p.orbit * math.cos(a), p.orbit * math.sin(a), -1.5 * m)
        out.append(shape("cylinder", Placement(pin), RED, f"pin_{k + 1}", radius=0.09 * m * p.teeth[1], length=14 * m))
    return tuple(out)


# -- mechanisms ------------------------------------------------------------------------------------------------------------


def _disc(inertia: float, radius: float) -> Inertia:
    """A flat disc with the given moment about z."""
    mass = 2.0 * inertia / radius**2
    return Inertia.axial(mass, inertia, 0.5 * inertia)


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
    b.drive("sun", stiffness=50.0, damping=1.0)
    if p.ring == "free":
        b.drive("carrier", stiffness=50.0, damping=1.0)
    return b.build()


def _carrier_inertia(p: Parameters, carried: int) -> Inertia:
    """Carrier; planets beyond the `carried` ones that are bodies ride along as point masses (their orbit)."""
    orbiting = (p.planets - carried) * p.planet_mass * p.orbit**2
    return _disc(p.J_carrier + orbiting, p.orbit)


def _minimal(b: Builder, p: Parameters) -> None:
    sun, planet, ring = p.teeth
    shapes = _carrier_shapes(p)
    b.body("carrier", revolute("carrier"), inertia=_carrier_inertia(p, 0), shapes=shapes)
    if p.ring == "held":
        b.shaft("sun", {"carrier": 1 + Fraction(ring, sun)}, inertia=p.J_sun, shapes=_sun_shapes(p))
        spin: dict[str, object] = {"carrier": 1 - Fraction(ring, planet)}
        turn: dict[str, object] = {"carrier": -Fraction(ring, planet)}
        b.ground(*_ring_shapes(p))
    else:
        b.body(
            "sun",
            revolute("sun_on_carrier"),
            parent="carrier",
            inertia=_disc(p.J_sun, 0.5 * p.module * sun),
            shapes=_sun_shapes(p),
        )
        b.shaft("sun", {"carrier": 1, "sun_on_carrier": 1})
        b.shaft(
            "ring", {"carrier": 1, "sun_on_carrier": -Fraction(sun, ring)}, inertia=p.J_ring, shapes=_ring_shapes(p)
        )
        spin = {"carrier": 1, "sun_on_carrier": -Fraction(sun, planet)}
        turn = {"sun_on_carrier": -Fraction(sun, planet)}
    for k in range(p.planets):
        a = _azimuth(p, k)
        place = Placement((p.orbit * math.cos(a), p.orbit * math.sin(a), 0.0))
        b.shaft(f"planet_{k + 1}_spin", spin, inertia=p.J_planet)
        b.shaft(f"planet_{k + 1}", turn, body="carrier", placement=place, shapes=_planet_shapes(p, k))


def _gears(b: Builder, p: Parameters, planets: int) -> None:
    sun, planet, ring = p.teeth
    b.body("sun", revolute("sun"), inertia=_disc(p.J_sun, 0.5 * p.module * sun), shapes=_sun_shapes(p))
    carrier = _carrier_inertia(p, planets)
    b.body("carrier", revolute("carrier"), inertia=carrier, shapes=_carrier_shapes(p))
    if p.ring == "free":
        b.body("ring", revolute("ring"), inertia=_disc(p.J_ring, 0.5 * p.module * ring), shapes=_ring_shapes(p))
    else:
        b.ground(*_ring_shapes(p))
    for k in range(planets):
        a, name = _azimuth(p, k), f"planet_{k + 1}"
        spin = p.J_planet * (p.planets if planets == 1 else 1)
        b.body(name, revolute(name), parent="carrier", at=(p.orbit * math.cos(a), p.orbit * math.sin(a), 0.0),
               inertia=Inertia.axial(p.planet_mass, spin, 0.5 * spin), shapes=_planet_shapes(p, k))  # fmt: skip
        b.gears(f"sun_{name}", "sun", name, (sun, planet), carrier="carrier")
        if p.ring == "free":
            b.gears(f"ring_{name}", "ring", name, (ring, planet), carrier="carrier", kind="internal")
        else:
            b.relation(f"ring_{name}", **{"carrier": 1, name: Fraction(planet, ring)})


# -- questions -------------------------------------------------------------------------------------------------------------


SPEEDS = ("sun_rate", "ring_rate", "carrier_rate")


def _free(p: Parameters) -> Parameters:
    from dataclasses import replace

    return replace(p, ring="free")


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    known = {k.removesuffix("_rate"): given[k] for k in SPEEDS if k in given}
    found = closed_form.speeds(p.teeth[0], p.teeth[2], planet_teeth=p.teeth[1], **known)
    values = {f"{n}_rate": getattr(found, n) for n in ("sun", "ring", "carrier", "planet")}
    return Answer({k: v for k, v in values.items() if k not in given})


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Speeds from the constraint Jacobian of the `parts` model with a free ring; a planet's joint counts from the carrier."""
    asked = {k: float(v) for k, v in given.items()}
    answer = engine_answer(engine, build(_free(p), "parts"), asked, [*SPEEDS, "planet_1_rate"])
    if answer.cannot:
        return answer
    rates = dict(answer.values)
    rates["planet_rate"] = rates.pop("planet_1_rate") + rates["carrier_rate"]
    return Answer({k: v for k, v in rates.items() if k not in given}, answer.status, answer.notes)


def _pinocchio(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return _engine("pinocchio", p, given)


def _mujoco(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return _engine("mujoco", p, given)


def _question(first: str, second: str) -> Question:
    answers = tuple(k for k in (*SPEEDS, "planet_rate") if k not in (first, second))
    return Question(
        f"speeds from {first} and {second}", (first, second), answers,
        {"analytic": _analytic, "pinocchio": _pinocchio, "mujoco": _mujoco}, text="absolute speeds of all members",
        units=dict.fromkeys((*SPEEDS, "planet_rate"), "rad/s"),
    )  # fmt: skip


QUESTIONS = (
    _question("sun_rate", "ring_rate"),
    _question("sun_rate", "carrier_rate"),
    _question("ring_rate", "carrier_rate"),
)


# -- scenes, reference, checks -----------------------------------------------------------------------------------------------


def _scene(p: Parameters, fidelity: str) -> Scene:
    laws = (Constant("sun", p.sun_torque), Constant("carrier", p.carrier_torque))
    return Scene("constant-torques", fidelity, 0.5, laws, needs=("poses", "drive_forces"), tolerance=1e-6)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant accelerations in closed form."""
    import numpy as np

    m = build(p, "minimal")
    t = np.linspace(0.0, scene.duration, 251)
    acc = _accelerations(p)
    names = {"carrier": acc.carrier, "sun_on_carrier": acc.sun - acc.carrier}
    a = np.array([float(names[j.name]) for j in m.joints])
    q, v = 0.5 * t[:, None] ** 2 * a, t[:, None] * a
    channels, units = basic_channels(m, q, v)
    return Recording(
        m, t, q, v, channels, units, settings=Settings(engine="analytic"), scene=scene.name, fidelity="minimal"
    )


def _accelerations(p: Parameters) -> closed_form.StageAccelerations:
    if p.ring == "held":
        return closed_form.held_ring_accelerations(p.stage, p.sun_torque, p.carrier_torque)
    return closed_form.free_accelerations(p.stage, p.sun_torque, p.carrier_torque)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All planets along a recording of any fidelity."""
    import numpy as np

    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    sun, carrier = recording.channel("sun"), recording.channel("carrier")
    ratio = p.teeth[0] / p.teeth[1]
    values = {"sun": sun, "carrier": carrier, "ring": carrier - p.teeth[0] / p.teeth[2] * (sun - carrier)}
    values |= {f"planet_{k + 1}": -ratio * (sun - carrier) for k in range(p.planets)}
    return full, np.column_stack([values[j.name] for j in full.joints])


def _check_speeds(p: Parameters) -> Measured:
    said: dict[str, list[float]] = {"analytic": [], "pinocchio": [], "mujoco": []}
    for question in QUESTIONS:
        given = dict(zip(question.given, (37.0, -5.0), strict=True))
        for witness, ask in question.witnesses.items():
            values = ask(p, given).values
            said[witness] += [float(values[k]) for k in question.answers]
    return Measured(said, 1e-9, note="all members from each pair of speeds, Willis against constraint Jacobians")


def _check_mass(p: Parameters) -> Measured:
    import numpy as np

    from mechlab.mechanism import ConstraintSet, TreeKinematics
    from mechlab.mechanism.structure import null_space

    free = _free(p)
    expected = closed_form.mass_matrix(free.stage)
    said = {}
    for fidelity in ("minimal", "parts", "full"):
        m = build(free, fidelity)
        tree = TreeKinematics(m)
        basis = null_space(ConstraintSet(m).jacobian(tree))
        basis = basis @ np.linalg.inv(np.array([m.row("sun"), m.row("carrier")]) @ basis)
        said[fidelity] = basis.T @ tree.mass_matrix() @ basis / expected.max()
    return Measured(said, 1e-12, expected / expected.max(), "mass matrix in (sun, carrier), ring free, relative")


def _check_run(p: Parameters) -> Measured:
    from mechlab.simulate import run as run_mujoco
    from mechlab.solve import run as run_pinocchio

    acc = _accelerations(p)
    end = {}
    for fidelity in ("minimal", "full"):
        scene = _scene(p, fidelity)
        end[f"mujoco {fidelity}"] = run_mujoco(build(p, fidelity), scene, Settings()).channel("sun_rate")[-1]
    end["pinocchio full"] = run_pinocchio(build(p, "full"), _scene(p, "full"), Settings(engine="pinocchio")).channel(
        "sun_rate"
    )[-1]
    # Softness of MuJoCo's gear rows: slip 4e-7 rad at 1 N m, its rate well below 1e-4 rad/s; the minimal model has no rows.
    return Measured(end, 1e-4, float(acc.sun) * 0.5, "sun speed after 0.5 s under constant torques [rad/s]")


CHECKS = (
    Check("P1", "speeds of all members from three witnesses", _check_speeds, "Willis equation"),
    Check("P2", "mass matrix of each fidelity against the closed form", _check_mass, "Lagrange"),
    Check("P3", "run under constant torques against the closed form", _check_run, "Lagrange"),
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
    scenes={"constant-torques": SceneRecipe(_scene, "minimal", "constant torques on sun and carrier from rest")},
    default_scene="constant-torques",
    questions=QUESTIONS,
    checks=CHECKS,
    reference=reference,
    expand=expand,
    chain="2K-H epicyclic",
    formulas="Willis: z_sun (w_sun - w_carrier) = -z_ring (w_ring - w_carrier);\n"
    "z_planet (w_planet - w_carrier) = -z_sun (w_sun - w_carrier).",
    sources=("Willis 1841",),
)
