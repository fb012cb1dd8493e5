"""Statics with numpy alone: forces of springs and dampers, and the drive forces that hold a pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
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


def spring_row(kin: Kinematics, spring: Spring) -> tuple[float, Array]:
    """Length [m] of a spring between two points, and (nv,) its gradient: the rate of the length is row @ v."""
    (ra, pa), (rb, pb) = kin.pose(spring.body_a), kin.pose(spring.body_b)
    a, b = pa + ra @ np.array(spring.point_a), pb + rb @ np.array(spring.point_b)
    d = b - a
    length = float(np.linalg.norm(d))
    relative = kin.jacobian(spring.body_b, b)[:3] - kin.jacobian(spring.body_a, a)[:3]
    if length < 1e-12:
        return 0.0, np.zeros(relative.shape[1])
    return length, (d / length) @ relative


def spring_force(kin: Kinematics, spring: Spring) -> Array:
    """(nv,) generalized force of a spring between two points."""
    length, row = spring_row(kin, spring)
    tension = spring.stiffness * (length - spring.rest_length) + spring.damping * float(row @ kin.v)
    return -tension * row


def passive_force(tree: TreeKinematics) -> Array:
    """(nv,) generalized force of springs and dampers of joints, of shafts and between points, without dry friction."""
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


@dataclass(frozen=True)
class DryFriction:
    """Dry friction of joints and shafts: names (k,) of those that have it, sizes (k,) [N m or N], rows (k, nv) of their rates; a
    spherical joint has three."""

    names: tuple[str, ...]
    sizes: Array
    rows: Array

    @staticmethod
    def of(m: Mechanism) -> DryFriction:
        """That of a mechanism."""
        items: list[Joint | Shaft] = [*m.joints, *m.shafts]
        names, sizes, rows = [], [], []
        for x in (x for x in items if x.friction):
            own = list(np.eye(m.nv)[m.v_slice[x.name]]) if x.name in m.v_slice else [m.row(x.name)]
            names += [x.name] * len(own)
            sizes += [x.friction] * len(own)
            rows += own
        return DryFriction(tuple(names), np.array(sizes), np.array(rows).reshape(-1, m.nv))

    def force(self, v: Array, width: Array | float) -> Array:
        """(nv,) as it acts on the joints at rates v (nv,): -friction tanh(rate / width), `width` the rate at which it is smoothed;
        0: -friction sign(rate)."""
        if not len(self.sizes):
            return np.zeros(len(v))
        rate = self.rows @ v
        sense = np.tanh(rate / width) if np.all(width) else np.sign(rate)
        return np.asarray(-self.rows.T @ (self.sizes * sense))


@dataclass(frozen=True)
class HoldingForces:
    """Forces of drives that hold a pose at rest, and the unbalanced rest.

    forces: drive -> N or N m, within its limit. unbalanced (nv,): the generalized force that neither drives nor constraints
    carry; load (nv,): the generalized force to be carried.
    """

    forces: dict[str, float]
    unbalanced: Array
    load: Array

    @property
    def holds(self) -> bool:
        """True when nothing but rounding stays unbalanced."""
        return _largest(self.unbalanced) < 1e-8 * max(1e-9, _largest(self.load))

    def sentence(self, m: Mechanism) -> str:
        """Whether the drives hold, in words."""
        if self.holds:
            return "the drives hold the reference pose"
        worst = int(np.argmax(np.abs(self.unbalanced)))
        return (
            f"the drives cannot hold the reference pose: {abs(self.unbalanced[worst]):.3g} N m or N "
            f"stay unbalanced at {m.rate_names[worst]}"
        )


def _largest(force: Array) -> float:
    return float(np.max(np.abs(force), initial=0.0))


def _hold(m: Mechanism, q: Array, drives: Mapping[str, str], limits: Array) -> HoldingForces:
    """Solve B^T f + J^T r = h(q, 0) - passive in the least-squares sense for drive forces f and reactions r.

    drives: name -> joint or shaft; limits: (drives,) of |f|. A drive that meets its limit stays there, and the others and
    the reactions are solved again.
    """
    tree = TreeKinematics(m, q)
    needed = tree.bias_force() - passive_force(tree)
    rows = np.array([m.row(on) for on in drives.values()]).reshape(len(drives), m.nv)
    reactions = ConstraintSet(m).jacobian(tree)
    force, free, rest = np.zeros(len(drives)), np.ones(len(drives), dtype=bool), needed
    for _ in range(len(drives) + 1):
        both = np.vstack([rows[free], reactions]).T
        load = needed - rows[~free].T @ force[~free]
        found = np.linalg.lstsq(both, load, rcond=1e-11)[0] if both.shape[1] else np.zeros(0)
        rest = load - both @ found
        force[free] = found[: int(free.sum())]
        over = free & (np.abs(force) > limits)
        if not over.any():
            break
        force[over] = np.clip(force[over], -limits[over], limits[over])
        free &= ~over
    return HoldingForces({n: float(f) + 0.0 for n, f in zip(drives, force, strict=True)}, rest, needed)


def holding_forces(mechanism: Mechanism, q: Array, drives: Sequence[str]) -> dict[str, float]:
    """Forces of the named joints or shafts that hold the mechanism at rest in the assembled pose q (nq,).

    Raises MechlabError when these drives cannot hold the pose (more than 1e-6 of the load stays unbalanced).
    """
    found = _hold(mechanism, q, {n: n for n in drives}, np.full(len(drives), np.inf))
    rest, load = _largest(found.unbalanced), _largest(found.load)
    if rest > 1e-6 * max(load, 1e-12):
        raise MechlabError(
            f"{mechanism.name}: the drives {', '.join(drives) or 'none'} cannot hold this pose: {rest:.3g} of a load of {load:.3g} stays."
        )
    return found.forces


def hold_reference_pose(m: Mechanism) -> HoldingForces:
    """Forces of the drives, each within its limit, that hold the reference pose as well as they can."""
    limits = np.array([np.inf if d.limit is None else d.limit for d in m.drives])
    return _hold(m, m.reference(), {d.name: d.on for d in m.drives}, limits)
