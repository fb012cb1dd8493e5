"""The run under constant torques, its closed form, and all planets along any run."""

from __future__ import annotations

from mechlab.analytic import wolfrom as closed_form
from mechlab.catalog.wolfrom.build import build, reduction
from mechlab.catalog.wolfrom.parameters import Parameters
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit.epicyclic import constant_torques, steady_recording
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def scene(p: Parameters, fidelity: str) -> Scene:
    """Constant torques on sun and output ring."""
    return constant_torques(fidelity, {"sun": p.sun_torque, "ring": p.ring_torque})


def inertia_at_sun(p: Parameters) -> float:
    """Of the whole train, seen at the sun [kg m2]."""
    orbit = p.planet_mass * p.orbit**2
    return closed_form.reflected_inertia(p.all_teeth, p.planets, p.J_sun, p.J_ring, p.J_carrier, p.J_planet, orbit)


def carrier_acceleration(p: Parameters) -> float:
    """Of the carrier under the two torques, without losses [rad/s2], in closed form."""
    w = closed_form.speeds(p.all_teeth)
    return (p.sun_torque + p.ring_torque * float(w.ring / w.sun)) / inertia_at_sun(p) / float(w.sun)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Constant acceleration in closed form."""
    return steady_recording(build(p, "minimal"), {"carrier": carrier_acceleration(p)}, scene)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """All parts along a recording of any fidelity, from the carrier by exact ratios."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    return full, reduction(p).basis.angles(recording.channel("carrier")[:, None])
