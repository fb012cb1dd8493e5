"""Statics with numpy alone: which drive forces hold a pose, and how well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import Kinematics, TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft, Spring


def spring_stretch(kin: Kinematics, spring: Spring) -> tuple[Array, Array, float, float]:
    """World end points a and b (3,) of a spring, its length [m] and the rate of the length [m/s]."""
    (ra, pa), (rb, pb) = kin.pose(spring.body_a), kin.pose(spring.body_b)
    a, b = pa + ra @ np.array(spring.point_a), pb + rb @ np.array(spring.point_b)
    d = b - a
    length = float(np.linalg.norm(d))
    if length < 1e-12:
        return a, b, 0.0, 0.0
    relative = kin.velocity(spring.body_b, b)[:3] - kin.velocity(spring.body_a, a)[:3]
    return a, b, length, float(d @ relative) / length


def spring_pull(kin: Kinematics, spring: Spring) -> tuple[Array, Array, Array]:
    """World end points a and b of a spring, and the force (3,) [N] that it exerts on body b (the opposite on a)."""
    a, b, length, rate = spring_stretch(kin, spring)
    if length == 0.0:
        return a, b, np.zeros(3)
    tension = spring.stiffness * (length - spring.rest_length) + spring.damping * rate
    return a, b, -tension * (b - a) / length


def spring_force(kin: Kinematics, spring: Spring) -> Array:
    """(nv,) generalised force of a spring between two points."""
    a, b, force = spring_pull(kin, spring)
    relative = kin.jacobian(spring.body_b, b)[:3] - kin.jacobian(spring.body_a, a)[:3]
    return np.asarray(force @ relative)


def passive_force(tree: TreeKinematics) -> Array:
    """(nv,) force of springs and dampers of joints, shafts and between points. Dry friction is not in it."""
    m = tree.mechanism
    out = np.zeros(m.nv)
    for joint in m.joints:
        if joint.kind == "spherical":
            s = m.v_slice[joint.name]
            out[s] -= joint.damping * tree.v[s]
    turning: list[Joint | Shaft] = [j for j in m.joints if j.nv == 1]
    for item in (*turning, *m.shafts):
        if item.damping or item.stiffness:
            row = m.row(item.name)
            stretch = float(m.value(item.name, tree.q)) - item.spring_rest
            out -= row * (item.stiffness * stretch + item.damping * float(row @ tree.v))
    for spring in m.springs:
        out += spring_force(tree, spring)
    return out


def holding_forces(mechanism: Mechanism, q: Array, drives: Sequence[str]) -> dict[str, float]:
    """Forces of the named joints or shafts that hold the mechanism at rest in the assembled pose q (nq,).

    Solves B^T f + J^T r = h(q, 0) - passive in the least-squares sense. Raises MechlabError when these drives cannot
    hold the pose (the remainder exceeds 1e-6 of the load).
    """
    forces, rest, load = _balance(mechanism, q, drives)
    if rest > 1e-6 * max(load, 1e-12):
        raise MechlabError(
            f"{mechanism.name}: the drives {', '.join(drives) or 'none'} cannot hold this pose: {rest:.3g} of a load of {load:.3g} stays."
        )
    return forces


def _balance(mechanism: Mechanism, q: Array, drives: Sequence[str]) -> tuple[dict[str, float], float, float]:
    tree = TreeKinematics(mechanism, q)
    load = tree.bias_force() - passive_force(tree)
    rows = [mechanism.row(n) for n in drives]
    matrix = np.vstack([np.array(rows).reshape(-1, mechanism.nv), ConstraintSet(mechanism).jacobian(tree)]).T
    solution = np.linalg.lstsq(matrix, load, rcond=1e-11)[0] if matrix.shape[1] else np.zeros(0)
    rest = float(np.max(np.abs(matrix @ solution - load), initial=0.0))
    return (
        dict(zip(drives, solution[: len(drives)].tolist(), strict=True)),
        rest,
        float(np.max(np.abs(load), initial=0.0)),
    )
