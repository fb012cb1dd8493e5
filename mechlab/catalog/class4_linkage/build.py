"""The class IV linkage as a Mechanism (five bars, two loops, one freedom); its scenes and their motion in closed form; the
question for every assembly mode at a crank angle.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.catalog.class4_linkage.geometry import (
    THETAS,
    Class4Parameters,
    Mode,
    arcs,
    at,
    describe_mode,
    group,
    label,
    motion_at,
    solve_all,
    start_angle,
)
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import ComputedTorque, Law, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import closed_form_recording
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.kit.planar_entry import DRIVEN, FREE, START_OFFSET
from mechlab.kit.questions import by_engines, with_orders
from mechlab.mechanism import Mechanism, Status
from mechlab.mechanism.geometry import Array

NAMES = {f"link{k}": f"theta{k}" for k in (2, 3, 4, 5)}
ANSWERS = tuple(with_orders({n: n for n in THETAS}))
GIVEN = {"crank_angle": "crank_angle", "crank_rate": "crank_angle_rate", "crank_accel": "crank_angle_accel"}
MERGING = 1e-9
"""|det J| relative to the size of the group to the fourth, below which two modes are reported to merge."""
FOLD_BC = 0.27
"""With this length of link 3 the linkage does not close between -104.26 and -75.74 deg of the crank."""


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


def joint_values(m: Mechanism, crank: Any, theta: Mapping[str, Any]) -> Array:
    """(..., joints) of the joints in their order, from the absolute angles of crank and links; the same for rates."""
    relative = {
        "crank_angle": crank, "link2_joint": theta["theta2"] - crank, "link3_joint": theta["theta3"] - theta["theta2"],
        "link4_joint": theta["theta4"] - theta["theta2"], "theta5": theta["theta5"],
    }  # fmt: skip
    return np.stack([np.asarray(relative[j.name]) for j in m.joints], axis=-1)


def pose(p: Class4Parameters, m: Mechanism, angle: float) -> Array:
    """(nq,) coordinates of the chosen mode at a crank angle, from the closed form."""
    theta = {n: s.x for n, s in at(p, angle).angles.items()}
    return np.asarray(joint_values(m, angle, theta) - [j.zero for j in m.joints])


def _turn(p: Class4Parameters) -> float:
    """Duration of one crank turn [s]; 1 s for a crank at rest."""
    return 2 * np.pi / abs(p.speed) if p.speed else 1.0


def driven(p: Class4Parameters, fidelity: str) -> Scene:
    """The crank follows a steady turn by inverse dynamics: what differs from the closed form is the engine, not the drive."""
    start = start_angle(p)
    law = ComputedTorque(("crank_angle",), (("crank_angle", Ramp(start, p.speed)),), ((1e4, 200.0),))
    return _scene("driven-crank", fidelity, _turn(p), law, start, p.speed, tolerance=1e-5, settings=DRIVEN)


def free(p: Class4Parameters, fidelity: str) -> Scene:
    """The crank is let go at one turn per second, under its own weight."""
    start = start_angle(p)
    return _scene("free-run", fidelity, 2.0, None, start, 2 * np.pi, tolerance=1e-4, settings=FREE, drives="free")


def fold(p: Class4Parameters, fidelity: str) -> Scene:
    """A stiff servo drives the crank on, through the arc where nothing closes."""
    start = start_angle(p)
    law = Servo("crank_angle", Ramp(start, p.speed), stiffness=2e5, damping=30.0)
    return _scene("into-the-fold", fidelity, _turn(p), law, start, p.speed, settings=Settings(timestep=5e-4))


def _scene(
    name: str, fidelity: str, duration: float, law: Law | None, angle: float, rate: float, **options: Any
) -> Scene:
    laws = (law,) if law else ()
    return Scene(name, fidelity, duration, laws, {"crank_angle": angle}, {"crank_angle": rate}, **options)


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
    q = joint_values(m, angle, theta) - [j.zero for j in m.joints]
    q -= 2 * np.pi * np.round(q[0] / (2 * np.pi))
    v = joint_values(m, np.full(len(t), motion.rate), {n: s.v for n, s in mode.angles.items()})
    return closed_form_recording(m, scene, t, q, v)


SCENES = {
    "driven-crank": SceneRecipe(driven, "minimal", "the crank turns steadily from -180 deg, at the crank speed of the source"),
    "free-run": SceneRecipe(free, "minimal", "the crank is let go at one turn per second"),
    "into-the-fold": SceneRecipe(
        fold, "minimal", "BC = 0.27 m: a stiff servo drives the crank into the limit position; the run must stop",
        {"BC": FOLD_BC},
    ),
}  # fmt: skip


def _flat(mode: Mode) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in THETAS:
        s = mode.angles[name]
        out |= {name: s.x, f"{name}_rate": s.v, f"{name}_accel": s.a}
    return out


def _one(mode: Mode, title: str) -> dict[str, Any]:
    values = {k: float(v) for k, v in _flat(mode).items()}
    points = {n: [float(p.p.real), float(p.p.imag)] for n, p in mode.points.items()}
    return {"label": title, **values, "points": points, "K1": int(mode.k1), "K2": int(mode.k2), "det": float(mode.det)}


def _no_assembly(p: Class4Parameters, angle: np.ndarray) -> Answer:
    """The answer where a crank angle has no assembly; it names the arc around the first such angle."""
    flat = np.atleast_1d(angle)
    bad = next((float(a) for a in flat.ravel() if solve_all(p, float(a)).chosen < 0), float(flat.ravel()[0]))
    for low, high in arcs(p):
        if (bad - low) % (2 * np.pi) <= high - low:
            turns = 2 * np.pi * np.floor((bad - low) / (2 * np.pi))
            a, b = low + turns, high + turns
            text = (
                f"no assembly exists between the crank angles {np.degrees(a):.7f} deg and {np.degrees(b):.7f} deg, where two "
                f"modes merge (det J = 0); {np.degrees(bad):.6g} deg lies inside"
            )
            return Answer(status=Status.NO_ASSEMBLY, notes=(text,), details={"gap": [a, b], "modes": []})
    return Answer(status=Status.NO_ASSEMBLY, notes=("no mode closes here",), details={"modes": []})


def analytic(p: Class4Parameters, given: Mapping[str, Any]) -> Answer:
    """Every mode by the polynomial of degree 6; over arrays of crank angles the chosen mode, and how many there are."""
    angle, rate, accel = (np.asarray(given[k], dtype=float) for k in ("crank_angle", "crank_rate", "crank_accel"))
    angle, rate, accel = np.broadcast_arrays(angle, rate, accel)
    found = solve_all(p, angle)
    if np.any(found.chosen < 0):
        return _no_assembly(p, angle)
    chosen = at(p, angle, rate, accel)
    scale = group(p, angle).scale
    merging = np.abs(chosen.det) < MERGING * scale**2
    status = Status.BOUNDARY if np.any(merging) else Status.SOLVED
    if angle.ndim:
        return Answer({**_flat(chosen), "mode_count": found.modes.count}, status)
    g, pin = group(p, angle, rate, accel), assur.driver(assur.fixed(), p.OA, angle, rate, accel)
    modes, taken = [], list[str]()
    for k in range(int(found.modes.count)):
        mode = describe_mode(p, g, pin, found.modes.theta_t[k], found.modes.theta_u[k])
        taken.append(label(float(mode.k1), float(mode.k2), taken))
        modes.append(_one(mode, taken[-1]))
    name = taken[int(found.chosen)]
    notes: tuple[str, ...] = (f"{len(modes)} modes; the witnesses compare {name}",)
    if np.any(merging):
        notes += ("two modes merge here: rates do not exist",)
    return Answer(_flat(chosen), status, notes, modes=tuple(modes))


def _start(p: Class4Parameters, m: Mechanism, given: Mapping[str, Any]) -> Array | None:
    """(nq,) START_OFFSET off the closed form of the chosen mode; None where it does not assemble."""
    try:
        return pose(p, m, float(given["crank_angle"])) + START_OFFSET
    except NoSolution:
        return None


QUESTION = Question(
    "modes", given=("crank_angle",), optional={"crank_rate": 0.0, "crank_accel": 0.0}, answers=ANSWERS,
    witnesses={"analytic": analytic} | by_engines(build, GIVEN, {k: k for k in ANSWERS}, _start), angles=THETAS,
    units=with_rates(dict.fromkeys(THETAS, "rad"))
    | {"crank_angle": "rad", "crank_rate": "rad/s", "crank_accel": "rad/s2", "mode_count": ""},
    text="every assembly mode at a crank angle, with rates and accelerations",
)  # fmt: skip
