"""Scenes of the leg: the swing, and a drop onto the straight leg; a floor that pushes and never pulls, as a force law."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.build import FREE, LEG, TRUNK, Parameters, build, hip_height, tree
from mechlab.errors import MechlabError
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Plant, Servo, register
from mechlab.experiment.motion import Hold
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.integrate import integrate_adaptive
from mechlab.mechanism import Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array


class _Tree:
    """The tree of a Mechanism at the values and rates of some joints: name, index in q, index in v, zero of each."""

    def __init__(self, mechanism: Mechanism, joints: tuple[str, ...]) -> None:
        m = mechanism
        self.tree = TreeKinematics(m)
        self.joints = [(n, m.q_slice[n].start, m.v_slice[n].start, m.zero(n)) for n in joints]
        self.q, self.v = m.reference(), np.zeros(m.nv)

    def set(self, plant: Plant) -> None:
        """Move to the state of the plant."""
        for name, i, k, zero in self.joints:
            self.q[i] = plant.value(name) - zero
            self.v[k] = plant.rate(name)
        self.tree.set(self.q, self.v)


@register("floor")
@dataclass(frozen=True)
class Floor:
    """Contact of frames with the level plane z = height: stiffness depth + damping depth rate [N], never below zero.

    Along the floor a viscous drag, `grip` x velocity, at most `friction` x normal force. The forces become those of the
    joints by the Jacobian of each frame, at every stage of a step.
    """

    frames: tuple[str, ...]
    joints: tuple[str, ...]
    height: float
    stiffness: float
    damping: float
    friction: float = 0.8
    grip: float = 2e3
    kind: ClassVar[str]
    _kept: list[_Tree] = field(default_factory=list, compare=False, repr=False)

    def targets(self) -> tuple[str, ...]:
        """All joints that can feel the floor."""
        return self.joints

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """J^T times the contact forces."""
        if not self._kept or self._kept[0].tree.mechanism is not plant.mechanism:
            self._kept[:] = [_Tree(plant.mechanism, self.joints)]
        kept = self._kept[0]
        total = np.zeros(len(kept.v))
        kept.set(plant)
        for frame in self.frames:
            push = self._of(kept.tree, frame)
            if push is not None:
                total += push
        return {name: total.item(k) for name, _, k, _ in kept.joints}

    def _of(self, tree: TreeKinematics, name: str) -> Array | None:
        frame = tree.mechanism.frame(name)
        rotation, origin = tree.pose(frame.body)
        point = origin + rotation @ frame.placement.translation
        depth = self.height - point[2]
        if depth <= 0.0:
            return None
        jacobian = tree.jacobian(frame.body, point)[:3]
        velocity = jacobian @ tree.v
        push = max(0.0, self.stiffness * depth - self.damping * velocity[2])
        drag = self.grip * float(np.hypot(velocity[0], velocity[1]))
        scale = self.grip * min(1.0, self.friction * push / drag) if drag > 0.0 else 0.0
        force = np.array([-scale * velocity[0], -scale * velocity[1], push])
        return np.asarray(force @ jacobian)


SWING_TIME = 0.45
SWING_START = {"hip": math.radians(-20.0), "knee": math.radians(-50.0)}
SWING_RATES = {"hip": 3.0, "knee": -4.0}
DROP = 0.02
"""Height of the drop [m]."""

FLOOR_STIFFNESS, FLOOR_DAMPING = 1.5e5, 600.0


def _swing(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "swing", fidelity, SWING_TIME, (), dict(SWING_START), dict(SWING_RATES), tolerance=1e-6,
        settings=Settings(integrator="RK4", timestep=1e-3), text="the leg swings through under its own weight",
    )  # fmt: skip


def _drop(p: Parameters, fidelity: str) -> Scene:
    """Rails hold the trunk upright, hip and knee are locked by stiff springs; the foot falls DROP onto the floor."""
    stiff = {"trunk_x": (1e5, 2e3), "trunk": (5e4, 5e2), "hip": (5e3, 50.0), "knee": (5e3, 50.0)}
    free = {n: k for n, k in stiff.items() if n in FREE[fidelity]}
    laws = [Servo(n, Hold(0.0), kp, kd) for n, (kp, kd) in free.items()]
    floor = Floor(("heel", "toe"), FREE[fidelity], -hip_height(p) - DROP, FLOOR_STIFFNESS, FLOOR_DAMPING)
    return Scene(
        "stance-drop", fidelity, 0.6, (*laws, floor), tolerance=5e-4,
        settings=Settings(integrator="RK4", timestep=2.5e-4), text="the leg falls 20 mm onto the floor with the body on it",
    )  # fmt: skip


SCENES = {
    "swing": SceneRecipe(_swing, "parts", "the swing of the leg, trunk fixed: 0.45 s from hip -20 deg, knee -50 deg"),
    "stance-drop": SceneRecipe(_drop, "full", "a drop of 20 mm onto the straight leg, with the body on rails"),
}


def swing_motion(p: Parameters, free: tuple[str, ...], start: Array, rates: Array, times: Array) -> tuple[Array, Array]:
    """q, v (times, joints) of the passive leg from its own Lagrange equations in transition matrices, DOP853 to 1e-10."""
    t = tree(p, free)
    n = len(free)

    def slope(_: float, y: Array) -> Array:
        return np.concatenate([y[n:], tm.accelerations(t, y[:n], y[n:])])

    found = integrate_adaptive(slope, 0.0, np.concatenate([start, rates]), times[-1], rtol=1e-10, atol=1e-12)
    y = found.at(times)
    return y[:, :n], y[:, n:]


def reference(p: Parameters, scene: Scene) -> Recording:
    """The scene by transition matrices. Raises MechlabError for a scene with laws: they are for engines."""
    if scene.laws:
        raise MechlabError(
            f"prosthetic_leg: the transition matrices run passive scenes, {scene.name!r} has force laws; "
            "engines: mujoco, pinocchio."
        )
    free = FREE[scene.fidelity]
    m = build(p, scene.fidelity)
    t = np.linspace(0.0, scene.duration, 226)
    start = np.array([scene.initial.get(n, 0.0) for n in free])
    q, v = swing_motion(p, free, start, np.array([scene.initial_rates.get(n, 0.0) for n in free]), t)
    channels, units = basic_channels(m, q, v)
    settings = Settings(engine="analytic", integrator="DOP853", tolerance=1e-10)
    return Recording(m, t, q, v, channels, units, settings=settings, scene=scene.name, fidelity=scene.fidelity)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """The leg of nine freedoms along a recording of any fidelity; joints it does not have stand at zero."""
    m = build(p, "full")
    q = np.zeros((len(recording.t), m.nq))
    for name in (*TRUNK, *LEG):
        if name in recording.channels:
            q[:, m.q_slice[name].start] = recording.channels[name]
    return m, q
