"""Settings that a problem asks for: dry friction, and motors and drives faster than a step, need others than smooth motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechlab.experiment.acting import is_rough
from mechlab.experiment.laws import DcMotor, Law
from mechlab.experiment.recording import Finding, Recording
from mechlab.experiment.scene import PRESETS, Scene, Settings
from mechlab.lab.fastest_rate import drive_step, rk4_step
from mechlab.mechanism import Mechanism

FRICTION_STEP = 1e-4
"""Timestep [s] for dry friction in MuJoCo, whose error is of first order in it whatever the integrator."""
FASTEST = 2e-5
"""Time constants of motors below this [s] are not resolved by any default step."""
ADAPTIVE = ("DOP853", "Radau")
FINEST = 1e-4
"""Timestep [s] below which drives that hold, springs and dampers are not resolved by RK4 but taken implicitly."""


def settings_for(settings: Settings, mechanism: Mechanism, scene: Scene) -> Settings:
    """The settings of a scene for MuJoCo, where the user chose none. Dry friction, or a motor whose time constant is
    below the timestep: `stiff`, with a step that resolves it. Drives that hold: a step that resolves them, or `stiff`,
    which is implicit in them, where that step would be below FINEST. Springs and dampers of the mechanism with which RK4 would blow up:
    the same. Everything else: unchanged."""
    if settings.engine != "mujoco":
        base, wanted = PRESETS["accurate"], PRESETS["stiff"]
    elif settings.preset == "accurate":
        base, wanted = settings, replace(settings, integrator="discrete", preset="stiff")
    else:
        return settings
    resolving = max(FASTEST, min((x for x in map(motor_lag, scene.laws) if x), default=math.inf))
    if is_rough(mechanism):
        return replace(wanted, timestep=min(base.timestep, FRICTION_STEP, resolving))
    if resolving < base.timestep:
        return replace(wanted, timestep=min(PRESETS["stiff"].timestep, resolving))
    rk4 = base.integrator == "RK4"
    step = rk4_step(mechanism, scene, base.timestep) if rk4 else min(base.timestep, drive_step(mechanism, scene))
    if step < min(FINEST, base.timestep):
        return replace(wanted, timestep=min(base.timestep, PRESETS["stiff"].timestep))
    return replace(base, timestep=step)


def other_softness(mechanism: Mechanism, settings: Settings) -> Settings | None:
    """Settings of MuJoCo with rows as hard as they can be, where they are as soft as the engine has them by default: their effect does
    not vanish with the step. None for other settings and engines, and where there are no rows."""
    if settings.engine != "mujoco" or not mechanism.is_closed or settings.timeconst is not None:
        return None
    hard = PRESETS["accurate"]
    return replace(settings, timeconst=hard.timeconst, impedance=hard.impedance)


def motor_lag(law: Law) -> float:
    """Time constant [s] of a motor that a run has to follow; 0 for other laws and for a motor without."""
    return law.inductance / law.resistance if isinstance(law, DcMotor) else 0.0


def with_static_motors(scene: Scene, settings: Settings) -> Scene:
    """The scene with the motors that are faster than a step on their static line: torque over speed without lag.

    A step is the timestep of the settings; FASTEST for methods that control their steps, which would need thousands of
    them for nothing. A closed form has its own motor.
    """
    if settings.engine == "analytic":
        return scene
    adaptive = settings.engine == "hybrid" or settings.integrator in ADAPTIVE
    step = FASTEST if adaptive else settings.timestep
    laws = tuple(
        law.static() if isinstance(law, DcMotor) and 0.0 < motor_lag(law) < step else law for law in scene.laws
    )
    return scene if laws == scene.laws else replace(scene, laws=laws)


def motor_findings(scene: Scene, recording: Recording) -> tuple[Finding, ...]:
    """One finding for each motor whose lag was left out: the lead of the motion [rad or m], lag x largest change of the
    rate; it is an error beyond the tolerance of the scene."""
    out = []
    for law in scene.laws:
        if isinstance(law, DcMotor) and law.neglected:
            text = (
                f"the motor on {law.on} follows its static line, torque over speed: its time constant of "
                f"{law.neglected:.3g} s is shorter than a step, which puts the motion ahead by up to"
            )
            rate = recording.v @ recording.mechanism.row(law.on)
            ahead = law.neglected * float(np.max(np.abs(rate - rate[0])))
            unit = recording.units.get(law.on, "rad")
            severity = "error" if ahead > scene.tolerance else "warning"
            text += f" {ahead:.2g} {unit} (tolerance {scene.tolerance:g}); a timestep below it follows the motor"
            out.append(Finding("static_motor", ahead, scene.tolerance, unit, severity, text))
    return tuple(out)
