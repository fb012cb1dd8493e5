"""Shaking force and moment, and instant centres, along a cycle: kinematics alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.mechanism import GROUND, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array, cross
from mechlab.study.closed_path import PathPoint

MANY = 7
"""With more moving bodies only their centres against the ground are given."""


def shaking(m: Mechanism, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """(n, 3) force [N] and (n, 3) moment [N m] about the world's origin that the inertia of all bodies exerts on the
    ground: minus the rates of momentum and angular momentum. Weight is not in it; shafts and armatures are not."""
    tree = TreeKinematics(m)
    force, moment = np.zeros((len(q), 3)), np.zeros((len(q), 3))
    massive = [b for b in m.bodies if b.inertia.mass > 0.0]
    for k in range(len(q)):
        tree.set(q[k], v[k])
        for body in massive:
            rotation, origin = tree.pose(body.name)
            com = origin + rotation @ np.array(body.inertia.com)
            motion = tree.bias(body.name, com) + tree.jacobian(body.name, com) @ a[k]
            spin = tree.velocity(body.name, com)[3:]
            tensor = rotation @ body.inertia.matrix() @ rotation.T
            f = body.inertia.mass * motion[:3]
            force[k] -= f
            moment[k] -= cross(com, f) + tensor @ motion[3:] + cross(spin, tensor @ spin)
    return force, moment


def instant_centres(m: Mechanism, poses: Sequence[PathPoint], normal: Array) -> dict[str, Array]:
    """centre_A_B_x, _y, _z (n,): where body B turns about A at the instant, for all pairs (many bodies: the ground's).

    In the plane through the world's origin; not a number where the pair does not turn: the centre is at infinity.
    """
    moving = [b.name for b in m.bodies if b.joints]
    names = [GROUND, *moving]
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    if len(moving) > MANY:
        pairs = [(GROUND, b) for b in moving]
    tree = TreeKinematics(m)
    out = {f"centre_{a}_{b}_{x}": np.full(len(poses), np.nan) for a, b in pairs for x in "xyz"}
    for k, pose in enumerate(poses):
        tree.set(pose.q, pose.u)
        twist = {n: tree.velocity(n, np.zeros(3)) for n in names}
        fastest = max(float(np.linalg.norm(t[3:])) for t in twist.values())
        for a, b in pairs:
            relative = twist[b] - twist[a]
            w = float(relative[3:] @ normal)
            if abs(w) > 1e-9 * max(fastest, 1e-300):
                place = cross(normal, relative[:3]) / w
                for i, letter in enumerate("xyz"):
                    out[f"centre_{a}_{b}_{letter}"][k] = place[i]
    return out
