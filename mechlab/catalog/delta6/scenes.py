"""Scenes of the delta: pose sweep, head tracking (the source's example), gravity hold, pure rotation, toolpath."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import SERVOS, build
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, DRIVES, Delta6Parameters, legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.toolpath import table_of, toolpath
from mechlab.errors import unknown
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import ComputedTorque, Servo
from mechlab.experiment.motion import Hold, PrescribedMotion, Sine, Spline
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import closed_form_recording
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import holding_forces

HOLD_GAINS = (400.0, 40.0)
"""Gains on the translation of the head centre [1/s2, 1/s]: critically damped, 20 rad/s."""


def _error(index: int, p: Delta6Parameters, recording: Recording) -> Array:
    """(n,) error of a head angle against the source's target: actual - target [rad]."""
    return recording.channel(ANGLES[index]) - closed.source_targets(recording.t).angles[:, index]


CHANNELS = {f"error_{name}": ("rad", partial(_error, k)) for k, name in enumerate(ANGLES)}


def _sines(
    p: Delta6Parameters, fidelity: str, name: str, text: str, period: float, strokes: Sequence[Sine], turns: Sequence[Sine]
) -> Scene:  # fmt: skip
    """Servos make the sliders follow `strokes` about their home positions [m], the rotary drives `turns` [rad]."""
    m = build(p, fidelity)
    forces = holding_forces(m, m.reference(), DRIVES)
    homes = [replace(s, offset=leg.home + p.slider_height) for s, leg in zip(strokes, legs(p), strict=True)]
    motions = dict(zip(DRIVES, (*homes, *turns), strict=True))
    laws = tuple(Servo(n, motion, *SERVOS[n], feedforward=forces[n]) for n, motion in motions.items())
    return Scene(name, fidelity, period, laws, *_start(motions), needs=("poses", "drive_forces"), text=text)


def _start(motions: Mapping[str, PrescribedMotion]) -> tuple[dict[str, float], dict[str, float]]:
    """Initial values and rates at the beginning of prescribed motions."""
    start = {n: motion.at(0.0) for n, motion in motions.items()}
    return {n: x for n, (x, _, _) in start.items()}, {n: rate for n, (_, rate, _) in start.items()}


def pose_sweep(p: Delta6Parameters, fidelity: str) -> Scene:
    """All six drives follow sines of different phase, so that all six freedoms of the output link move."""
    period = 4.0
    w = 2.0 * math.pi / period
    strokes = [Sine(0.035, 2 * w, phase=2.0 * math.pi * k / 3.0) for k in range(3)]
    turns = [Sine(0.9, w), Sine(0.7, 2 * w, phase=1.1), Sine(0.5, w, phase=2.3)]
    text = "all six drives follow sines; all six freedoms move"
    return _sines(p, fidelity, "pose-sweep", text, period, strokes, turns)


def swing(p: Delta6Parameters, fidelity: str, stroke: float) -> Scene:
    """1 s in which servos swing the sliders by `stroke` [m] and the rotary drives, all at 1 Hz."""
    w = 2.0 * math.pi
    strokes = [Sine(stroke, w, phase=2.0 * math.pi * k / 3.0) for k in range(3)]
    turns = [Sine(1.0, w, phase=0.2), Sine(0.8, w, phase=1.1), Sine(0.4, w, phase=2.3)]
    return replace(_sines(p, fidelity, "swing", "all drives swing at 1 Hz", 1.0, strokes, turns), needs=())


def _head_commands(alpha: Sine, beta: Sine, gamma: Sine) -> tuple[tuple[str, PrescribedMotion], ...]:
    """The head centre held, the angles as given."""
    return (*((n, Hold(0.0)) for n in CENTRE), ("alpha", alpha), ("beta", beta), ("gamma", gamma))


def head_tracking(p: Delta6Parameters, fidelity: str) -> Scene:
    """The source's control example: computed torque on the head while its centre is held."""
    targets = _head_commands(Sine(0.1, 10.0), Sine(0.1, 10.0, math.pi / 2), Sine(0.2, 5.0))
    gains = (HOLD_GAINS,) * 3 + ((p.position_gain, p.velocity_gain),) * 3
    initial = dict(zip(ANGLES, closed.SOURCE_START_ANGLES.tolist(), strict=True))
    rates = dict(zip(ANGLES, closed.SOURCE_START_RATES.tolist(), strict=True))
    return Scene(
        "head-tracking", fidelity, 3.0, (ComputedTorque(DRIVES, targets, gains),),
        initial=dict.fromkeys(CENTRE, 0.0) | initial, initial_rates=dict.fromkeys(CENTRE, 0.0) | rates,
        channels=tuple(CHANNELS), needs=("poses", "drive_forces"), tolerance=1e-5,
        settings=Settings() if fidelity == "minimal" else Settings(timestep=6e-4),
        text="the source's head targets, initial errors and gains under computed torque; the head centre is held",
    )  # fmt: skip


