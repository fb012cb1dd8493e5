"""Closing a mechanism, the check of its assembly mode, and making a closed pose the reference pose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.followed_mode import same_sign
from mechlab.mechanism.geometry import Array, Placement, axis_rotation, quaternion_to_matrix, unit
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.length_unit import coordinate_units, in_unit_of_length, is_length
from mechlab.mechanism.many_rows import ManyRows
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, Status, follow, newton
from mechlab.mechanism.parts import LOOP_ROWS, Body
from mechlab.mechanism.structure import independent_rows, rows_repeat

NEAR = 1e-6
"""Poses that differ by less [rad or m] are in the same mode: where two modes are so close the sign is rounding."""


def _tree(mechanism: Mechanism) -> tuple[TreeKinematics, ConstraintSet]:
    return TreeKinematics(mechanism), ConstraintSet(mechanism)


def close(
    mechanism: Mechanism,
    q: Array | None = None,
    targets: dict[str, float] | None = None,
    *,
    start: Array | None = None,
    steps: int = 1,
) -> Assembly:
    """Coordinates that close all loops and relations and give the joints or shafts in `targets` their physical values.

    Newton from `q` (default: the reference pose); with `steps` > 1 the targets are approached by path continuation from
    there, which keeps the assembly mode. A change of mode is reported as WRONG_MODE, never as solved.
    """
    if mechanism.length_scale != 1.0:
        return _close_in_own_unit(mechanism, q, dict(targets or {}), start=start, steps=steps)
    goal = dict(targets or {})
    first = mechanism.reference() if q is None else np.asarray(q, dtype=float)
    begin = np.array([mechanism.value(name, first) for name in goal])
    end = np.array([goal[name] for name in goal])
    equations = _equations(mechanism, tuple(goal), steps)

    def evaluate(x: Array, s: float) -> tuple[Array, Array]:
        return equations(x, begin + s * (end - begin))

    def step(x: Array, dv: Array) -> Array:
        return integrate(mechanism, x, dv)

    if steps > 1:
        found = follow(evaluate, step, first, steps=steps)
    else:
        found = newton(lambda x: evaluate(x, 1.0), step, first)
    if found.closed and len(goal) and not same_mode(mechanism, first, found.q, list(goal)):
        return Assembly(found.q, found.residual, found.iterations, Status.WRONG_MODE)
    return found


def _equations(mechanism: Mechanism, names: Sequence[str], steps: int) -> Callable[[Array, Array], tuple[Array, Array]]:
    """Residual (m,) and Jacobian (m, nv) of the closure and of the values of `names`, at a pose (nq,) with their targets (k,); prepared
    where a path of `steps` asks often enough."""
    if steps > 1 and all(j.nv == 1 for j in mechanism.joints):
        return ManyRows(mechanism, names).one
    tree, constraints = _tree(mechanism)
    rows = np.array([mechanism.row(name) for name in names]).reshape(len(names), mechanism.nv)
    kept: list[tuple[Array, Array, Array, Array]] = []

    def at(x: Array, targets: Array) -> tuple[Array, Array]:
        if not kept or kept[0][0] is not x:  # a step of the path begins where the last one ended
            tree.set(x)
            now = np.array([mechanism.value(name, x) for name in names])
            kept[:] = [(x, constraints.residual(tree), now, np.vstack([constraints.jacobian(tree), rows]))]
        _, gap, values, jacobian = kept[0]
        return np.concatenate([gap, values - targets]), jacobian

    return at


def _close_in_own_unit(
    mechanism: Mechanism, q: Array | None, targets: dict[str, float], *, start: Array | None, steps: int
) -> Assembly:
    """`close` in the unit of length that fits the mechanism; the residual is in that unit."""
    unit = mechanism.length_scale
    units = coordinate_units(mechanism, unit)
    goal = {n: x / unit if is_length(mechanism, n) else x for n, x in targets.items()}
    first, begin = (None if x is None else np.asarray(x, dtype=float) / units for x in (q, start))
    found = close(in_unit_of_length(mechanism, unit), first, goal, start=begin, steps=steps)
    return replace(found, q=found.q * units)


def mode_sign(mechanism: Mechanism, q: Array, held: Sequence[str]) -> int:
    """Sign of det of [J of the closure; rows of the `held` joints or shafts], on an independent set of rows.

    With those joints held, it changes only where two assembly modes meet. 0: the matrix is not square
    (the held ones do not fix the mechanism, or rows are redundant in a way that changes).
    """
    tree, constraints = _tree(mechanism)
    return _sign(tree.set(q), constraints, held)


def _sign(tree: TreeKinematics, constraints: ConstraintSet, held: Sequence[str]) -> int:
    mechanism, jacobian = tree.mechanism, constraints.jacobian(tree)
    rows = np.array([mechanism.row(n) for n in held]).reshape(len(held), mechanism.nv)
    keep = independent_rows(mechanism, constraints)
    matrix = np.vstack([jacobian[keep], rows])
    if matrix.shape[0] != matrix.shape[1]:
        return 0
    sign, logdet = np.linalg.slogdet(matrix)
    return int(sign) if logdet > -60 else 0


def same_mode(mechanism: Mechanism, before: Array, after: Array, held: Sequence[str]) -> bool:
    """True when both poses lie in the same assembly mode for the `held` joints, when they are one pose to NEAR, or when the sign does
    not decide."""
    if float(np.max(np.abs(before - after), initial=0.0)) < NEAR:
        return True
    tree, constraints = _tree(mechanism)
    if rows_repeat(mechanism):
        rows = np.array([mechanism.row(n) for n in held]).reshape(len(held), mechanism.nv)
        return same_sign(constraints.jacobian(tree.set(before)), constraints.jacobian(tree.set(after)), rows)
    a, b = (_sign(tree.set(q), constraints, held) for q in (before, after))
    return a == 0 or b == 0 or a == b


def assembled_pose(m: Mechanism, guess: Mapping[str, float], hold: Sequence[str]) -> Array:
    """(nq,) coordinates closed by Newton from `guess` (joint name -> change from the placements as given).

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
    """The body with the pose q moved into its placement, so that its coordinates there are zero.

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
