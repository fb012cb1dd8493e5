"""Making an assembled pose the reference pose: the coordinates a guess closes to, and the bodies with these taken in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.assembly import close
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array, Placement, axis_rotation, quaternion_to_matrix, unit
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS, Body


def assembled_pose(m: Mechanism, guess: Mapping[str, float], hold: Sequence[str]) -> Array:
    """(nq,) coordinates closed by Newton from `guess` (joint name -> value away from the placements as given).

    Joints in `hold` keep their guess exactly. Raises MechlabError that names the loop that stays open.
    """
    q = m.reference()
    for name, value in guess.items():
        m.joint(name)
        start = m.q_slice[name].start
        if m.joint(name).kind == "spherical":  # a ball joint for a tilt: the guess turns about the axis it had
            turn = np.array(m.joint(name).axis) * np.sin(0.5 * float(value))
            q[start : start + 4] = [np.cos(0.5 * float(value)), *turn]
        else:
            q[start] = float(value)
    zeros = {n: m.zero(n) for n in hold}
    found = close(m, q, {n: zeros[n] + q[m.q_slice[n].start] for n in hold})
    if not found.closed:
        constraints = ConstraintSet(m)
        residual = constraints.residual(TreeKinematics(m, found.q))
        loops = sum(LOOP_ROWS[x.kind] for x in m.loops)  # a loop that cannot meet also keeps relations open
        worst = int(np.argmax(np.abs(residual[: loops or None])))
        raise MechlabError(
            f"{m.name}: it does not close: {constraints.rows[worst]} stays open by {abs(residual[worst]):.3g} "
            f"({found.status.value}). Are the lengths long enough to meet? Is the guess near the mode you want?"
        )
    return found.q


def rebased(body: Body, m: Mechanism, q: Array) -> Body:
    """The same body with its coordinates q taken into the placement, so that they become zero.

    Raises MechlabError for a joint that slides after one that turns.
    """
    turn, shift = np.eye(3), np.zeros(3)
    moves: list[Array] = []
    for joint in body.joints:
        x = q[m.q_slice[joint.name]]
        if joint.kind == "prismatic":
            if x[0] != 0.0 and not np.allclose(turn, np.eye(3)):
                raise MechlabError(
                    f"body {body.name!r}: joint {joint.name!r} slides after a turn; put it into a body of its own."
                )
            shift = shift + np.array(joint.axis) * x[0]
            moves.append(np.eye(3))
        else:
            r = axis_rotation(joint.axis, x[0]) if joint.kind == "revolute" else quaternion_to_matrix(x)
            turn = turn @ r
            moves.append(r)
    joints = []
    for k, joint in enumerate(body.joints):
        after = np.eye(3)
        for r in moves[k + 1 :]:
            after = after @ r
        axis = joint.axis if np.array_equal(after, np.eye(3)) else unit(after.T @ np.array(joint.axis), "axis")
        moved = float(q[m.q_slice[joint.name].start]) if joint.nv == 1 else 0.0
        joints.append(replace(joint, axis=axis, zero=joint.zero + moved))
    placement = body.placement
    if np.any(shift) or not np.array_equal(turn, np.eye(3)):
        placement = placement @ Placement.of(turn, shift)
    return replace(body, placement=placement, joints=tuple(joints))
