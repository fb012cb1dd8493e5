"""The class IV linkage as a Mechanism (five bars, two loops, one freedom), and its scenes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mechlab.catalog.class4_linkage.geometry import Class4Parameters, at, motion_at, start_angle
from mechlab.errors import MechlabError
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import ComputedTorque, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import closed_form_recording
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

NAMES = {f"link{k}": f"theta{k}" for k in (2, 3, 4, 5)}
START_OFFSET = 1e-3
"""Distance [rad] of the engines' start from the closed form, in every coordinate: it keeps the mode, not the answer."""


def style(p: Class4Parameters) -> Style:
    """Masses and looks. The drive of the files: a soft servo."""
    return Style(
        p.mass_per_length, gravity=p.gravity, width=0.05, names=NAMES, drive_stiffness=2000.0, drive_damping=200.0
    )


@lru_cache(maxsize=32)
def build(p: Class4Parameters, fidelity: str) -> Mechanism:
    """Five bars and two pins, assembled at the start angle in the chosen mode. Raises NoSolution when it never closes."""
    angle = start_angle(p)
    chain, motion = motion_at(p, angle)
    summary = "class IV linkage (Stephenson chain, driven in its five-bar side)"
    return mechanism_of(chain, {"crank": angle}, style(p), summary, motion)


def pose(p: Class4Parameters, m: Mechanism, angle: float) -> Array:
    """(nq,) coordinates of the chosen mode at a crank angle, from the closed form."""
    theta = {k: float(v.x) for k, v in at(p, angle).angles.items()}
    value = {
        "crank_angle": angle, "link2_joint": theta["theta2"] - angle, "link3_joint": theta["theta3"] - theta["theta2"],
        "link4_joint": theta["theta4"] - theta["theta2"], "theta5": theta["theta5"],
    }  # fmt: skip
    return np.array([value[j.name] - j.zero for j in m.joints])


DRIVEN = Settings(timeconst=4.0)
"""Settings of driven cranks. Loops of time constant 4 h instead of 2 h: RK4 resolves their own motion, so they ring
less under an acceleration that a law prescribes, and rates of the table come out nine times better (2.1e-6 instead of
1.9e-5 rad/s at 1 ms, MuJoCo 4.0.0)."""
FREE = Settings(timestep=2.5e-4)
"""Settings of free motion: the step-error estimate of the run is within the tolerance of the scene."""

FOLD_BC = 0.27
"""With this length of link 3 the linkage does not close between -104.26 and -75.74 deg of the crank."""


def driven(p: Class4Parameters, fidelity: str) -> Scene:
    """The crank follows a steady turn by inverse dynamics: what differs from the closed form is the engine, not the drive."""
    start = start_angle(p)
    ramp = Ramp(start, p.speed)
    law = ComputedTorque(("crank_angle",), (("crank_angle", ramp),), ((1e4, 200.0),))
    turn = 2 * np.pi / abs(p.speed) if p.speed else 1.0
    return Scene(
        "driven-crank", fidelity, turn, (law,), {"crank_angle": start}, {"crank_angle": p.speed}, tolerance=1e-5,
        settings=DRIVEN,
    )  # fmt: skip


def free(p: Class4Parameters, fidelity: str) -> Scene:
    """The crank is let go at one turn per second, under its own weight."""
    start = start_angle(p)
    return Scene(
        "free-run", fidelity, 2.0, (), {"crank_angle": start}, {"crank_angle": 2 * np.pi}, tolerance=1e-4, settings=FREE,
        drives="free",
    )  # fmt: skip


def fold(p: Class4Parameters, fidelity: str) -> Scene:
    """A stiff servo drives the crank on, through the arc where nothing closes."""
    start = start_angle(p)
    law = Servo("crank_angle", Ramp(start, p.speed), stiffness=2e5, damping=30.0)
    turn = 2 * np.pi / abs(p.speed) if p.speed else 1.0
    return Scene(
        "into-the-fold",
        fidelity,
        turn,
        (law,),
        {"crank_angle": start},
        {"crank_angle": p.speed},
        settings=Settings(timestep=5e-4),
    )


def reference(p: Class4Parameters, scene: Scene) -> Recording:
    """The driven turn in closed form, with the crank exactly on its ramp. Raises MechlabError for a scene without that
    ramp, NoSolution where nothing closes."""
    law = scene.laws[0] if scene.laws else None
    motion = law.commands[0][1] if isinstance(law, ComputedTorque) else getattr(law, "motion", None)
    if not isinstance(motion, Ramp):
        raise MechlabError(f"class4_linkage: scene {scene.name!r} has no closed form; engines: mujoco, pinocchio.")
    m = build(p, "minimal")
    t = np.linspace(0.0, scene.duration, 1441)
    angle = motion.value + motion.rate * t
    mode = at(p, angle, motion.rate)
    theta = {n: np.unwrap(s.x) for n, s in mode.angles.items()}
    rate = {n: s.v for n, s in mode.angles.items()}
    value = {"crank_angle": angle, "theta5": theta["theta5"], "link2_joint": theta["theta2"] - angle}
    speed = {
        "crank_angle": np.full(len(t), motion.rate),
        "theta5": rate["theta5"],
        "link2_joint": rate["theta2"] - motion.rate,
    }
    for k in (3, 4):
        value[f"link{k}_joint"] = theta[f"theta{k}"] - theta["theta2"]
        speed[f"link{k}_joint"] = rate[f"theta{k}"] - rate["theta2"]
    q = np.column_stack([value[j.name] - j.zero for j in m.joints])
    q -= 2 * np.pi * np.round(q[0] / (2 * np.pi))
    v = np.column_stack([speed[j.name] for j in m.joints])
    return closed_form_recording(m, scene, t, q, v)


SCENES = {
    "driven-crank": SceneRecipe(driven, "minimal", "the crank turns steadily from -180 deg, as in the table of the source"),
    "free-run": SceneRecipe(free, "minimal", "the crank is let go at one turn per second"),
    "into-the-fold": SceneRecipe(
        fold, "minimal", "BC = 0.27 m: a stiff servo drives the crank into the limit position; the run must stop",
        {"BC": FOLD_BC},
    ),
}  # fmt: skip
