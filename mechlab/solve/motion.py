"""Motion of a named frame by Pinocchio's kinematics."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.solve.kinematics import PinKinematics


def frame_motion(
    m: Mechanism, frame: str, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None
) -> tuple[Array, Array, Array]:
    """Pose (4, 4), velocity (6,) and acceleration (6,) of a Frame: linear at its origin, then angular, in world axes.

    Rates v and accelerations a (nv,) default to zero. Raises MechlabError for an unknown frame.
    """
    place = m.frame(frame)
    kin = PinKinematics(m, q, v)
    rotation, origin = kin.pose(place.body)
    point = origin + rotation @ place.placement.translation
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation @ place.placement.rotation, point
    acceleration = kin.bias(place.body, point)
    if a is not None:
        acceleration = acceleration + kin.jacobian(place.body, point) @ np.asarray(a, dtype=float)
    return pose, kin.velocity(place.body, point), acceleration
