"""Scenes of the delta: pose sweep, head tracking (the source's example), gravity hold, pure rotation, toolpath."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.delta6 import SOURCE_START_ANGLES, SOURCE_START_RATES, error_response, output_axis, source_targets
from mechlab.catalog.delta6.build import SERVO_LINEAR, SERVO_ROTARY, build
from mechlab.catalog.delta6.parameters import Delta6Parameters, drive_names, legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.toolpath import table_of, toolpath
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import ComputedTorque, Servo
from mechlab.experiment.motion import Hold, PrescribedMotion, Sine, Spline
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import holding_forces

HOLD_GAINS = (400.0, 40.0)
"""Gains on the translation of the head centre [1/s2, 1/s]: critically damped, 20 rad/s."""
ANGLES = ("alpha", "beta", "gamma")


def _home_forces(p: Delta6Parameters, fidelity: str) -> dict[str, float]:
    m = build(p, fidelity)
    return holding_forces(m, m.reference(), drive_names())


def pose_sweep(p: Delta6Parameters, fidelity: str) -> Scene:
    """All six drives follow sines of different phase, so that all six freedoms of the output link move."""
    forces = _home_forces(p, fidelity)
    period = 4.0
    w = 2.0 * math.pi / period
    laws = []
    for k, leg in enumerate(legs(p)):
        motion = Sine(0.035, 2 * w, phase=2.0 * math.pi * k / 3.0, offset=leg.home + p.slider_height)
        laws.append(Servo(f"q{k + 1}", motion, *SERVO_LINEAR, feedforward=forces[f"q{k + 1}"]))
    for k, (amplitude, phase) in enumerate(((0.9, 0.0), (0.7, 1.1), (0.5, 2.3))):
        motion = Sine(amplitude, w * (1 + k % 2), phase=phase)
        laws.append(Servo(f"phi{k + 1}", motion, *SERVO_ROTARY, feedforward=forces[f"phi{k + 1}"]))
    return Scene(
        "pose-sweep", fidelity, period, tuple(laws),
        initial={law.on: law.motion.at(0.0)[0] for law in laws}, initial_rates={law.on: law.motion.at(0.0)[1] for law in laws},
        needs=("poses", "drive_forces"), text="all six drives follow sines; all six freedoms move",
    )  # fmt: skip


def _targets(p: Delta6Parameters) -> tuple[tuple[str, PrescribedMotion], ...]:
    head: tuple[tuple[str, PrescribedMotion], ...] = (
        ("alpha", Sine(0.1, 10.0)),
        ("beta", Sine(0.1, 10.0, math.pi / 2)),
        ("gamma", Sine(0.2, 5.0)),
    )
    return (*((f"O_{a}", Hold(0.0)) for a in "xyz"), *head)


def head_tracking(p: Delta6Parameters, fidelity: str) -> Scene:
    """The source's control example: computed torque on the head while its centre is held."""
    gains = (HOLD_GAINS,) * 3 + ((p.position_gain, p.velocity_gain),) * 3
    initial = dict(zip(ANGLES, SOURCE_START_ANGLES.tolist(), strict=True))
    rates = dict(zip(ANGLES, SOURCE_START_RATES.tolist(), strict=True))
    return Scene(
        "head-tracking", fidelity, 3.0, (ComputedTorque(drive_names(), _targets(p), gains),),
        initial={f"O_{a}": 0.0 for a in "xyz"} | initial, initial_rates={f"O_{a}": 0.0 for a in "xyz"} | rates,
        channels=("error_alpha", "error_beta", "error_gamma"), needs=("poses", "drive_forces"), tolerance=1e-5,
        text="the source's head targets, initial errors and gains under computed torque; the head centre is held",
    )  # fmt: skip


def gravity_hold(p: Delta6Parameters, fidelity: str) -> Scene:
    """The servos hold a pose off home against gravity; the start is 5 mm above it."""
    m = build(p, fidelity)
    angles = np.array([0.2, -0.3, 0.4])
    pose = coordinates(p, fidelity, np.array([0.03, -0.02, 0.01]), angles)[0]
    forces = holding_forces(m, pose, drive_names())
    laws, initial = [], {}
    for name in drive_names():
        gains = SERVO_LINEAR if name.startswith("q") else SERVO_ROTARY
        target = float(m.value(name, pose))
        laws.append(Servo(name, Hold(target), *gains, feedforward=forces[name]))
        initial[name] = target
    return Scene(
        "gravity-hold", fidelity, 1.0, tuple(laws), initial=initial, initial_rates=dict.fromkeys(drive_names(), 0.0),
        needs=("drive_forces", "reactions"), text="servos hold a pose off home against gravity",
    )  # fmt: skip


