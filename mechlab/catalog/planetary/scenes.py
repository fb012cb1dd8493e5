"""The run under constant torques, its closed form, and all planets along any run."""

from __future__ import annotations

import numpy as np

from mechlab.catalog.planetary.build import build
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit.epicyclic import constant_torques, steady_recording
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def scene(p: Parameters, fidelity: str) -> Scene:
    """Constant torques on sun and carrier."""
    return constant_torques(fidelity, {"sun": p.sun_torque, "carrier": p.carrier_torque})


def acceleration(p: Parameters) -> float:
    """Carrier acceleration under the torques of the scene [rad/s2]."""
    return (p.sun_torque * float(p.ratio) + p.carrier_torque) / p.inertia


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant acceleration in closed form."""
    return steady_recording(build(p, "minimal"), {"carrier": acceleration(p)}, scene)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All planets along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    carrier = recording.channel("carrier")
    factor = {"sun": float(p.ratio), "carrier": 1.0}
    factor |= {f"planet_{n}_{k + 1}": float(p.rates[f"planet_{n}"] - 1) for n in (2, 3) for k in range(p.planets)}
    return full, np.column_stack([factor[j.name] * carrier for j in full.joints])
