"""Scenes of the four-bar, and its own equation of motion to hold them against."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import fourbar as closed_form
from mechlab.analytic.benchmarks import FourbarCrank
from mechlab.catalog.fourbar.build import build, start_angle, width
from mechlab.catalog.fourbar.parameters import Parameters
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Constant, Law, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.own_equations import one_freedom_slope, record_own
from mechlab.mechanism.geometry import Array


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
    drives = "free" if name == "free-run" else "hold"
    return Scene(name, fidelity, 2.0, laws[name], at, rate, tolerance=1e-4, settings=settings, drives=drives)


def driven(p: Parameters, fidelity: str) -> Scene:
    """A servo turns the crank at constant speed."""
    return _scene("driven-crank", p, fidelity)


def free(p: Parameters, fidelity: str) -> Scene:
    """The crank is let go at full speed, with nothing on it."""
    return _scene("free-run", p, fidelity)


def constant_torque(p: Parameters, fidelity: str) -> Scene:
    """A constant torque starts the crank from rest."""
    return _scene("constant-torque", p, fidelity)


SCENES = {
    "driven-crank": SceneRecipe(driven, "minimal", "a servo turns the crank at constant speed"),
    "free-run": SceneRecipe(free, "minimal", "the crank is let go at full speed"),
    "constant-torque": SceneRecipe(constant_torque, "minimal", "a constant torque starts the crank from rest"),
}


def _moment(p: Parameters, length: float) -> float:
    """Of a round bar about its middle, across: m (L^2 / 12 + r^2 / 4), its radius a quarter of the drawn width [kg m2]."""
    radius = 0.25 * width(p, length)
    return p.mass_per_length * length * (length**2 / 12.0 + radius**2 / 4.0)


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-12) -> Recording:
    """Own equation of the one freedom (Eksergian), integrated by DOP853 to 1e-12."""
    m = build(p, "minimal")
    moments = (_moment(p, p.crank), _moment(p, p.coupler), _moment(p, p.rocker))
    bar = FourbarCrank(*p.lengths, p.mode, p.mass_per_length, p.gravity, moments)
    slope = one_freedom_slope(m, scene, "crank_angle", bar.acceleration)

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
