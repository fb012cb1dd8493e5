"""What the entries of planetary gears share: discs, planets on a circle, runs under constant torques, their checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.experiment.check import Measured
from mechlab.experiment.laws import Constant
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism import ConstraintSet, Inertia, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space
from mechlab.study.witness import engine_answer

FIDELITIES = ("minimal", "parts", "full")


def disc(inertia: float, radius: float) -> Inertia:
    """A flat disc of this radius [m] with the given moment about z [kg m2]."""
    return Inertia.axial(2.0 * inertia / radius**2, inertia, 0.5 * inertia)


def azimuth(k: int, planets: int) -> float:
    """Angle of the axis of planet k round the sun [rad]."""
    return 2.0 * math.pi * k / planets


def on_circle(radius: float, angle: float, height: float = 0.0) -> tuple[float, float, float]:
    """A point on a circle round the z axis [m]."""
    return radius * math.cos(angle), radius * math.sin(angle), height


def constant_torques(fidelity: str, torques: Mapping[str, float]) -> Scene:
    """Half a second from rest under constant torques [N m] on joints or shafts."""
    laws = tuple(Constant(name, torque) for name, torque in torques.items())
    tolerance = 1e-6 if fidelity == "minimal" else 1e-4  # with a row for each mesh, MuJoCo's soft rows slip
    return Scene("constant-torques", fidelity, 0.5, laws, needs=("poses", "drive_forces"), tolerance=tolerance)


def steady_recording(m: Mechanism, accelerations: Mapping[str, float], scene: Scene) -> Recording:
    """The closed form of such a run in the minimal model: q = a t^2 / 2 for accelerations by joint [rad/s2]."""
    a = np.array([accelerations[j.name] for j in m.joints])
    t = np.linspace(0.0, scene.duration, 251)
    q, v = 0.5 * t[:, None] ** 2 * a, t[:, None] * a
    channels, units = basic_channels(m, q, v)
    how = Settings(engine="analytic")
    return Recording(m, t, q, v, channels, units, settings=how, scene=scene.name, fidelity="minimal")


def engine_speeds(
    engine: str, m: Mechanism, given: Mapping[str, Any], members: Sequence[str], planets: Mapping[str, str]
) -> Answer:
    """Absolute speeds from the constraint Jacobian of a model with rows. A planet's joint counts from the carrier; planets:
    key of the answer -> joint."""
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
    """Absolute speeds of all members from some of them, asked of three witnesses."""
    witnesses = {
        "analytic": analytic,
        "pinocchio": lambda p, asked: engine("pinocchio", p, asked),
        "mujoco": lambda p, asked: engine("mujoco", p, asked),
    }
    answers = tuple(k for k in members if k not in given)
    units = dict.fromkeys(members, "rad/s")
    text = "absolute speeds of all members"
    return Question(f"speeds from {' and '.join(given)}", given, answers, witnesses, text=text, units=units)


def measured_speeds(
    p: Any, questions: Sequence[Question], values: Sequence[float], tolerance: float, note: str
) -> Measured:
    """All members from each pair (or one) of speeds, from all witnesses of the questions."""
    said: dict[str, list[float]] = {}
    for question in questions:
        given = dict(zip(question.given, values, strict=True))
        for witness, ask in question.witnesses.items():
            found = ask(p, given).values
            said.setdefault(witness, []).extend(float(found[k]) for k in question.answers)
    return Measured(said, tolerance, note=note)


def reduced_masses(models: Mapping[str, Mechanism], names: Sequence[str]) -> dict[str, Array]:
    """Mass matrix (n, n) of each model in the speeds of n joints or shafts that fix it [kg m2]."""
    out = {}
    for label, m in models.items():
        tree = TreeKinematics(m)
        basis = null_space(ConstraintSet(m).jacobian(tree))
        basis = basis @ np.linalg.inv(np.array([m.row(n) for n in names]) @ basis)
        out[label] = basis.T @ tree.mass_matrix() @ basis
    return out


def final_rates(build: Callable[[str], Mechanism], scene: Callable[[str], Scene], member: str) -> dict[str, float]:
    """Rate of a member at the end of the scene [rad/s]: MuJoCo in every fidelity, Pinocchio in the richest."""
    from mechlab.simulate import run as run_mujoco
    from mechlab.solve import run as run_pinocchio

    said = {f"mujoco {f}": run_mujoco(build(f), scene(f), Settings()) for f in FIDELITIES}
    said["pinocchio full"] = run_pinocchio(build("full"), scene("full"), Settings(engine="pinocchio"))
    return {k: float(recording.channel(f"{member}_rate")[-1]) for k, recording in said.items()}


def distance(mechanism: Mechanism, one: str, other: str) -> float:
    """Distance of the origins of two bodies in the reference pose [m]."""
    tree = TreeKinematics(mechanism)
    return float(np.linalg.norm(tree.pose(one)[1] - tree.pose(other)[1]))
