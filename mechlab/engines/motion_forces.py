"""What a given motion of one drive needs, and what static loads put on the loops: the answers of engines as arrays over n states.

All vectors are in world axes. A wrench (6,) is a force [N], then a moment [N m].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class MotionForces:
    """Inverse dynamics at n states.

    drive (n,): force of the drive [N or N m]. loops: loop -> (n, 6) wrench on its body b, about frame b. joints: joint ->
    (n, 6) wrench on its body from the parent, about the joint; for a body with several joints an engine may give the last
    alone. relations: relation -> (n,) reaction, as the torque on the joint of coefficient 1; empty where it is not read.
    """

    drive: Array
    loops: Mapping[str, Array]
    joints: Mapping[str, Array]
    relations: Mapping[str, Array]


@dataclass(frozen=True)
class LoopLoads:
    """Forces that loops carry under static loads, without mass and weight, at n states. force: loop -> (n, 3) force on
    its body b at the loop [N]; velocity: loop -> (n, 3) velocity of the point of body b there [m/s]."""

    force: Mapping[str, Array]
    velocity: Mapping[str, Array]
