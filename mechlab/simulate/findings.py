"""The health record of a MuJoCo run."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Protocol

import mujoco
import numpy as np

from mechlab.experiment.energy import dissipation, energy_finding, work
from mechlab.experiment.health import Finding, Health
from mechlab.experiment.held_rates import capture_finding
from mechlab.experiment.lag import lag_findings
from mechlab.experiment.observe import kinematic_findings, restart_finding, saturation_finding
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft, Spring
from mechlab.simulate.stepping import BlowUp

LOOKED_AT = 250
"""At most so many samples are looked at where each costs a walk through the whole tree."""
UNEXPLAINED, SLIP_FLOOR = 3.0, 1e-6
"""Measured over predicted slip of gear rows that is to be known, and the slip [rad or m] below which it is not."""
_FAILURES = ("BADQPOS", "BADQVEL", "BADQACC")


class Samples(Protocol):
    """What the health record needs of the samples."""

    t: list[float]

    @property
    def forces(self) -> dict[str, Array]:
        """Joint or shaft -> (n,) force."""
        ...

    @property
    def work(self) -> Array:
        """(n,) work of the laws."""
        ...

    @property
    def slip(self) -> tuple[float, float, float]:
        """Largest residual of the relations, measured and predicted, and the work in their soft rows [J]."""
        ...


def health(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings,
    data: mujoco.MjData,
    blow_up: BlowUp | None,
    samples: Samples,
    states: tuple[Array, Array],
) -> Health:
    """All findings of a run, the worst first where one ended it."""
    q, v = states
    t = np.array(samples.t)
    some = np.unique(np.linspace(0, len(t) - 1, min(len(t), LOOKED_AT)).round().astype(int))
    out: list[Finding] = []
    if blow_up is not None:
        out.append(_blown(mechanism, blow_up, scene, settings))
    out += kinematic_findings(mechanism, q[some], v[some], keep_mode=scene.keep_mode)
    if mechanism.relations:
        out += lag_findings(mechanism, scene, settings)
        out.append(_slip(*samples.slip[:2]))
    lost = dissipation(mechanism, q, v)
    stopped = _stopped(mechanism, t, q, v)
    if len(t) > 1:
        done = samples.work - work(t, lost)
        power = np.gradient(done, t)
        balance = energy_finding(
            mechanism, t[some], q[some], v[some], power[some], done[some], in_rows=samples.slip[2], laws=scene.laws
        )
        out.append(_excused(balance) if stopped else balance)
    if stopped:
        text = f"{', '.join(stopped)} reached the end of the range, where the engine has a soft stop that takes energy"
        out.append(Finding("range", float(len(stopped)), 0.0, "joints", "warning", text))
    some_more = (saturation_finding(scene.laws, samples.forces), capture_finding(scene.laws, settings))
    out += [f for f in some_more if f is not None]
    restarted = restart_finding(mechanism, t, q, v)
    if restarted is not None:
        out.insert(0, restarted)
    out += _warnings(data)
    out += _notes(mechanism, settings)
    return Health(tuple(out))


def _blown(mechanism: Mechanism, blow_up: BlowUp, scene: Scene, settings: Settings) -> Finding:
    tips = [f"a smaller timestep (now {settings.timestep:g} s)"]
    parts: tuple[Joint | Shaft | Spring, ...] = (*mechanism.joints, *mechanism.shafts, *mechanism.springs)
    if any(x.stiffness or x.damping for x in parts) and settings.integrator != "discrete":
        tips.append("the preset 'stiff', which is implicit in springs and dampers of the mechanism (not in laws)")
    if scene.laws:
        tips.append("softer laws, such as smaller gains of a servo, or more inertia where it acts")
    text = f"the run blew up at t = {blow_up.t:.6g} s and was stopped: {blow_up.reason}. Try {', or '.join(tips)}"
    return Finding("blow_up", blow_up.t, scene.duration, "s", "error", text)


def _stopped(mechanism: Mechanism, t: Array, q: Array, v: Array) -> list[str]:
    """Joints that met an end of their range, or may have between two samples."""
    step = float(np.max(np.diff(t), initial=0.0))
    out = []
    for joint in mechanism.joints:
        if joint.range is None or joint.nv != 1:
            continue
        value, reach = mechanism.value(joint.name, q), np.abs(v @ mechanism.row(joint.name)) * step
        if np.any(value - reach <= joint.range[0]) or np.any(value + reach >= joint.range[1]):
            out.append(joint.name)
    return out


def _excused(balance: Finding) -> Finding:
    """An energy balance that a stop may have upset is no error."""
    if balance.severity != "error":
        return balance
    text = balance.sentence.removesuffix("; do not trust this run") + "; a stop took part in it"
    return replace(balance, severity="warning", sentence=text)


def _slip(measured: float, predicted: float) -> Finding:
    """Measured and predicted slip of soft rows: more than the loads explain is a motion of the rows themselves."""
    text = (
        f"softness alone predicts a slip of the relations of {predicted:.3g}, r = (1-d) tc^2 zeta^2 A f, standing; "
        f"measured {measured:.3g} rad or m"
    )
    if measured > max(UNEXPLAINED * predicted, SLIP_FLOOR):
        text += ": the loads do not explain it, the rows swing, or fight each other. Take a smaller timestep"
        return Finding("relation_softness", measured, UNEXPLAINED * predicted, "rad or m", "warning", text)
    return Finding("relation_softness", predicted, math.inf, "rad or m", "ok", text)


def _warnings(data: mujoco.MjData) -> list[Finding]:
    """One finding for each kind of warning that the engine counted, or one that says there were none."""
    out = []
    for k in range(mujoco.mjtWarning.mjNWARNING):
        number = int(data.warning[k].number)
        if number:
            name = mujoco.mjtWarning(k).name.removeprefix("mjWARN_")
            severity = "error" if name in _FAILURES else "warning"
            text = f"MuJoCo warned {number} times: {name} (last at {data.warning[k].lastinfo})"
            out.append(Finding("engine_warnings", float(number), 0.0, "warnings", severity, text))
    return out or [Finding("engine_warnings", 0.0, 0.0, "warnings", "ok", "no warnings of the engine")]


def _notes(mechanism: Mechanism, settings: Settings) -> list[Finding]:
    """What the user must know of the settings (a warning) and of where numbers come from."""
    out = []
    if settings.warning:
        out.append(Finding("settings", 0.0, 0.0, "", "warning", settings.warning))
    if settings.integrator == "discrete":
        text = "with the integrator 'discrete', accelerations and reactions are means over the next step: (v+ - v) / h"
        out.append(Finding("accelerations", 0.0, 0.0, "", "ok", text))
    if any(x.kind == "distance" for x in mechanism.loops):
        text = (
            "a distance loop is right in positions only, MuJoCo ignores dJ/dt v of a tendon: accelerations and "
            "reactions were computed at the samples from its mass matrix, forces and Jacobians"
        )
        out.append(Finding("distance_loops", 0.0, 0.0, "", "ok", text))
    return out
