"""Parts of the entries of planetary gears, all about the z axis: discs, planets on a circle, runs under constant
torques, moving states as particles, and checks of speeds, masses and redundant meshes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.planetary_stage import conditions
from mechlab.engines.protocol import engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.laws import Constant
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import closed_form_recording, moving_in_fidelities
from mechlab.kit.mass_check import Particles, State, solid, spread_of
from mechlab.kit.questions import for_engines
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import ConstraintSet, Inertia, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space, rank

FIDELITIES = ("minimal", "parts", "full")


def disc(inertia: float, radius: float) -> Inertia:
    """A flat disc of this radius [m] with the given moment about z [kg m2]."""
    return Inertia.axial(2.0 * inertia / radius**2, inertia, 0.5 * inertia)


def azimuth(k: int, planets: int) -> float:
    """Angle [rad] of the axis of planet k about the sun: 2 pi k / planets."""
    return 2.0 * math.pi * k / planets


def on_circle(radius: float, angle: float, height: float = 0.0) -> tuple[float, float, float]:
    """A point [m] on a circle about the z axis."""
    return radius * math.cos(angle), radius * math.sin(angle), height


def constant_torques(fidelity: str, torques: Mapping[str, float]) -> Scene:
    """The scene of 0.5 s from rest under constant torques [N m] on joints or shafts."""
    laws = tuple(Constant(name, torque) for name, torque in torques.items())
    tolerance = 1e-6 if fidelity == "minimal" else 1e-4  # with a row for each mesh, MuJoCo's soft rows slip
    return Scene("constant-torques", fidelity, 0.5, laws, needs=("poses", "drive_forces"), tolerance=tolerance)


def steady_recording(m: Mechanism, accelerations: Mapping[str, float], scene: Scene) -> Recording:
    """The closed form of `constant_torques` in the minimal model: q = a t^2 / 2; accelerations: joint -> a [rad/s2]."""
    a = np.array([accelerations[j.name] for j in m.joints])
    t = np.linspace(0.0, scene.duration, 251)
    q, v = 0.5 * t[:, None] ** 2 * a, t[:, None] * a
    return closed_form_recording(m, scene, t, q, v)


def engine_speeds(
    engine: str, m: Mechanism, given: Mapping[str, Any], members: Sequence[str], planets: Mapping[str, str]
) -> Answer:
    """Absolute speeds [rad/s] from the constraint rows of a model, by one engine.

    planets: key of the answer -> joint of the planet. Its rate is relative to the carrier, whose rate is added.
    """
    joints = [f"{name}_rate" for name in planets.values()]
    found = engine_answer(engine, m, {k: float(x) for k, x in given.items()}, [*members, *joints])
    if found.cannot:
        return found
    rates = dict(found.values)
    for key, joint in planets.items():
        rates[key] = rates.pop(f"{joint}_rate") + rates["carrier_rate"]
    return Answer({k: x for k, x in rates.items() if k not in given}, found.status, found.notes)


def speed_question(
    given: tuple[str, ...],
    members: Sequence[str],
    analytic: Callable[[Any, Mapping[str, Any]], Answer],
    engine: Callable[[str, Any, Mapping[str, Any]], Answer],
) -> Question:
    """The question for the absolute speeds of all members from some of them, by three witnesses."""
    answers = tuple(k for k in members if k not in given)
    units = dict.fromkeys(members, "rad/s")
    text = "absolute speeds of all members"
    return Question(f"speeds from {' and '.join(given)}", given, answers, {"analytic": analytic} | for_engines(engine),
                    text=text, units=units)  # fmt: skip


def measured_speeds(
    p: Any, questions: Sequence[Question], values: Sequence[float], tolerance: float, note: str
) -> CheckResult:
    """Compares the speeds of all members between witnesses; each question takes its given speeds from `values`
    [rad/s]."""
    measured: dict[str, list[float]] = {}
    for question in questions:
        given = dict(zip(question.given, values, strict=True))
        for witness, ask in question.witnesses.items():
            found = ask(p, given).values
            measured.setdefault(witness, []).extend(float(found[k]) for k in question.answers)
    return CheckResult(measured, tolerance, note=note)


def reduced_masses(models: Mapping[str, Mechanism], names: Sequence[str]) -> dict[str, Array]:
    """Model -> mass matrix (n, n) [kg m2], reduced to the speeds of n joints or shafts that determine the motion."""
    out = {}
    for label, m in models.items():
        tree = TreeKinematics(m)
        basis = null_space(ConstraintSet(m).jacobian(tree))
        basis = basis @ np.linalg.inv(np.array([m.row(n) for n in names]) @ basis)
        out[label] = basis.T @ tree.mass_matrix() @ basis
    return out


def final_rates(build: Callable[[str], Mechanism], scene: Callable[[str], Scene], member: str) -> dict[str, float]:
    """Rate of a member at the end of the scene [rad/s]: MuJoCo in every fidelity, Pinocchio in the richest."""
    measured = {f"mujoco {f}": engine("mujoco").run(build(f), scene(f), Settings()) for f in FIDELITIES}
    measured["pinocchio full"] = engine("pinocchio").run(build("full"), scene("full"), Settings(engine="pinocchio"))
    return {k: float(recording.channel(f"{member}_rate")[-1]) for k, recording in measured.items()}


def distance(mechanism: Mechanism, one: str, other: str) -> float:
    """Distance [m] between the origins of two bodies in the reference pose."""
    tree = TreeKinematics(mechanism)
    return float(np.linalg.norm(tree.pose(one)[1] - tree.pose(other)[1]))


def inertia_check(
    id: str,
    text: str,
    build: Callable[[Any, str], Mechanism],
    members: Sequence[str],
    expected: Callable[[Any], ArrayLike],
    note: str,
    change: Callable[[Any], Any] = lambda p: p,
) -> Check:
    """Mass matrix in the speeds of members in each fidelity, over the largest entry of the closed form [kg m2]. change: the
    parameters that are looked at."""

    def run(p: Any) -> CheckResult:
        design = change(p)
        truth = np.atleast_2d(np.asarray(expected(design), dtype=float))
        masses = reduced_masses({f: build(design, f) for f in FIDELITIES}, members)
        values = {f: np.squeeze(m / truth.max()) for f, m in masses.items()}
        return CheckResult(values, 1e-12, np.squeeze(truth / truth.max()), note)

    return Check(id, text, run, "Lagrange")


def torque_check(
    id: str,
    build: Callable[[Any, str], Mechanism],
    scene: Callable[[Any, str], Scene],
    member: str,
    acceleration: Callable[[Any], float],
    relative: bool = False,
) -> Check:
    """Speed of a member [rad/s] after the scene of constant torques in every fidelity, against its acceleration [rad/s2]."""

    def run(p: Any) -> CheckResult:
        found = final_rates(lambda f: build(p, f), lambda f: scene(p, f), member)
        expected = 0.5 * acceleration(p)
        if relative:
            # RK4 is exact for a constant acceleration; soft rows take at most one time constant (2 ms) to take up their slip.
            note = f"{member} speed after 0.5 s, relative to {expected:.6g} rad/s"
            return CheckResult({k: x / expected for k, x in found.items()}, 1e-5, 1.0, note)
        # Softness of MuJoCo's gear rows: slip below 1e-6 rad, its rate well below 1e-4 rad/s; the minimal model has no rows.
        return CheckResult(found, 1e-4, expected, f"{member} speed after 0.5 s under constant torques [rad/s]")

    return Check(id, "run under constant torques against the closed form", run, "Lagrange")


def neighbour_check(id: str, build: Callable[[Any, str], Mechanism]) -> Check:
    """Distance of two planets as they stand, less their tip radii; the teeth begin with sun, planet, ring."""

    def run(p: Any) -> CheckResult:
        if p.planets == 1:
            return CheckResult({"drawn": np.zeros(0)}, 1e-9, np.zeros(0), "one planet has no neighbour")
        apart = distance(build(p, "full"), "planet_1", "planet_2")
        sun, planet, ring = p.teeth[:3]
        expected = conditions(sun, planet, ring, p.planets).neighbour_margin
        return CheckResult({"drawn": apart / p.module - planet - 2}, 1e-9, expected, "room between planets [modules]")

    return Check(id, "room between the planets", run, "chord of the planet axes")


def expand_by(
    build: Callable[[Any, str], Mechanism], values: Callable[[Any, Recording], Mapping[str, Array]]
) -> Callable[[Any, Recording], tuple[Mechanism, Array]]:
    """All planets along a recording of any fidelity; values(p, recording): joint of the full train -> angle (n,)."""

    def expand(p: Any, recording: Recording) -> tuple[Mechanism, Array]:
        full = build(p, "full")
        if recording.fidelity == "full":
            return full, recording.q
        angles = values(p, recording)
        return full, np.column_stack([angles[j.name] for j in full.joints])

    return expand


TURN, RATE = 0.7, 1.3
"""Angle [rad] and rate [rad/s] of the carrier in the moving state of a train; the gear ratios give the other
members."""


def wheel(mass: float, moment: float, rate: float, at: Array | None = None, orbit_rate: float = 0.0) -> Particles:
    """A flat part of revolution as particles: mass [kg], `moment` about its axis [kg m2], turning at `rate` [rad/s].

    Its axis is parallel to z through `at` (3,) [m], and orbits about z at `orbit_rate` [rad/s].
    """
    centre = np.zeros(3) if at is None else np.asarray(at, dtype=float)
    velocity = orbit_rate * np.array([-centre[1], centre[0], 0.0])
    spread = spread_of(mass, (0.5 * moment, 0.5 * moment, moment))
    return solid(mass, centre, spread, velocity=velocity, turn=(0.0, 0.0, rate))


def moving_disc(moment: float, radius: float, rate: float) -> Particles:
    """A uniform flat disc about the z axis as particles; mass = 2 moment / radius^2."""
    return wheel(2.0 * moment / radius**2, moment, rate)


def seats(radius: float, planets: int, turn: float = TURN) -> list[Array]:
    """Positions (3,) [m] of equally spaced planets when their carrier has turned by `turn` [rad]."""
    angles = (turn + 2.0 * math.pi * k / planets for k in range(planets))
    return [radius * np.array([math.cos(a), math.sin(a), 0.0]) for a in angles]


def train_state(turns: Mapping[str, float], particles: Particles, rotors: float = 0.0, freedoms: int = 1) -> State:
    """The moving state of a train without gravity and springs.

    turns: joint or shaft -> turns for one turn of the carrier; particles: the moving masses; rotors [kg m2]: inertia of
    the shafts reduced to the carrier.
    """
    angles, rates = ({n: x * c for n, c in turns.items()} for x in (TURN, RATE))
    return State(angles, rates, particles, {}, (0.0, 0.0, 0.0), freedoms, 0.5 * rotors * RATE**2)


def moving_check(name: str, build: Callable[[Any, str], Mechanism], state: Callable[[Any, str], State | None]) -> Check:
    """The check of a moving state as particles, in every fidelity."""
    return moving_in_fidelities(name, build, state, FIDELITIES)


def mesh_check(name: str, build: Callable[[Any, str], Mechanism], meshes: int, wheels: int) -> Check:
    """A check of the numbers of rows and redundant rows. Each group of planets on one ray has `meshes` and `wheels`.

    The first group makes the train; every further group adds (meshes - wheels) redundant rows, whose loads statics
    cannot determine.
    """

    def run(p: Any) -> CheckResult:
        measured: dict[str, list[int]] = {"numpy": [], "mujoco": []}
        expected: list[int] = []
        for fidelity, rays in (("parts", 1), ("full", int(p.planets))):
            m = build(p, fidelity)
            for who, numbers in measured.items():
                rows = engine(who).state(m, m.reference()).rows
                numbers += [len(rows), len(rows) - rank(rows)]
            expected += [rays * meshes, (rays - 1) * (meshes - wheels)]
        return CheckResult(measured, 0.0, expected, "rows and redundant rows: parts, full")

    return Check(name, "rows of the meshes, and how many repeat others", run, "count of meshes and wheels on a ray")
