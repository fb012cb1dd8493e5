"""A floor that pushes and never pulls, as a force law for any Mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from mechlab.experiment.laws import Plant, register
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics


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
    _kept: dict[int, TreeKinematics] = field(default_factory=dict, compare=False, repr=False)

    def targets(self) -> tuple[str, ...]:
        """All joints that can feel the floor."""
        return self.joints

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """J^T times the contact forces."""
        m: Any = plant.mechanism
        tree = self._kept.setdefault(id(m), TreeKinematics(m))
        q, v = m.reference(), np.zeros(m.nv)
        for name in self.joints:
            q[m.q_slice[name].start] = plant.value(name) - m.zero(name)
            v[m.v_slice[name].start] = plant.rate(name)
        total = np.zeros(m.nv)
        tree.set(q, v)
        for frame in self.frames:
            total += self._of(tree, frame)
        return {name: float(total[m.v_slice[name].start]) for name in self.joints}

    def _of(self, tree: TreeKinematics, name: str) -> Array:
        frame = tree.mechanism.frame(name)
        rotation, origin = tree.pose(frame.body)
        point = origin + rotation @ frame.placement.translation
        depth = self.height - point[2]
        if depth <= 0.0:
            return np.zeros(tree.mechanism.nv)
        velocity = tree.velocity(frame.body, point)[:3]
        push = max(0.0, self.stiffness * depth - self.damping * velocity[2])
        drag = self.grip * float(np.hypot(velocity[0], velocity[1]))
        scale = self.grip * min(1.0, self.friction * push / drag) if drag > 0.0 else 0.0
        force = np.array([-scale * velocity[0], -scale * velocity[1], push])
        return np.asarray(force @ tree.jacobian(frame.body, point)[:3])
