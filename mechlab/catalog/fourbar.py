"""The planar four-bar: the tutorial entry. Copy this file to add a mechanism of your own.

Ground pivots A = (0, 0) and D = (ground, 0); crank pin B, joint C of coupler and rocker. The plane stands upright: x to
the right, y of the closed form is z of the world. Angles are counted from the ground line, counter-clockwise as seen
from the front (from -Y).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import fourbar as closed_form
from mechlab.analytic.benchmarks import FourbarCrank
from mechlab.catalog.palette import BLUE, ORANGE, SLATE, TEAL
from mechlab.experiment.check import Check, Measured
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Constant, Law, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.parameters import parameter
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism import Builder, Mechanism, Status, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.study import mass_check
from mechlab.study.own_equations import record_own
from mechlab.study.witness import engine_answer

# 1. Parameters: flat, frozen, each with unit, meaning, limits.


@dataclass(frozen=True)
class Parameters:
    """Lengths, mass, gravity and assembly mode of a four-bar."""

    crank: float = parameter(0.1, "m", "crank A-B", low=0, strict=True)
    coupler: float = parameter(0.3, "m", "coupler B-C", low=0, strict=True)
    rocker: float = parameter(0.25, "m", "rocker D-C", low=0, strict=True)
    ground: float = parameter(0.3, "m", "ground A-D", low=0, strict=True)
    mode: int = parameter(1, "", "+1: C left of the vector from B to D, -1: right", low=-1, high=1)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(2 * math.pi, "rad/s", "crank speed of the scenes")
    torque: float = parameter(0.2, "N m", "crank torque of the scene constant-torque")

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Crank, coupler, rocker, ground."""
        return self.crank, self.coupler, self.rocker, self.ground


# 2. The mechanism. The reference pose is any assembled one; the closed form gives it.

AXIS = "-y"


def start_angle(p: Parameters) -> float:
    """A crank angle in the middle of those at which the four-bar assembles, 1 rad when it turns fully."""
    limits = closed_form.crank_limits(*p.lengths)
    low, high = limits.ranges[0] if limits.ranges else (1.0, 1.0)
    return 1.0 if limits.full_turn else 0.5 * (low + high)