def pure_rotation(p: Delta6Parameters, fidelity: str) -> Scene:
    """The head centre stands still while the head turns: the linear drive forces vary all the same."""
    head: tuple[tuple[str, PrescribedMotion], ...] = (
        ("alpha", Sine(0.6, 2 * math.pi)), ("beta", Sine(0.5, 2 * math.pi, 1.0)), ("gamma", Sine(0.4, 2 * math.pi, 2.0)),
    )  # fmt: skip
    commands = (*((f"O_{a}", Hold(0.0)) for a in "xyz"), *head)
    law = ComputedTorque(drive_names(), commands, ((HOLD_GAINS),) * 6)
    return Scene(
        "pure-rotation", fidelity, 1.0, (law,), initial={n: motion.at(0.0)[0] for n, motion in commands},
        initial_rates={n: motion.at(0.0)[1] for n, motion in commands}, needs=("drive_forces",),
        text="the platform centre stands still, the head turns; the forces of the linear drives vary",
    )  # fmt: skip


def follow_curve(p: Delta6Parameters, fidelity: str) -> Scene:
    """The output link runs along a B-spline; speed, acceleration and jerk of every drive stay within their limits."""
    path = toolpath(p)
    times = tuple(path.t.tolist())
    commands = tuple((name, Spline(times, values)) for name, values in table_of(path).items())
    law = ComputedTorque(drive_names(), commands, (HOLD_GAINS,) * 6)
    start = dict(zip(ANGLES, path.angles[0].tolist(), strict=True))
    centre = path.tool[0] - p.head_offset * output_axis(path.angles[0])
    start |= {f"O_{a}": float(x) for a, x in zip("xyz", centre, strict=True)}
    return Scene(
        "toolpath", fidelity, path.law.duration, (law,), initial=start, initial_rates=dict.fromkeys(start, 0.0),
        needs=("poses", "drive_forces"), text="the output link follows a B-spline; every drive keeps its speed, acceleration and jerk",
    )  # fmt: skip


SCENES = {
    "pose-sweep": SceneRecipe(pose_sweep, "minimal", "all six freedoms move"),
    "head-tracking": SceneRecipe(head_tracking, "minimal", "the source's targets, initial errors and gains; computed torque"),
    "head-tracking-swapped": SceneRecipe(
        head_tracking, "minimal", "the same with the two gains read in the other order",
        overrides={"position_gain": 240.0, "velocity_gain": 480.0},
    ),
    "gravity-hold": SceneRecipe(gravity_hold, "minimal", "servos hold a pose off home"),
    "pure-rotation": SceneRecipe(pure_rotation, "minimal", "the head turns about its resting centre"),
    "toolpath": SceneRecipe(follow_curve, "minimal", "a B-spline (parameter curve) within the limits of every drive"),
}  # fmt: skip


def error_channel(index: int, p: Delta6Parameters, recording: Recording) -> Array:
    """(n,) error of a head angle against the source's target: actual - target [rad]."""
    return recording.channel(ANGLES[index]) - source_targets(recording.t).angles[:, index]


def _error_alpha(p: Delta6Parameters, recording: Recording) -> Array:
    return error_channel(0, p, recording)


def _error_beta(p: Delta6Parameters, recording: Recording) -> Array:
    return error_channel(1, p, recording)


def _error_gamma(p: Delta6Parameters, recording: Recording) -> Array:
    return error_channel(2, p, recording)


CHANNELS = {
    "error_alpha": ("rad", _error_alpha),
    "error_beta": ("rad", _error_beta),
    "error_gamma": ("rad", _error_gamma),
}


def reference(p: Delta6Parameters, scene: Scene) -> Recording:
    """Closed form of head tracking: the angles follow the ideal error law e'' + kv e' + kp e = 0, O stands still.

    Raises MechlabError for the scenes without a closed form.
    """
    from mechlab.errors import unknown

    if not scene.name.startswith("head-tracking"):
        raise unknown("delta6: scene with a closed form", scene.name, [n for n in SCENES if n.startswith("head")])
    t = np.linspace(0.0, scene.duration, max(2, round(scene.duration / 2e-3) + 1))
    wanted = source_targets(t)
    start = source_targets(0.0)
    error, error_rate = SOURCE_START_ANGLES - start.angles, SOURCE_START_RATES - start.rates
    answer = error_response(t[:, None], error, error_rate, p.velocity_gain, p.position_gain)
    angles, rates = wanted.angles + answer.error, wanted.rates + answer.error_rate
    m = build(p, "minimal")
    q = coordinates(p, "minimal", np.zeros((len(t), 3)), angles)
    v = np.zeros((len(t), m.nv))
    for k, name in enumerate(ANGLES):
        v[:, m.v_slice[name].start] = rates[:, k]
    channels, units = basic_channels(m, q, v)
    return Recording(
        m, t, q, v, channels, units, settings=Settings(engine="analytic"), scene=scene.name, fidelity="minimal"
    )
