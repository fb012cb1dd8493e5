"""Springs between two points on Pinocchio's joint columns, as the constraint rows are (`mechlab.engines.pinocchio.constraints`).

A spring from a to b acts along one line W = (u, a x u) in world axes, u = (b - a) / length: length' = W . (V_b - V_a). With the joint
columns S (6, nv) and the selection N (springs, nv) of the columns that move only b (+1) or only a (-1):

    gradient = N * (W S),    force = -(k (length - rest) + d gradient v) gradient
"""

from __future__ import annotations

import numpy as np

from mechlab.engines.pinocchio.constraints import cross_rows
from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.mechanism.geometry import Array

POINT = 1e-12
"""Length [m] below which a spring has no direction."""


class PinSprings:
    """The springs at the state of a PinKinematics."""

    def __init__(self, kin: PinKinematics) -> None:
        self.kin, springs = kin, kin.mechanism.springs
        self._stiffness = np.array([s.stiffness for s in springs])
        self._damping = np.array([s.damping for s in springs])
        self._rest = np.array([s.rest_length for s in springs])
        ends = [*((s.body_a, s.point_a) for s in springs), *((s.body_b, s.point_b) for s in springs)]
        self._ends = [(kin.pin.joint_of[body], _carried(kin, body, np.array(point))) for body, point in ends]
        moved = kin.support[[joint for joint, _ in self._ends]]
        self._selection = moved[len(springs) :] - moved[: len(springs)]
        self._pose, self._seen = -1, (np.zeros(0), np.zeros((0, kin.model.nv)))

    def __len__(self) -> int:
        return len(self._rest)

    def stretched(self) -> tuple[Array, Array]:
        """(springs,) lengths [m] and (springs, nv) their gradients, once for each pose."""
        kin, count = self.kin, len(self)
        if self._pose != kin.pose_count:
            placed = kin.placed().oMi
            points = np.array([placed[joint].act(point) for joint, point in self._ends])
            between = points[count:] - points[:count]
            lengths = np.sqrt((between * between).sum(axis=1))
            along = between / np.maximum(lengths, POINT)[:, None]
            lines = np.hstack([along, cross_rows(points[:count], along)])
            self._pose, self._seen = kin.pose_count, (lengths, self._selection * (lines @ kin.spatial))
        return self._seen

    def force(self, v: Array) -> Array:
        """(nv,) what springs and their dampers take from the generalized force, at rates v (nv,)."""
        lengths, rows = self.stretched()
        return np.asarray((self._stiffness * (lengths - self._rest) + self._damping * rows.dot(v)).dot(rows))

    def loss(self, v: Array) -> float:
        """Power [W] lost in their dampers."""
        return float(self._damping.dot(self.stretched()[1].dot(v) ** 2))


def _carried(kin: PinKinematics, body: str, point: Array) -> Array:
    """(3,) a point of a body in the axes of the joint that carries it."""
    rotation, origin = kin.pin.offset_of[body]
    return np.asarray(origin + rotation @ point)