def _width(p: Parameters, length: float) -> float:
    """How wide a bar is drawn [m]."""
    return 0.03 * max(p.lengths) + 0.05 * length


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Three bars and one loop: 3 coordinates, 3 rows (one of them void), one freedom."""
    phi = start_angle(p)
    pose = closed_form.solve(*p.lengths, phi, mode=p.mode)
    psi, chi = float(pose.coupler_angle), float(pose.rocker_angle)
    b = Builder("fourbar", gravity=(0.0, 0.0, -p.gravity), summary="planar four-bar linkage")
    layer = 0.045 * max(p.lengths)
    for name, length, color, lift in (
        ("crank", p.crank, BLUE, 0.0),
        ("coupler", p.coupler, ORANGE, 1.0),
        ("rocker", p.rocker, TEAL, 0.0),
    ):
        joint = {"crank": "crank_angle", "coupler": "coupler_joint", "rocker": "rocker_angle"}[name]
        parent, at = (
            ("crank", (p.crank, 0.0, 0.0))
            if name == "coupler"
            else ("ground", (0.0 if name == "crank" else p.ground, 0.0, 0.0))
        )
        b.bar(name, revolute(joint, AXIS), length, parent=parent, at=at, mass=p.mass_per_length * length,
              width=_width(p, length), color=color, layer=layer * lift)  # fmt: skip
    b.loop("pin", "coupler", "rocker", (p.coupler, 0.0, 0.0), (p.rocker, 0.0, 0.0))
    b.shaft("coupler_angle", {"crank_angle": 1, "coupler_joint": 1})
    b.frame("B", "crank", (p.crank, 0.0, 0.0)).frame("C", "rocker", (p.rocker, 0.0, 0.0))
    b.frame("middle", "coupler", (0.5 * p.coupler, 0.0, 0.0))
    b.drive("crank_angle", stiffness=200.0, damping=2.0)
    turned = axis_rotation((1.0, 0.0, 0.0), math.pi / 2)
    from mechlab.mechanism import Placement

    for x in (0.0, p.ground):
        b.ground(shape("bracket", Placement.of(turned, (x, 0.9 * layer, 0.0)), SLATE,
                       height=0.6 * p.crank + 0.1 * p.ground, width=1.1 * layer, thickness=0.6 * layer))  # fmt: skip
    return b.assemble({"crank_angle": phi, "coupler_joint": psi - phi, "rocker_angle": chi}, hold=["crank_angle"])


# 3. Questions: the same from the closed form and from the engines.

ANGLES = ("coupler_angle", "rocker_angle")


def _named(values: dict[str, Any]) -> dict[str, Any]:
    """Both spellings of a rate: coupler_rate and coupler_angle_rate."""
    short = {k.replace("_angle_", "_"): v for k, v in values.items() if "_angle_" in k}
    return values | short


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    found = closed_form.solve(*p.lengths, given["crank_angle"], given["crank_rate"], given["crank_accel"], mode=p.mode)
    if not np.all(found.assembles):
        gap = float(np.max(np.where(found.assembles, 0.0, found.gap)))
        return Answer(
            status=Status.NO_ASSEMBLY, notes=(f"the bars are {gap:.6g} m short of meeting",), details={"gap": gap}
        )
    values: dict[str, Any] = {}
    for bar in ("coupler", "rocker"):
        values[f"{bar}_angle"] = getattr(found, f"{bar}_angle")
        values[f"{bar}_angle_rate"] = getattr(found, f"{bar}_rate")
        values[f"{bar}_angle_accel"] = getattr(found, f"{bar}_accel")
    status = Status.SOLVED if np.all(found.regular) else Status.BOUNDARY
    return Answer(_named(values | {"transmission_angle": found.transmission_angle}), status)


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    names = [f"{a}{s}" for a in ANGLES for s in ("", "_rate", "_accel")]
    asked = {
        "crank_angle": given["crank_angle"],
        "crank_angle_rate": given["crank_rate"],
        "crank_angle_accel": given["crank_accel"],
    }
    answer = engine_answer(engine, build(p, "minimal"), asked, names)
    return Answer(_named(answer.values), answer.status, answer.notes, cannot=answer.cannot)


def _pinocchio(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return _engine("pinocchio", p, given)


def _mujoco(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return _engine("mujoco", p, given)


QUESTION = Question(
    "pose",
    given=("crank_angle",),
    optional={"crank_rate": 0.0, "crank_accel": 0.0},
    answers=("coupler_angle", "rocker_angle", "coupler_rate", "rocker_rate", "coupler_accel", "rocker_accel"),
    witnesses={"analytic": _analytic, "pinocchio": _pinocchio, "mujoco": _mujoco},
    angles=ANGLES,
    units={"crank_angle": "rad", "crank_rate": "rad/s", "crank_accel": "rad/s2"},
    text="angles, rates and accelerations of coupler and rocker from those of the crank",
)

# 4. Scenes, and the closed form to hold them against.


def _scene(name: str, p: Parameters, fidelity: str) -> Scene:
    laws: dict[str, tuple[Law, ...]] = {
        "driven-crank": (Servo("crank_angle", Ramp(start_angle(p), p.speed), stiffness=200.0, damping=2.0),),
        "free-run": (),
        "constant-torque": (Constant("crank_angle", p.torque),),
    }
    start = 0.0 if name == "constant-torque" else p.speed
    # under a constant torque the crank gets fast: 200 rad/s after 2 s
    settings = Settings(timestep=2.5e-4) if name == "constant-torque" else Settings()
    at, rate = {"crank_angle": start_angle(p)}, {"crank_angle": start}
    return Scene(name, fidelity, 2.0, laws[name], at, rate, tolerance=1e-4, settings=settings)


def _driven(p: Parameters, fidelity: str) -> Scene:
    return _scene("driven-crank", p, fidelity)


def _free(p: Parameters, fidelity: str) -> Scene:
    return _scene("free-run", p, fidelity)


def _torque(p: Parameters, fidelity: str) -> Scene:
    return _scene("constant-torque", p, fidelity)


class _CrankPlant:
    """The crank of the one-freedom model as a law sees it."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.t, self.phi, self.w = mechanism, 0.0, 0.0, 0.0

    def value(self, name: str) -> float:
        return self.phi

    def rate(self, name: str) -> float:
        return self.w


def _moment(p: Parameters, length: float) -> float:
    """Of a round bar about its middle, across: m (L^2 / 12 + r^2 / 4), its radius a quarter of the drawn width [kg m2]."""
    radius = 0.25 * _width(p, length)
    return p.mass_per_length * length * (length**2 / 12.0 + radius**2 / 4.0)


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-12) -> Recording:
    """Own equation of the one freedom (Eksergian), integrated by DOP853 to 1e-12."""
    m = build(p, "minimal")
    moments = (_moment(p, p.crank), _moment(p, p.coupler), _moment(p, p.rocker))
    bar = FourbarCrank(*p.lengths, p.mode, p.mass_per_length, p.gravity, moments)
    plant: Any = _CrankPlant(m)

    def slope(t: float, y: Array) -> Array:
        plant.t, plant.phi, plant.w = t, float(y[0]), float(y[1])
        torque = sum(law.force(t, plant).get("crank_angle", 0.0) for law in scene.laws)
        return np.array([plant.w, bar.acceleration(plant.phi, plant.w, torque)])

    def states(y: Array) -> tuple[Array, Array]:
        phi, rate = y.T
        pose = closed_form.solve(*p.lengths, phi, rate, mode=p.mode)
        coupler, rocker = np.unwrap(pose.coupler_angle) - phi, np.unwrap(pose.rocker_angle)
        values = {"crank_angle": phi, "coupler_joint": coupler, "rocker_angle": rocker}
        rates = {"crank_angle": rate, "coupler_joint": pose.coupler_rate - rate, "rocker_angle": pose.rocker_rate}
        q = np.column_stack([values[j.name] - j.zero for j in m.joints])
        q -= 2 * np.pi * np.round(q[0] / (2 * np.pi))
        return q, np.column_stack([rates[j.name] for j in m.joints])

    start = np.array([scene.initial["crank_angle"], scene.initial_rates["crank_angle"]])
    return record_own(m, scene, slope, start, states, method, tolerance)


