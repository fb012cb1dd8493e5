"""A mechanism at one state, computed by the numpy tree of `mechlab.mechanism`: the plant that laws see without an
engine, and a third implementation besides the engines in checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import unknown
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import lightest_correction
from mechlab.mechanism.statics import passive_force


class MassShare(NamedTuple):
    """A moving mass [kg], its centre (3,) [m], inertia tensor (3, 3) about the centre [kg m2], momentum (3,) [kg m/s]
    and angular momentum `spin` (3,) about the centre [kg m2/s]; world axes."""

    mass: float
    centre: Array
    tensor: Array
    momentum: Array
    spin: Array


class TreePlant:
    """The numpy plant. Implements `mechlab.experiment.laws.Plant` and, with poses, closure and masses,
    `mechlab.engines.protocol.StatePlant`.

    `set(q, v, t)` only stores the state; kinematics, masses and rows are computed on first use, once for a state, so that a law
    which needs only values and rates costs no kinematics. `memory`: law -> its states.
    """

    def __init__(self, mechanism: Mechanism, q: ArrayLike | None = None, v: ArrayLike | None = None) -> None:
        self.mechanism = mechanism
        self.memory: Mapping[Any, Array] = {}
        self._rows = {n: (mechanism.zero(n), mechanism.row(n)) for n in mechanism.scalar_names}
        self._columns = mechanism.q_columns
        self.set(mechanism.reference() if q is None else q, v)

    def set(self, q: ArrayLike, v: ArrayLike | None = None, t: float = 0.0) -> TreePlant:
        """Move to coordinates q (nq,), rates v (nv,) (default 0), time t [s]."""
        self.t, self.q = t, np.asarray(q, dtype=float)
        self.v = np.zeros(self.mechanism.nv) if v is None else np.asarray(v, dtype=float)
        self._placed = False
        return self

    def value(self, name: str) -> float:
        """Physical value of a joint or shaft [rad or m]: zero + coordinate."""
        zero, row = self._row(name)
        return zero + float(row @ self.q[self._columns])

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft [rad/s or m/s]."""
        return float(self._row(name)[1] @ self.v)

    def _row(self, name: str) -> tuple[float, Array]:
        if name not in self._rows:
            raise unknown(f"{self.mechanism.name}: joint or shaft", name, self._rows)
        return self._rows[name]

    @cached_property
    def _tools(self) -> tuple[TreeKinematics, ConstraintSet]:
        return TreeKinematics(self.mechanism), ConstraintSet(self.mechanism)

    @property
    def tree(self) -> TreeKinematics:
        """The kinematics at the present state."""
        if not self._placed:
            self._tools[0].set(self.q, self.v)
            self._placed = True
            self._known: dict[str, Array] = {}
        return self._tools[0]

    def _once(self, what: str, compute: Callable[[TreeKinematics], Array]) -> Array:
        """A copy of what is computed once for the present state."""
        tree = self.tree
        if what not in self._known:
            self._known[what] = np.asarray(compute(tree))
        return self._known[what].copy()

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix, armatures and shafts included."""
        return self._once("mass", TreeKinematics.mass_matrix)

    def bias(self) -> Array:
        """(nv,) h of M a + h = applied + J^T reactions: velocity, weight, springs and dampers."""
        return self._once("bias", lambda tree: tree.bias_force() - passive_force(tree))

    def residual(self) -> Array:
        """(rows,) residual of loops and relations [m, rad]."""
        return self._tools[1].residual(self.tree)

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian."""
        return self._once("rows", self._tools[1].jacobian)

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        return self._once("rates", self._tools[1].bias)

    def relation_rows(self) -> Array:
        """(relations, nv) rows of the relations, in their order."""
        return self.jacobian()[[self._tools[1].slices[r.name].start for r in self.mechanism.relations]]

    def closing(self) -> tuple[Array, Array, Array]:
        """Residual (rows,), constraint Jacobian (rows, nv), rates (nv,)."""
        return self.residual(), self.jacobian(), self.v

    def accelerations(self, force: ArrayLike) -> Array:
        """(nv,) accelerations under the generalized `force` (nv,), without dry friction: M a + h = force + J^T r, J a = -dJ/dt v."""
        rows, nv = self.jacobian(), len(self.v)
        matrix, side = np.zeros((nv + len(rows), nv + len(rows))), np.zeros(nv + len(rows))
        matrix[:nv, :nv], matrix[:nv, nv:], matrix[nv:, :nv] = self.mass_matrix(), rows.T, rows
        side[:nv] = np.asarray(force, dtype=float) - self.bias()
        side[nv:] = -self.constraint_bias()
        return np.asarray(np.linalg.lstsq(matrix, side, rcond=1e-12)[0][:nv])

    def correction(self, residual: Array) -> Array:
        """(nv,) smallest displacement in the sense of the kinetic energy that takes `residual` (rows,) away."""
        return lightest_correction(self.mass_matrix(), self.jacobian(), residual)

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3), body axes to world, and origin (3,) of a body."""
        return self.tree.pose(body)

    def point(self, frame: str) -> Array:
        """(3,) origin of a Frame in the world."""
        where = self.mechanism.frame(frame)
        rotation, origin = self.tree.pose(where.body)
        return np.asarray(origin + rotation @ where.placement.translation)

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) Jacobian of a Frame: velocity of its origin, then angular velocity, world axes."""
        return self.tree.jacobian(self.mechanism.frame(frame).body, self.point(frame))

    def masses(self) -> list[MassShare]:
        """The masses of all bodies that can move: those with a joint between them and the ground."""
        moves = {"ground": False}
        out = []
        for b in self.mechanism.bodies:
            moves[b.name] = bool(b.joints) or moves[b.parent]
            if not moves[b.name]:
                continue
            rotation, origin = self.tree.pose(b.name)
            centre = origin + rotation @ np.array(b.inertia.com)
            tensor, twist = rotation @ b.inertia.matrix() @ rotation.T, self.tree.velocity(b.name, centre)
            out.append(MassShare(b.inertia.mass, centre, tensor, b.inertia.mass * twist[:3], tensor @ twist[3:]))
        return out
