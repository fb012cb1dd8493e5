"""Passive forces of a Mechanism: dampers and springs of joints and shafts, springs between points, dry friction."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import Kinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft
from mechlab.mechanism.statics import spring_force, spring_stretch
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
        self.damped = bool(np.any(self.damping))
        items: list[Joint | Shaft] = [*m.joints, *shafts]
        elastic = [x for x in items if x.stiffness]
        self.stiffness = np.array([x.stiffness for x in elastic])
        self.elastic_rows = np.array([m.row(x.name) for x in elastic]).reshape(-1, m.nv)
        self.unstretched = np.array([x.spring_rest - x.zero for x in elastic])
        self.columns = rate_columns(m)
        self.springs = m.springs
        rough = [x for x in items if x.friction]
        self.friction = np.array([f for x in rough for f in ([x.friction] * getattr(x, "nv", 1))])
        self.friction_names = tuple(x.name for x in rough for _ in range(getattr(x, "nv", 1)))
        self.friction_rows = _friction_rows(m, rough)

    def force(self, kin: Kinematics, v: Array) -> Array:
        """(nv,) f of M a + c + f = applied: damping and stiffness of joints and shafts, springs; without dry
        friction."""
        out = self.damping @ v if self.damped else np.zeros(len(v))
        if len(self.stiffness):
            stretch = self.elastic_rows @ kin.q[self.columns] - self.unstretched
            out += self.elastic_rows.T @ (self.stiffness * stretch)
        for spring in self.springs:
            out -= spring_force(kin, spring)
        return np.asarray(out)

    def loss(self, kin: Kinematics, v: Array) -> float:
        """Power [W] lost in dampers, without dry friction."""
        power = float(v @ self.damping @ v) if self.damped else 0.0
        for spring in self.springs:
            if spring.damping:
                power += spring.damping * spring_stretch(kin, spring)[3] ** 2
        return power

    def friction_force(self, v: Array, width: Array | float) -> Array:
        """(nv,) dry friction as it acts on the joints: -friction tanh(rate / width), `width` the rate at which it is
        smoothed; 0: -friction sign(rate)."""
        if not len(self.friction):
            return np.zeros(len(v))
        rate = self.friction_rows @ v
        sense = np.tanh(rate / width) if np.all(width) else np.sign(rate)
        return np.asarray(-self.friction_rows.T @ (self.friction * sense))


def _friction_rows(m: Mechanism, rough: list[Joint | Shaft]) -> Array:
    rows: list[Array] = []
    for item in rough:
        if item.name in m.v_slice:
            rows += list(np.eye(m.nv)[m.v_slice[item.name]])
        else:
            rows.append(m.row(item.name))
    return np.array(rows).reshape(-1, m.nv)