# 5. Checks: each compares witnesses that do not share code.


def _check_pose(p: Parameters) -> Measured:
    limits = closed_form.crank_limits(*p.lengths)
    if not limits.full_turn and not limits.ranges:
        return Measured({}, 0.0, note="no assembly exists with these lengths")
    low, high = (-math.pi, math.pi) if limits.full_turn else limits.ranges[0]
    grid = np.linspace(low, high, 9)[1:-1]
    said: dict[str, list[Any]] = {"analytic": [], "pinocchio": [], "mujoco": []}
    for phi in grid:
        given = {"crank_angle": float(phi), "crank_rate": 1.3, "crank_accel": -0.7}
        for witness, ask in QUESTION.witnesses.items():
            values = ask(p, given).values
            row = [math.sin(values["coupler_angle"]), math.cos(values["rocker_angle"])]
            said[witness].append([*row, *(values[k] for k in QUESTION.answers[2:])])
    return Measured(said, 1e-8, note="coupler and rocker at 7 crank angles: angles, rates, accelerations")


def _check_energy(p: Parameters) -> Measured:
    from mechlab.simulate import run as run_mujoco
    from mechlab.solve import run as run_pinocchio

    scene = _free(p, "minimal")
    expected = reference(p, scene).channel("crank_angle_rate")[-1]
    settings = Settings(timestep=7e-4)
    end = {
        "mujoco": run_mujoco(build(p, "minimal"), scene, settings).channel("crank_angle_rate")[-1],
        "pinocchio": run_pinocchio(build(p, "minimal"), scene, Settings(engine="pinocchio", timestep=7e-4)).channel(
            "crank_angle_rate"
        )[-1],
    }
    # MuJoCo's loop is soft to second order in the step: 1e-5 relative at 0.7 ms, in a motion of a few turns.
    return Measured(end, 1e-4 * max(1.0, abs(p.speed)), expected, "crank speed after a free run of 2 s")


def _check_limits(p: Parameters) -> Measured:
    """Where the crank can stand, of this four-bar and of two that only rock: by trying, then halving the step at each end."""
    expected, found = [], []
    for crank, coupler, rocker, ground in (p.lengths, (1.0, 0.8, 0.5, 1.1), (0.9, 0.6, 1.2, 1.0)):
        ranges = closed_form.crank_limits(crank, coupler, rocker, ground).ranges
        expected += [x for pair in ranges for x in pair]
        found += _tried(crank, coupler, rocker, ground, [0.5 * (a + b) for a, b in ranges])
    # The closure itself is blurred where the bars stretch: sqrt(1e-12).
    return Measured({"tried": found}, 1e-6, expected, "ends of the ranges of the crank [rad]")


def _tried(crank: float, coupler: float, rocker: float, ground: float, middles: list[float]) -> list[float]:
    """Low and high end of the range about each middle, at most half a turn away."""

    def closes(angle: float) -> bool:
        far = math.hypot(ground - crank * math.cos(angle), crank * math.sin(angle))
        return abs(coupler - rocker) <= far <= coupler + rocker

    out = []
    for middle in middles:
        for sign in (-1.0, 1.0):
            inside, step = 0.0, 1e-3
            while step > 1e-9:
                if inside + step <= math.pi and closes(middle + sign * (inside + step)):
                    inside += step
                else:
                    step *= 0.5
            out.append(middle + sign * inside)
    return out


