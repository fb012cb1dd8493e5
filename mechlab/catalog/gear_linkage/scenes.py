"""Scenes of the three-gear four-bar, and the closed form to hold them against."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.build import START, build
from mechlab.catalog.gear_linkage.parameters import NEAR_CHANGE_POINT, PRESETS, Parameters
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Law, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.own_equations import one_freedom_slope, record_own
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

STIFFNESS = 30.0
"""Frequency of the crank servo in units of the crank speed."""
STEPS = 6283
"""Steps a turn: 1 ms at 1 rad/s."""
DRIVEN = ("output_held",)


def _turn(p: Parameters) -> float:
    """Duration of one turn [s]; a crank that stands gets a second."""
    return 2.0 * math.pi / abs(p.speed) if p.speed else 1.0


def servo(p: Parameters) -> Servo:
    """A critically damped servo, its gains from the reduced inertia at the reference pose and the speed."""
    inertia = float(closed_form.reduced_inertia(p.linkage, p.masses, START)[0])
    w = STIFFNESS * max(abs(p.speed), 1e-3)
    return Servo("crank_angle", Ramp(0.0, p.speed), stiffness=inertia * w**2, damping=2.0 * inertia * w)


def _scene(name: str, p: Parameters, fidelity: str, laws: tuple[Law, ...], turns: float, settings: Settings) -> Scene:
    return Scene(
        name, fidelity, turns * _turn(p), laws, {"crank_angle": 0.0}, {"crank_angle": p.speed}, channels=DRIVEN,
        tolerance=1e-4, settings=settings, keep_mode=("crank_angle",),
    )  # fmt: skip


def constant_crank(p: Parameters, fidelity: str) -> Scene:
    """A servo turns the crank once at constant speed."""
    return _scene("constant-crank", p, fidelity, (servo(p),), 1.0, Settings(timestep=_turn(p) / STEPS))


def free_spin(p: Parameters, fidelity: str) -> Scene:
    """The crank is let go at full speed: one turn at the mean speed, more or less."""
    return replace(_scene("free-spin", p, fidelity, (), 1.0, Settings(timestep=_turn(p) / STEPS)), drives="free")


def near_change_point(p: Parameters, fidelity: str) -> Scene:
    """As constant-crank, with a first-order integrator and a coarse step: two turns close past a change point."""
    settings = Settings(integrator="discrete", timestep=_turn(p) / STEPS)
    return _scene("near-change-point", p, fidelity, (servo(p),), 2.0, settings)


TEXTS = {
    "knife-drive": "knives of a three-knife paper cutter: one output turn a cycle with an instantaneous stop, no clutch",
    "sheet-delivery": "sheet-delivery transporter: speed matched where the sheet is gripped, slow where it is laid down",
    "glue-and-cut": "glue and cut: the play of the gears makes a stop in which the strip is cut",
}
SCENES = {
    "constant-crank": SceneRecipe(constant_crank, "minimal", "a servo turns the crank once at constant speed"),
    "free-spin": SceneRecipe(free_spin, "minimal", "the crank is let go at full speed"),
    "near-change-point": SceneRecipe(
        near_change_point,
        "minimal",
        "two turns of a crank 1e-5 short of the change point: with a coarse step the run stops instead of flipping",
        NEAR_CHANGE_POINT,
    ),
} | {name: SceneRecipe(constant_crank, "minimal", TEXTS[name], changes) for name, changes in PRESETS.items()}


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-12) -> Recording:
    """Own equation of the one freedom (Eksergian), integrated by DOP853 to 1e-12."""
    m = build(p, "minimal")

    def acceleration(phi: float, w: float, torque: float) -> float:
        return float(closed_form.acceleration(p.linkage, p.masses, phi, w, torque))

    slope = one_freedom_slope(m, scene, "crank_angle", acceleration)
    start = np.array([scene.initial["crank_angle"], scene.initial_rates["crank_angle"]])
    return record_own(m, scene, slope, start, lambda y: coordinates(p, m, y[:, 0], y[:, 1]), method, tolerance)


def coordinates(p: Parameters, m: Mechanism, phi: Array, w: Array) -> tuple[Array, Array]:
    """(n, nq), (n, nv) coordinates and rates of the model along crank angles and rates, from the closed form."""
    x = closed_form.motion(p.linkage, phi, w)
    at = closed_form.motion(p.linkage, START)
    idler = x.idler_angle - at.idler_angle - (x.coupler_angle - at.coupler_angle)
    values = {
        "crank_angle": phi - START, "coupler_joint": x.coupler_angle - at.coupler_angle - (phi - START),
        "idler_joint": idler, "rocker_angle": x.rocker_angle - at.rocker_angle,
        "output_angle": x.output_angle - at.output_angle,
    }  # fmt: skip
    rates = {
        "crank_angle": w, "coupler_joint": x.coupler_rate - w, "idler_joint": x.idler_rate - x.coupler_rate,
        "rocker_angle": x.rocker_rate, "output_angle": x.output_rate,
    }  # fmt: skip
    names = [j.name for j in m.joints]
    return np.column_stack([values[n] for n in names]), np.column_stack([rates[n] for n in names])


def output_held(p: Parameters, recording: Recording) -> Array:
    """The output with the play `backlash`, pushed by the gears and held by friction where nothing pushes [rad]."""
    return closed_form.with_play(recording.channel("output_angle"), p.backlash)
