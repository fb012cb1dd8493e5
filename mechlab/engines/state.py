"""What engines answer: a mechanism at one state, the equations of motion at one instant, how a motion cannot go on; and over n
states what a given motion of one drive needs, and what static loads put on the loops.

All vectors are in world axes. A wrench (6,) is a force [N], then a moment [N m].
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

RATE_LIMIT = 1e6
"""A rate [rad/s or m/s] beyond this counts as a blow-up; the motion ends there."""


class BlowUp(Exception):
    """A motion that cannot go on: the time t [s], and the reason in words."""

    def __init__(self, t: float, reason: str) -> None:
        super().__init__(reason)
        self.t = t
        self.reason = reason


@dataclass(frozen=True)
class Instant:
    """Equations of motion at one instant: accelerations a (nv,), reactions (rows,), forces of the laws by joint or shaft, and
    power [W] that goes into the mechanism, less what dampers take."""

    a: Array
    reactions: Array
    forces: dict[str, float]
    power: float


@dataclass(frozen=True)
class EngineState:
    """A mechanism at one state as one engine computes it.

    q (nq,) coordinates [rad, m]; v (nv,) rates [rad/s, m/s].
    mass_matrix (nv, nv) M with armatures and shafts [kg m2, kg m, kg].
    bias (nv,) h of M a + h = applied + J^T reactions: velocity, gravity and passive terms without dry friction [N m, N].
    poses: body -> rotation (3, 3), body axes to world, and origin (3,) in the world [m].
    points: frame -> its origin (3,) in the world [m].
    residual (rows,) how far loops and relations are open [m, rad]; rows (rows, engine nv) its gradient; rates (engine nv,) the
    rates that it is multiplied by: v first, then those of connectors, bodies that an engine adds to close some kinds of loops.
    names (nv,): of the rates. row_names: of the Mechanism's own rows; an engine may have more.
    """

    mechanism: Mechanism
    engine: str
    q: Array
    v: Array
    mass_matrix: Array
    bias: Array
    poses: Mapping[str, tuple[Array, Array]]
    points: Mapping[str, Array]
    residual: Array
    rows: Array
    rates: Array

    @property
    def names(self) -> tuple[str, ...]:
        """(nv,) names of the rates."""
        return tuple(self.mechanism.rate_names)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Names of the Mechanism's constraint rows."""
        return tuple(ConstraintSet(self.mechanism).rows)

    @property
    def placement(self) -> Array:
        """(12 bodies + 3 frames,) rotations and origins of all bodies, then the points of all frames, as one row of numbers."""
        turned = [[*np.ravel(r), *p] for r, p in self.poses.values()]
        return np.concatenate([np.ravel(turned), np.ravel(list(self.points.values()))])


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
