"""A level floor that pushes and never pulls, as a force law on the joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from mechlab.experiment.laws import Plant, register
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array


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

    def targets(self) -> tuple[str, ...]:
        """All joints that can feel the floor."""
        return self.joints

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """J^T times the contact forces. The plant must know points of frames: those of all engines do."""
        total = np.zeros(len(self.joints))
        known: tuple[list[int], Array] | None = None
        for frame in self.frames:
            point = plant.point(frame)  # type: ignore[attr-defined]
            if point[2] < self.height:
                if known is None:
                    at = plant.mechanism.v_slice
                    known = [at[name].start for name in self.joints], np.array([plant.rate(name) for name in self.joints])
                jacobian = plant.point_jacobian(frame)[:3, known[0]]  # type: ignore[attr-defined]
                total += self._push(jacobian, jacobian @ known[1], self.height - point[2])
        return dict(zip(self.joints, total.tolist(), strict=True))

    def _push(self, jacobian: Array, velocity: Array, depth: float) -> Array:
        """(joints,) forces of the contact of one frame: Jacobian (3, joints) and velocity (3,) of its point."""
        push = max(0.0, self.stiffness * depth - self.damping * velocity[2])
        drag = self.grip * float(np.hypot(velocity[0], velocity[1]))
        scale = self.grip * min(1.0, self.friction * push / drag) if drag > 0.0 else 0.0
        return np.asarray(np.array([-scale * velocity[0], -scale * velocity[1], push]) @ jacobian)