def gravity_hold(p: Delta6Parameters, fidelity: str) -> Scene:
    """The servos hold a pose off home against gravity; the start is 5 mm above it."""
    m = build(p, fidelity)
    pose = coordinates(p, fidelity, [0.03, -0.02, 0.01], [0.2, -0.3, 0.4])[0]
    forces = holding_forces(m, pose, DRIVES)
    initial = {name: float(m.value(name, pose)) for name in DRIVES}
    laws = tuple(Servo(n, Hold(x), *SERVOS[n], feedforward=forces[n]) for n, x in initial.items())
    return Scene(
        "gravity-hold", fidelity, 1.0, laws, initial=initial, initial_rates=dict.fromkeys(DRIVES, 0.0),
        needs=("drive_forces", "reactions"), text="servos hold a pose off home against gravity",
    )  # fmt: skip


def pure_rotation(p: Delta6Parameters, fidelity: str) -> Scene:
    """The head centre stands still while the head turns: the linear drive forces vary all the same."""
    w = 2 * math.pi
    commands = _head_commands(Sine(0.6, w), Sine(0.5, w, 1.0), Sine(0.4, w, 2.0))
    return Scene(
        "pure-rotation", fidelity, 1.0, (ComputedTorque(DRIVES, commands, (HOLD_GAINS,) * 6),), *_start(dict(commands)),
        needs=("drive_forces",),
        text="the platform centre stands still, the head turns; the forces of the linear drives vary",
    )  # fmt: skip


def follow_curve(p: Delta6Parameters, fidelity: str) -> Scene:
    """The output link runs along a B-spline; speed, acceleration and jerk of every drive stay within their limits."""
    path = toolpath(p)
    times = tuple(path.t.tolist())
    commands = tuple((name, Spline(times, values)) for name, values in table_of(path).items())
    law = ComputedTorque(DRIVES, commands, (HOLD_GAINS,) * 6)
    start = dict(zip(ANGLES, path.angles[0].tolist(), strict=True))
    centre = path.tool[0] - p.head_offset * closed.output_axis(path.angles[0])
    start |= {n: float(x) for n, x in zip(CENTRE, centre, strict=True)}
    return Scene(
        "toolpath", fidelity, path.law.duration, (law,), initial=start, initial_rates=dict.fromkeys(start, 0.0),
        needs=("poses", "drive_forces"), text="the output link follows a B-spline; every drive keeps its speed, acceleration and jerk"
    )  # fmt: skip


SCENES = {
    "pose-sweep": SceneRecipe(pose_sweep, "minimal", "all six freedoms move"),
    "head-tracking": SceneRecipe(head_tracking, "minimal", "the source's targets, initial errors and gains; computed torque"),
    "head-tracking-swapped": SceneRecipe(
        head_tracking, "minimal", "the same with the two gains read in the other order",
        overrides={"position_gain": 240.0, "velocity_gain": 480.0}
    ),
    "gravity-hold": SceneRecipe(gravity_hold, "minimal", "servos hold a pose off home"),
    "pure-rotation": SceneRecipe(pure_rotation, "minimal", "the head turns about its resting centre"),
    "toolpath": SceneRecipe(follow_curve, "minimal", "a B-spline (parameter curve) within the limits of every drive")
}  # fmt: skip


def reference(p: Delta6Parameters, scene: Scene) -> Recording:
    """Closed form of head tracking: the angles follow the ideal error law e'' + kv e' + kp e = 0, O stands still.

    Raises MechlabError for the scenes without a closed form.
    """
    if not scene.name.startswith("head-tracking"):
        raise unknown("delta6: scene with a closed form", scene.name, [n for n in SCENES if n.startswith("head")])
    t = np.linspace(0.0, scene.duration, max(2, round(scene.duration / 2e-3) + 1))
    wanted = closed.source_targets(t)
    error, error_rate = closed.SOURCE_START_ERRORS, closed.SOURCE_START_ERROR_RATES
    answer = closed.error_response(t[:, None], error, error_rate, p.velocity_gain, p.position_gain)
    angles, rates = wanted.angles + answer.error, wanted.rates + answer.error_rate
    m = build(p, "minimal")
    q = coordinates(p, "minimal", np.zeros((len(t), 3)), angles)
    v = np.zeros((len(t), m.nv))
    v[:, [m.v_slice[name].start for name in ANGLES]] = rates
    return closed_form_recording(m, scene, t, q, v)
