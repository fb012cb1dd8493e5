"""The platform as a Mechanism (three cranks, three legs, the platform), and its scenes."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage
from mechlab.catalog.platform_3rrr.geometry import (
    DRIVES,
    PlatformParameters,
    elbows,
    group,
    home,
    linkage,
    order,
    track,
)
from mechlab.errors import MechlabError
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import ComputedTorque
from mechlab.experiment.motion import Sine
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import closed_form_recording
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def style(p: PlatformParameters) -> Style:
    """Masses and looks; the platform's angle is `alpha`, the cranks' angles the drives."""
    names = {f"arm_{k + 1}": DRIVES[k] for k in range(3)} | {"platform": "alpha"}
    return Style(p.mass_per_length, gravity=p.gravity, width=0.08 * p.leg, names=names)


def linkage_at(p: PlatformParameters, drives: Array) -> Linkage:
    """The chain in the compositor's mode that is the nearest to the home pose at these drive angles (3,)."""
    pins = elbows(p, drives)
    modes = assur.all_modes(group(p, pins))
    k = int(order(p, pins, modes)[0])
    sign = 1 if modes.det[k] > 0 else -1
    return linkage(p, sign * int(np.count_nonzero(np.sign(modes.det[: k + 1]) == sign)))


@lru_cache(maxsize=32)
def build(p: PlatformParameters, fidelity: str) -> Mechanism:
    """Seven parts, two loops, three freedoms; the home pose is the reference."""
    inputs = {f"arm_{k + 1}": a for k, a in enumerate(home(p))}
    return mechanism_of(
        linkage_at(p, np.array(home(p))), inputs, style(p), "planar parallel platform 3-RRR (class III)"
    )


def _motions(p: PlatformParameters) -> tuple[Sine, ...]:
    """Each drive swings about its home angle, a third of a turn behind the one before."""
    return tuple(Sine(p.amplitude, p.frequency, -2.0 * math.pi * k / 3.0, a) for k, a in enumerate(home(p)))


def driven(p: PlatformParameters, fidelity: str) -> Scene:
    """The drives follow their swing by inverse dynamics."""
    motions = _motions(p)
    law = ComputedTorque(DRIVES, tuple(zip(DRIVES, motions, strict=True)), ((1e4, 200.0),) * 3)
    start = {n: m.at(0.0) for n, m in zip(DRIVES, motions, strict=True)}
    return Scene(
        "driven-cranks", fidelity, 2.0 * math.pi / p.frequency, (law,), {n: x[0] for n, x in start.items()},
        {n: x[1] for n, x in start.items()}, tolerance=1e-5, settings=Settings(timeconst=4.0),
    )  # fmt: skip


def free(p: PlatformParameters, fidelity: str) -> Scene:
    """The platform is let go in its home pose."""
    return Scene(
        "free-run", fidelity, 0.25, (), dict(zip(DRIVES, home(p), strict=True)), {}, tolerance=1e-4, drives="free"
    )


def reference(p: PlatformParameters, scene: Scene) -> Recording:
    """The driven scene in closed form. Raises MechlabError for the free run."""
    law = scene.laws[0] if scene.laws else None
    if not isinstance(law, ComputedTorque):
        raise MechlabError(f"platform_3rrr: scene {scene.name!r} has no closed form; engines: mujoco, pinocchio.")
    m = build(p, "minimal")
    t = np.linspace(0.0, scene.duration, 721)
    motion = np.array([[f.at(float(x)) for x in t] for _, f in law.commands])
    angle, rate, accel = (motion[:, :, k] for k in range(3))
    leg, alpha = track(p, angle, rate, accel)
    found = assur.mode_rates(group(p, elbows(p, angle, rate, accel)), leg, alpha)
    turns = (found.theta_t, *found.links)
    value = {"platform_joint": alpha - leg}
    speed = {"platform_joint": found.theta_u.v - found.theta_t.v}
    for k, name in enumerate(DRIVES):
        value |= {name: angle[k], f"leg_{k + 1}_joint": np.unwrap(turns[k].x) - angle[k]}
        speed |= {name: rate[k], f"leg_{k + 1}_joint": turns[k].v - rate[k]}
    q = np.column_stack([value[j.name] - j.zero for j in m.joints])
    q -= 2 * np.pi * np.round(q[0] / (2 * np.pi))
    v = np.column_stack([speed[j.name] for j in m.joints])
    return closed_form_recording(m, scene, t, q, v)


SCENES = {
    "driven-cranks": SceneRecipe(driven, "minimal", "the drives swing about the home pose, by inverse dynamics"),
    "free-run": SceneRecipe(free, "minimal", "the platform falls from its home pose"),
}
