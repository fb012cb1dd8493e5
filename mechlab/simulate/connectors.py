"""Connectors: the small bodies that stand for the freedoms of a closing prismatic, cylindrical or universal joint.

MuJoCo closes a loop by `connect` or `weld` only. A loop of another kind becomes a body that hangs on one side of the
loop with the joints of that kind, and is welded to the other side. Its coordinates are not of the Mechanism; in an
assembled pose they follow in closed form from where the weld wants the body to be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array, cross, quaternion_to_matrix


@dataclass(frozen=True)
class Connector:
    """A connector body, its joints (engine ids) and the weld that holds it."""

    model: mujoco.MjModel
    body: int
    joints: tuple[int, ...]
    weld: int

    def place(self, data: mujoco.MjData, qpos: Array) -> None:
        """Write the coordinates into `qpos` that put the connector where the weld wants it.

        `data` has the poses of all bodies that are no connectors (mj_kinematics).
        """
        model = self.model
        parent = int(model.body_parentid[self.body])
        rest = data.xmat[parent].reshape(3, 3) @ quaternion_to_matrix(model.body_quat[self.body])
        origin = data.xpos[parent] + data.xmat[parent].reshape(3, 3) @ model.body_pos[self.body]
        rotation, position = self._target(data)
        turn = rest.T @ rotation
        shift = rest.T @ (position - origin)
        slides = [j for j in self.joints if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE]
        hinges = [j for j in self.joints if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
        for j in slides:
            qpos[model.jnt_qposadr[j]] = model.jnt_axis[j] @ shift
        for j, angle in zip(hinges, _angles(turn, [model.jnt_axis[j] for j in hinges]), strict=True):
            qpos[model.jnt_qposadr[j]] = angle

    def _target(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """World rotation and position that the weld wants of the connector: its two sites coincide."""
        model = self.model
        own, other = int(model.eq_obj1id[self.weld]), int(model.eq_obj2id[self.weld])
        if model.site_bodyid[own] != self.body:
            own, other = other, own
        rotation = data.site_xmat[other].reshape(3, 3) @ quaternion_to_matrix(model.site_quat[own]).T
        return rotation, data.site_xpos[other] - rotation @ model.site_pos[own]


def _angles(turn: Array, axes: list[Array]) -> list[float]:
    """Angles of one hinge, or of two crossing hinges, that make the rotation `turn`."""
    if not axes:
        return []
    if len(axes) == 1:
        across = _perpendicular(axes[0])
        return [_angle(axes[0], across, turn @ across)]
    first, second = axes
    return [_angle(first, second, turn @ second), -_angle(second, first, turn.T @ first)]


def _angle(axis: Array, start: Array, end: Array) -> float:
    """Angle about `axis` from `start` to `end`, both across the axis."""
    return math.atan2(float(cross(start, end) @ axis), float(start @ end))


def _perpendicular(axis: Array) -> Array:
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    out = cross(axis, helper)
    return np.asarray(out / np.linalg.norm(out))


def find_connectors(model: mujoco.MjModel, known_dof: set[int]) -> tuple[Connector, ...]:
    """The connectors of a model: bodies whose joints are not of the Mechanism. Raises MechlabError for one that no weld
    of two sites holds."""
    bodies: dict[int, list[int]] = {}
    for j in range(model.njnt):
        if int(model.jnt_dofadr[j]) not in known_dof:
            bodies.setdefault(int(model.jnt_bodyid[j]), []).append(j)
    welds = {}
    for k in range(model.neq):
        if model.eq_type[k] == mujoco.mjtEq.mjEQ_WELD and model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
            for site in (int(model.eq_obj1id[k]), int(model.eq_obj2id[k])):
                welds[int(model.site_bodyid[site])] = k
    for body in bodies:
        if body not in welds:
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)
            raise MechlabError(f"the MuJoCo model: body {name!r} is not of the mechanism, and no weld holds it.")
    return tuple(Connector(model, body, tuple(joints), welds[body]) for body, joints in bodies.items())
