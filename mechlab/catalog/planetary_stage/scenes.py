"""The run under constant torques, its closed form, and all planets along any run."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import planetary_stage as closed_form
from mechlab.catalog.planetary_stage.build import build
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit.epicyclic import constant_torques, steady_recording
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def scene(p: Parameters, fidelity: str) -> Scene:
    """Constant torques on sun and carrier."""
    return constant_torques(fidelity, {"sun": p.sun_torque, "carrier": p.carrier_torque})


def accelerations(p: Parameters) -> closed_form.StageAccelerations:
    """Of all members under the torques of the scene, ring held or free."""
    if p.ring == "held":
        return closed_form.held_ring_accelerations(p.stage, p.sun_torque, p.carrier_torque)
    return closed_form.free_accelerations(p.stage, p.sun_torque, p.carrier_torque)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant accelerations in closed form."""
    found = accelerations(p)
    by_joint = {"carrier": float(found.carrier), "sun_on_carrier": float(found.sun - found.carrier)}
    return steady_recording(build(p, "minimal"), by_joint, scene)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All planets along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    sun, carrier = recording.channel("sun"), recording.channel("carrier")
    ratio = p.teeth[0] / p.teeth[1]
    values = {"sun": sun, "carrier": carrier, "ring": carrier - p.teeth[0] / p.teeth[2] * (sun - carrier)}
    values |= {f"planet_{k + 1}": -ratio * (sun - carrier) for k in range(p.planets)}
    return full, np.column_stack([values[j.name] for j in full.joints])
