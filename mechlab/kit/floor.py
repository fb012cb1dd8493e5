"""A level floor that pushes and never pulls, as a force law on the joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from mechlab.experiment.laws import Plant, register
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
