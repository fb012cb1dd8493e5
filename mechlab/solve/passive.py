"""Passive forces of a Mechanism: dampers and springs of joints and shafts, springs between points, dry friction."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import Kinematics
from mechlab.mechanism.model import Joint, Mechanism, Shaft, Spring
from mechlab.solve.model import rate_columns


class Passive:
    """The constant data of passive forces, gathered once."""

    def __init__(self, mechanism: Mechanism) -> None:
        m = mechanism
        self.mechanism = m
        shafts = m.shafts
        self.rows = np.array([m.row(s.name) for s in shafts]).reshape(-1, m.nv)
        self.inertia = (self.rows.T * [s.inertia for s in shafts]) @ self.rows if shafts else np.zeros((m.nv, m.nv))
        self.has_shaft_inertia = bool(np.any(self.inertia))
        self.damping = np.diag([j.damping for j in m.joints for _ in range(j.nv)])
        if shafts:
            self.damping = self.damping + (self.rows.T * [s.damping for s in shafts]) @ self.rows
        items: list[Joint | Shaft] = [*m.joints, *shafts]
        elastic = [x for x in items if x.stiffness]
        self.stiffness = np.array([x.stiffness for x in elastic])
        self.elastic_rows = np.array([m.row(x.name) for x in elastic]).reshape(-1, m.nv)
        self.unstretched = np.array([x.spring_rest - x.zero for x in elastic])
        self.columns = rate_columns(m)
        self.springs = m.springs
        rough = [x for x in items if x.friction]
        self.friction = np.array([f for x in rough for f in ([x.friction] * getattr(x, "nv", 1))])
        self.friction_names = tuple(x.name for x in rough)
        self.friction_rows = _friction_rows(m, rough)

    def force(self, kin: Kinematics, v: Array) -> Array:
        """(nv,) f of M a + c + f = applied: damping and stiffness of joints and shafts, springs; without dry
        friction."""
        out = self.damping @ v
        if len(self.stiffness):
            stretch = self.elastic_rows @ kin.q[self.columns] - self.unstretched
            out += self.elastic_rows.T @ (self.stiffness * stretch)
        for spring in self.springs:
            out -= spring_force(kin, spring)
        return np.asarray(out)

    def loss(self, kin: Kinematics, v: Array) -> float:
        """Power [W] lost in dampers, without dry friction."""
        power = float(v @ self.damping @ v)
        for spring in self.springs:
            if spring.damping:
                a, b, _ = spring_ends(kin, spring)
                relative = kin.velocity(spring.body_b, b)[:3] - kin.velocity(spring.body_a, a)[:3]
                square = float((b - a) @ (b - a))
                power += spring.damping * float((b - a) @ relative) ** 2 / square if square > 1e-24 else 0.0
        return power

    def friction_force(self, v: Array, width: Array | float) -> Array:
        """(nv,) dry friction as it acts on the joints: -friction tanh(rate / width), `width` the rate at which it is
        smoothed."""
        if not len(self.friction):
            return np.zeros(len(v))
        return np.asarray(-self.friction_rows.T @ (self.friction * np.tanh((self.friction_rows @ v) / width)))


def _friction_rows(m: Mechanism, rough: list[Joint | Shaft]) -> Array:
    rows: list[Array] = []
    for item in rough:
        if item.name in m.v_slice:
            rows += list(np.eye(m.nv)[m.v_slice[item.name]])
        else:
            rows.append(m.row(item.name))
    return np.array(rows).reshape(-1, m.nv)


def spring_ends(kin: Kinematics, spring: Spring) -> tuple[Array, Array, Array]:
    """World points a and b of a spring, and the force (3,) [N] that it exerts on body b (opposite on a)."""
    (ra, pa), (rb, pb) = kin.pose(spring.body_a), kin.pose(spring.body_b)
    a, b = pa + ra @ np.array(spring.point_a), pb + rb @ np.array(spring.point_b)
    d = b - a
    length = float(np.linalg.norm(d))
    if length < 1e-12:
        return a, b, np.zeros(3)
    along = d / length
    rate = along @ (kin.velocity(spring.body_b, b)[:3] - kin.velocity(spring.body_a, a)[:3])
    tension = spring.stiffness * (length - spring.rest_length) + spring.damping * rate
    return a, b, -tension * along


def spring_force(kin: Kinematics, spring: Spring) -> Array:
    """(nv,) generalised force of a spring between two points."""
    a, b, force = spring_ends(kin, spring)
    relative = kin.jacobian(spring.body_b, b)[:3] - kin.jacobian(spring.body_a, a)[:3]
    return np.asarray(force @ relative)
