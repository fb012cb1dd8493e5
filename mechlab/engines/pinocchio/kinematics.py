"""The Kinematics of a Mechanism on Pinocchio's data: poses, Jacobians, velocities, bias accelerations in world axes; and the motion
of a named frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.model import PinModel, to_pinocchio
from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.model import Mechanism


class PinKinematics:
    """Implements `mechlab.mechanism.kinematics.Kinematics` with Pinocchio. `set(q, v)` first; then ask.

    q (nq,) and v (nv,) as in the Mechanism. `spatial` (6, nv) are the columns of all joints (linear at the world's
    origin, angular), `spatial_rate` their time derivative; `support` (joints, nv) says which columns move a joint.
    """

    def __init__(self, mechanism: Mechanism | PinModel, q: ArrayLike | None = None, v: ArrayLike | None = None) -> None:
        self.pin = mechanism if isinstance(mechanism, PinModel) else to_pinocchio(mechanism)
        self.mechanism = self.pin.mechanism
        self.model = self.pin.model
        self.work = self.pin.workspace()
        self.pose_count = 0
        self.q, self._state = np.zeros(0), b""
        self.support = np.zeros((self.model.njoints, self.model.nv))
        for j in range(1, self.model.njoints):
            for i in list(self.model.supports[j])[1:]:
                self.support[j, self.model.idx_vs[i] : self.model.idx_vs[i] + self.model.nvs[i]] = 1.0
        self.set(self.mechanism.reference() if q is None else q, v)

    def set(self, q: ArrayLike, v: ArrayLike | None = None) -> PinKinematics:
        """Move to coordinates q (nq,) and rates v (nv,); rates default to zero. Raises MechlabError for a wrong
        size."""
        m = self.mechanism
        if v is not None:
            v = np.asarray(v, dtype=float)
            if v.shape != (m.nv,):
                raise MechlabError(f"{m.name}: rates have shape {np.shape(v)}, expected ({m.nv},).")
        q = np.asarray(q, dtype=float)
        state = q.tobytes()
        if state != self._state or q.shape != self.q.shape:
            self.q_pin = self.pin.to_pin(q)
            self.q, self._state = q.copy(), state
            self.pose_count += 1
        self.still = v is None
        self.v = np.zeros(m.nv) if v is None else v
        self._placed: Any = None
        self._twists: tuple[Array, Array] | None = None
        return self

    def placed(self) -> Any:
        """Pinocchio's data with placements `oMi`, joint columns `J` and their rates `dJ` of the present state (or `Placed`); computed
        when first asked for, as a tree without loops does its dynamics without them."""
        if self._placed is None:
            self._placed = self.work.place(self.q_pin, None if self.still else self.v)
        return self._placed

    @property
    def spatial(self) -> Array:
        """(6, nv) columns of all joints: linear at the world's origin, angular."""
        return np.asarray(self.placed().J).reshape(6, -1)  # of one coordinate Pinocchio gives a vector

    @property
    def spatial_rate(self) -> Array:
        """(6, nv) time derivative of `spatial`."""
        return np.zeros((6, self.model.nv)) if self.still else self.placed().dJ.reshape(6, -1)

    def _joint(self, body: str) -> int:
        try:
            return self.pin.joint_of[body]
        except KeyError:
            raise unknown(f"{self.mechanism.name}: body", body, self.pin.joint_of) from None

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3) body to world and origin (3,) of a body."""
        joint = self.placed().oMi[self._joint(body)]
        rotation, origin = self.pin.offset_of[body]
        return joint.rotation @ rotation, joint.translation + joint.rotation @ origin

    def jacobian(self, body: str, point: ArrayLike) -> Array:
        """(6, nv): linear velocity at the world `point` and angular velocity, from v."""
        out = self.spatial * self.support[self._joint(body)]
        x, y, z = np.asarray(point, dtype=float).tolist()
        w0, w1, w2 = out[3], out[4], out[5]
        out[0] += w1 * z - w2 * y
        out[1] += w2 * x - w0 * z
        out[2] += w0 * y - w1 * x
        return out

    def twists(self) -> tuple[Array, Array]:
        """(joints, 6) spatial velocities (linear at the world's origin, angular), and their rates at zero
        accelerations."""
        if self._twists is None:
            if self.still:
                self._twists = (np.zeros((self.model.njoints, 6)), np.zeros((self.model.njoints, 6)))
            else:
                self._twists = (
                    self.support @ (self.spatial * self.v).T,
                    self.support @ (self.spatial_rate * self.v).T,
                )
        return self._twists

    def velocity(self, body: str, point: ArrayLike) -> Array:
        """(6,) velocity at the world `point` of the body, and angular velocity."""
        twist = self.twists()[0][self._joint(body)]
        return np.concatenate([twist[:3] + cross(twist[3:], point), twist[3:]])

    def bias(self, body: str, point: ArrayLike) -> Array:
        """(6,) acceleration at the world `point`, and angular acceleration, at zero joint acceleration."""
        joint = self._joint(body)
        twist, rate = self.twists()[0][joint], self.twists()[1][joint]
        moving = twist[:3] + cross(twist[3:], point)
        return np.concatenate([rate[:3] + cross(rate[3:], point) + cross(twist[3:], moving), rate[3:]])


def frame_state(kin: PinKinematics, frame: str) -> tuple[Array, Array, Array, Array]:
    """Pose (4, 4), velocity (6,), Jacobian (6, nv) and dJ/dt v (6,) of a Frame at the state of `kin`: linear at its origin, then
    angular, in world axes. Raises MechlabError for an unknown frame."""
    place = kin.mechanism.frame(frame)
    rotation, origin = kin.pose(place.body)
    point = origin + rotation @ place.placement.translation
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation @ place.placement.rotation, point
    return pose, kin.velocity(place.body, point), kin.jacobian(place.body, point), kin.bias(place.body, point)


def frame_motion(
    mechanism: Mechanism, frame: str, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None
) -> tuple[Array, Array, Array]:
    """Pose (4, 4), velocity (6,) and acceleration (6,) of a Frame: linear at its origin, then angular, in world axes.

    Rates v and accelerations a (nv,) default to zero. Raises MechlabError for an unknown frame.
    """
    pose, velocity, jacobian, acceleration = frame_state(PinKinematics(mechanism, q, v), frame)
    if a is not None:
        acceleration = acceleration + jacobian @ np.asarray(a, dtype=float)
    return pose, velocity, acceleration
