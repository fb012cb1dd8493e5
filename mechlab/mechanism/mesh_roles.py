"""Which two gears a LinearRelation lets roll on each other, and in which carrier.

The power flow and the losses of a train need these roles, which follow from the tree, not from the relation. Two bodies
and a carrier fit when each body turns relative to the carrier about one line that stands still in it, and the row of
the relation is a combination of these two rates.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, LinearRelation


@dataclass(frozen=True)
class MeshRoles:
    """Relation: alpha w_a + beta w_b = 0, w the rates of gears `a`, `b` (body names) in `carrier`, each about its axis.

    `rate_a`, `rate_b` (nv,): these rates as rows; `total_a`, `total_b`: the absolute spins about the same axes; `axis_a`,
    `axis_b` (3,) world directions in the reference pose. A gear that is held is the ground.
    """

    name: str
    a: str
    b: str
    carrier: str
    alpha: float
    beta: float
    rate_a: Array
    rate_b: Array
    total_a: Array
    total_b: Array
    axis_a: Array
    axis_b: Array


@dataclass(frozen=True)
class _Turning:
    row: Array
    axis: Array
    total: Array
    point: Array


def mesh_roles(mechanism: Mechanism, relation: LinearRelation) -> MeshRoles:
    """The gears and the carrier of a relation between revolute joints.

    Raises MechlabError when it is no mesh of two gears whose axes one carrier holds.
    """
    m = mechanism
    home = {j.name: b for b in m.bodies for j in b.joints}
    parts: list[str] = []
    for name, _ in relation.coefficients:
        if m.joint(name).kind != "revolute":
            raise MechlabError(
                f"{m.name}: relation {relation.name!r} takes joint {name!r}, which is {m.joint(name).kind}; "
                "power flow knows gears that turn."
            )
        for body in (home[name].name, home[name].parent):
            if body not in parts:
                parts.append(body)
    if GROUND not in parts:
        parts.append(GROUND)
    row = m.coefficient_row(relation.coefficients)
    poses = _poses(m)
    for carrier in parts:
        turning = {x: t for x in parts if x != carrier and (t := _turning(m, poses, x, carrier)) is not None}
        for a, b in combinations(turning, 2):
            found = _fit(relation.name, row, (a, turning[a]), (b, turning[b]), carrier)
            if found is not None:
                return found
    raise MechlabError(
        f"{m.name}: relation {relation.name!r} ({' '.join(f'{c} {n}' for n, c in relation.coefficients)}) is no mesh of two "
        "gears whose axes one carrier holds; power flow cannot say where its power goes. Split it into meshes."
    )


def _poses(m: Mechanism) -> list[TreeKinematics]:
    rng = np.random.default_rng(17)
    out = [TreeKinematics(m)]
    for _ in range(2):
        q = m.reference()
        for joint in m.joints:
            if joint.nv == 1:
                q[m.q_slice[joint.name].start] = rng.uniform(-2.0, 2.0)
        out.append(TreeKinematics(m, q))
    return out


def _turning(m: Mechanism, poses: list[TreeKinematics], body: str, carrier: str) -> _Turning | None:
    """The rotation of a body relative to a carrier, about a line fixed in the carrier; None for any other motion."""
    first: tuple[Array, Array, Array] | None = None
    for tree in poses:
        r, p = tree.pose(carrier)
        twist = tree.jacobian(body, p) - tree.jacobian(carrier, p)
        local = np.vstack([r.T @ twist[:3], r.T @ twist[3:]])
        norms = np.linalg.norm(local[3:], axis=0)
        if not np.any(norms > 1e-9):
            return None
        k, sign = _column(m, body, norms)
        screw = sign * local[:, k] / norms[k]
        row = screw[3:] @ local[3:]
        # A pure rotation: every column the same screw, without a slide along it.
        if np.max(np.abs(local - np.outer(screw, row))) > 1e-9 or abs(float(screw[:3] @ screw[3:])) > 1e-9:
            return None
        if first is None:
            axis = r @ screw[3:]
            first = (screw, row, axis)
        elif np.max(np.abs(screw - first[0])) > 1e-9 or np.max(np.abs(row - first[1])) > 1e-9:
            return None
    assert first is not None
    screw, row, axis = first
    tree = poses[0]
    total = axis @ tree.jacobian(body, np.zeros(3))[3:]
    return _Turning(np.round(row, 12), axis, np.round(total, 12), cross(screw[3:], screw[:3]))


def _column(m: Mechanism, body: str, norms: Array) -> tuple[int, float]:
    """The joint that gives the axis its sense: the body's own, or (for the ground) one of the carrier."""
    own = [] if body == GROUND else [m.v_slice[j.name].start for j in m.body(body).joints]
    for k in own:
        if norms[k] > 1e-9:
            return k, 1.0
    return int(np.argmax(norms > 1e-9)), -1.0


def _fit(name: str, row: Array, a: tuple[str, _Turning], b: tuple[str, _Turning], carrier: str) -> MeshRoles | None:
    one, two = a[1], b[1]
    parallel = float(np.linalg.norm(cross(one.axis, two.axis))) < 1e-9
    if parallel and np.max(np.abs(one.point - two.point)) < 1e-9:
        return None  # two parts on one axis do not mesh
    basis = np.column_stack([one.row, two.row])
    found, *_ = np.linalg.lstsq(basis, row, rcond=None)
    alpha, beta = float(found[0]), float(found[1])
    if np.max(np.abs(basis @ found - row)) > 1e-9 or min(abs(alpha), abs(beta)) < 1e-12:
        return None
    return MeshRoles(name, a[0], b[0], carrier, alpha, beta, one.row, two.row, one.total, two.total, one.axis, two.axis)