def _check_sides(p: Parameters) -> Measured:
    """The angle at C and what is missing where C does not exist, from the distance of B and D; also of a four-bar that rocks."""
    said, expected, phi = list[Any](), list[Any](), np.linspace(-3.0, 3.0, 13)
    for crank, coupler, rocker, ground in (p.lengths, (1.0, 0.8, 0.5, 1.1)):
        found = closed_form.solve(crank, coupler, rocker, ground, phi, mode=p.mode)
        far = np.abs(ground - crank * np.exp(1j * phi))
        missing = np.maximum(np.maximum(far - coupler - rocker, abs(coupler - rocker) - far), 0.0)
        cosine = (coupler**2 + rocker**2 - far**2) / (2.0 * coupler * rocker)
        said += [np.where(found.assembles, found.transmission_angle, 0.0), found.gap]
        expected += [np.where(missing > 0.0, 0.0, np.arccos(np.clip(cosine, -1.0, 1.0))), missing]
    # Where the bars stretch the cosine blurs the angle: sqrt(1e-16).
    return Measured({"analytic": said}, 1e-7, expected, "transmission angle [rad], gap [m] at 13 crank angles")


def _check_masses(p: Parameters) -> Measured:
    m, gravity, pairs = build(p, "minimal"), (0.0, 0.0, -p.gravity), list[mass_check.Pair]()
    start, limits = start_angle(p), closed_form.crank_limits(*p.lengths)
    room = 1.0 if limits.full_turn or not limits.ranges else limits.ranges[0][1] - start
    for phi, rate in ((start, 1.3), (start + 0.3 * room, -0.7)):
        pose = closed_form.solve(*p.lengths, phi, rate, mode=p.mode).require()
        psi, chi, turn, swing = (
            float(x) for x in (pose.coupler_angle, pose.rocker_angle, pose.coupler_rate, pose.rocker_rate)
        )
        place = {"A": 0.0, "B": cmath.rect(p.crank, phi), "C": p.ground + cmath.rect(p.rocker, chi), "D": p.ground}
        speed = {"A": 0.0, "B": 1j * rate * place["B"], "C": 1j * swing * (place["C"] - p.ground), "D": 0.0}
        at, going = ({n: np.array([z.real, 0.0, z.imag]) for n, z in table.items()} for table in (place, speed))
        particles = mass_check.NOTHING
        for a, b, length in (("A", "B", p.crank), ("B", "C", p.coupler), ("D", "C", p.rocker)):
            mass, radius = p.mass_per_length * length, 0.25 * _width(p, length)
            particles += mass_check.rod(mass, at[a], at[b], going[a], going[b], radius)
        values = {"crank_angle": phi, "coupler_joint": psi - phi, "rocker_angle": chi, "coupler_angle": psi}
        rates = {"crank_angle": rate, "coupler_joint": turn - rate, "rocker_angle": swing, "coupler_angle": turn}
        points = {"B": at["B"], "C": at["C"], "middle": (at["B"] + at["C"]) / 2.0}
        pairs.append((m, mass_check.State(values, rates, particles, points, gravity, 1, is_reference=not pairs)))
    return mass_check.compare(pairs)


CHECKS = (
    Check("F1", "position, rate and acceleration from three witnesses", _check_pose, "closed form of the RRR dyad"),
    Check("F2", "free run against the equation of the one freedom", _check_energy, "Eksergian equation, DOP853"),
    Check("F3", "range of the crank", _check_limits, "by trying"),
    Check("F4", "transmission angle and gap", _check_sides, "law of cosines"),
    Check("F5", mass_check.TEXT, _check_masses, mass_check.SOURCE),
)


def _remarks(p: Parameters) -> tuple[str, ...]:
    limits = closed_form.crank_limits(*p.lengths)
    arcs = ", ".join(f"{math.degrees(a):.6g} to {math.degrees(b):.6g} deg" for a, b in limits.ranges)
    swing = "" if limits.full_turn else f"; it assembles at crank angles {arcs}" if arcs else "; it assembles nowhere"
    return (f"Grashof: {closed_form.grashof_class(*p.lengths).value}{swing}.",)


ENTRY = Entry(
    name="fourbar",
    title="Four-bar linkage",
    summary="Planar four-bar: crank, coupler, rocker; both assembly modes.",
    parameters=Parameters,
    build=build,
    fidelities={"kinematic": "closed form", "minimal": "three bars, one loop; exact dynamics"},
    default_fidelity="minimal",
    scenes={
        "driven-crank": SceneRecipe(_driven, "minimal", "a servo turns the crank at constant speed"),
        "free-run": SceneRecipe(_free, "minimal", "the crank is let go at full speed"),
        "constant-torque": SceneRecipe(_torque, "minimal", "a constant torque starts the crank from rest"),
    },
    default_scene="driven-crank",
    sliders=("crank", "coupler"),
    questions=(QUESTION,),
    checks=CHECKS,
    reference=reference,
    remarks=_remarks,
    chain="RRRR",
    formulas="Dyad RRR: C = D + rocker (cos, sin)(rocker_angle), on the side `mode` of B to D; rates from the loop equation.",
    sources=("Freudenstein 1955", "Eksergian 1930"),
)
