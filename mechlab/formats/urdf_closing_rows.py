"""Rows of a loop far from closure: as Newton needs them that starts at any pose, and must not end at half turns."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.constraints import Constraint, LoopConstraint
from mechlab.mechanism.geometry import Array, rotation_log, skew
from mechlab.mechanism.kinematics import Kinematics


class _Turned:
    """A fixed or sliding loop whose rows of rotation are the rotation vector between its ends. Its own rows, sines between
    axes, vanish at half turns, too, in which Newton would end as often as in the pose that is meant."""

    def __init__(self, constraint: LoopConstraint) -> None:
        self.constraint, self.loop = constraint, constraint.loop
        self.offsets = len(constraint.rows) - 3

    def residual(self, kin: Kinematics) -> Array:
        """(rows,) offsets [m] and rotation vector [rad]."""
        ra, pa, rb, pb = self.constraint.ends(kin)
        return np.concatenate([(ra.T @ (pb - pa))[: self.offsets], rotation_log(ra.T @ rb)])

    def jacobian(self, kin: Kinematics) -> Array:
        """(rows, nv)."""
        ra, pa, rb, pb = self.constraint.ends(kin)
        ja, jb = kin.jacobian(self.loop.body_a, pa), kin.jacobian(self.loop.body_b, pb)
        w = rotation_log(ra.T @ rb)
        angle, cross = float(np.linalg.norm(w)), skew(w)
        factor = 1.0 / 12.0 if angle < 1e-4 else 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * max(np.sin(angle), 1e-9))
        inverse = np.eye(3) - 0.5 * cross + factor * cross @ cross
        offsets = ra.T @ (jb[:3] - ja[:3] + skew(pb - pa) @ ja[3:])
        return np.vstack([offsets[: self.offsets], inverse @ ra.T @ (jb[3:] - ja[3:])])


class _Pin:
    """A loop about an axis; a pose in which the two axes point against each other is none of it."""

    def __init__(self, constraint: LoopConstraint) -> None:
        self.constraint = constraint

    def _opposed(self, kin: Kinematics) -> bool:
        ra, _, rb, _ = self.constraint.ends(kin)
        return bool(ra[:, 2] @ rb[:, 2] < 0.0)

    def residual(self, kin: Kinematics) -> Array:
        """(rows,) that of the loop; where the axes are opposed, its last row, a sine s, is +-(2 - |s|)."""
        out = self.constraint.residual(kin)
        if self._opposed(kin):
            out[-1] = np.copysign(2.0 - abs(out[-1]), out[-1])
        return out

    def jacobian(self, kin: Kinematics) -> Array:
        """(rows, nv)."""
        out = self.constraint.jacobian(kin)
        if self._opposed(kin):
            out[-1] *= -1.0
        return out


def closing_rows(constraint: Constraint) -> Constraint | _Turned | _Pin:
    """The rows of a constraint with which Newton closes it from afar: its own, where these vanish in the poses that are meant alone."""
    if isinstance(constraint, LoopConstraint) and constraint.loop.kind in ("fixed", "prismatic"):
        return _Turned(constraint)
    if isinstance(constraint, LoopConstraint) and constraint.loop.kind in ("revolute", "cylindrical"):
        return _Pin(constraint)
    return constraint
