"""A mechanism at one state on Pinocchio: mass matrix, bias, constraint rows, accelerations and reactions.

    M(q) a + h(q, v) = tau + J^T r,    J a + dJ/dt v = 0

M with armatures and J c c^T of every shaft; h with Coriolis, centrifugal, weight and passive terms: dampers and springs of joints
and shafts, springs between points. Dry friction is not in h: it has no value at rest.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.engines.pinocchio.kkt import Factors, dense, factor
from mechlab.engines.pinocchio.model import PinModel
from mechlab.engines.pinocchio.springs import PinSprings
from mechlab.errors import Untrustworthy
from mechlab.experiment.tree_plant import MassShare
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft
from mechlab.mechanism.statics import DryFriction
from mechlab.mechanism.structure import rank, structure

FEW_ROWS = 300
"""Rows are tested for repeating each other up to this number."""


class Passive:
    """Passive forces at the state of a PinKinematics; what is constant is gathered once."""

    def __init__(self, kin: PinKinematics) -> None:
        self.kin, m = kin, kin.mechanism
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
        self.columns = m.q_columns
        self.springs = PinSprings(kin)
        self.friction = DryFriction.of(m)

    def force(self, v: Array) -> Array:
        """(nv,) f of M a + c + f = applied: damping and stiffness of joints and shafts, springs; without dry
        friction."""
        out = self.damping @ v if self.damped else np.zeros(len(v))
        if len(self.stiffness):
            stretch = self.elastic_rows @ self.kin.q[self.columns] - self.unstretched
            out += self.elastic_rows.T @ (self.stiffness * stretch)
        if len(self.springs):
            out += self.springs.force(v)
        return np.asarray(out)

    def loss(self, v: Array) -> float:
        """Power [W] lost in dampers, without dry friction."""
        power = float(v @ self.damping @ v) if self.damped else 0.0
        return power + self.springs.loss(v) if len(self.springs) else power


class PinPlant:
    """A Mechanism at one state (t, q, v); implements `mechlab.experiment.laws.Plant`. `set(q, v, t)` first; then ask.

    Everything is computed when it is first asked for, and kept until the next `set`.
    """

    def __init__(
        self, mechanism: Mechanism | PinModel, q: ArrayLike | None = None, v: ArrayLike | None = None, t: float = 0.0
    ) -> None:
        self.kin = PinKinematics(mechanism)
        self.mechanism = self.kin.mechanism
        self.constraints = PinConstraints(self.kin)
        self.passive = Passive(self.kin)
        self._zeros = {n: self.mechanism.zero(n) for n in self.mechanism.scalar_names}
        self._lower = np.tri(self.mechanism.nv, k=-1, dtype=bool)
        self._values = {n: self._terms(n) for n in self._zeros}
        self.evaluations = 0
        self.memory: dict[Any, Array] = {}
        self.set(self.mechanism.reference() if q is None else q, v, t)

    def set(self, q: ArrayLike, v: ArrayLike | None = None, t: float = 0.0) -> PinPlant:
        """Move to coordinates q (nq,), rates v (nv,) (default zero), time t [s]."""
        self.kin.set(q, v)
        self.q, self.v, self.t = self.kin.q, self.kin.v, float(t)
        self._mass: Array | None = None
        self._bias: Array | None = None
        self._rows: tuple[Array, Array, Array] | None = None
        self._row_bias: Array | None = None
        self._factors: Factors | None = None
        return self

    def set_rates(self, v: ArrayLike, t: float | None = None) -> PinPlant:
        """The same pose with other rates: mass matrix, constraint rows and factors are kept."""
        mass, rows, factors = self._mass, self._rows, self._factors
        self.set(self.q, v, self.t if t is None else t)
        self._mass, self._rows, self._factors = mass, rows, factors
        return self

    def value(self, name: str) -> float:
        """Physical value of a joint or shaft [rad or m]."""
        q, value = self.q, 0.0
        for _, k, c in self._find(name):
            value += c * q.item(k)
        return self._zeros[name] + value

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft."""
        v, rate = self.v, 0.0
        for k, _, c in self._find(name):
            rate += c * v.item(k)
        return rate

    def _find(self, name: str) -> tuple[tuple[int, int, float], ...]:
        return self._values[name] if name in self._values else self._terms(name)

    def _terms(self, name: str) -> tuple[tuple[int, int, float], ...]:
        """What a joint or shaft is made of: index in v, index in q, coefficient."""
        row = self.mechanism.row(name)
        return tuple((int(k), int(self.passive.columns[k]), float(row[k])) for k in np.flatnonzero(row))

    def mass_matrix(self) -> Array:
        """(nv, nv): Pinocchio's composite rigid body algorithm with armatures, and J c c^T of every shaft."""
        if self._mass is None:
            mass = self.kin.work.mass(self.kin.q_pin)
            np.copyto(mass, mass.T, where=self._lower)
            self._mass = mass + self.passive.inertia if self.passive.has_shaft_inertia else mass
        return self._mass

    def bias(self) -> Array:
        """(nv,) h of M a + h = applied + J^T r: Coriolis, centrifugal, gravity, damping, stiffness, springs.

        Dry friction is not in it: it has no value at rest. The runner adds it smoothed and says so.
        """
        if self._bias is None:
            nle = self.kin.work.nonlinear(self.kin.q_pin, self.v)
            self._bias = nle + self.passive.force(self.v)
        return self._bias

    def _evaluate(self) -> tuple[Array, Array, Array]:
        if self._rows is None:
            self._rows = self.constraints.evaluate()
        return self._rows

    def residual(self) -> Array:
        """(rows,) constraint residual."""
        return self._evaluate()[0]

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian."""
        return self._evaluate()[1]

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        if self._row_bias is None:
            self._row_bias = self.constraints.bias()
        return self._row_bias

    def relation_rows(self) -> Array:
        """(relations, nv) rows of the relations, in their order."""
        return self.jacobian()[[self.constraints.slices[r.name].start for r in self.mechanism.relations]]

    def closing(self) -> tuple[Array, Array, Array]:
        """(rows,) residual, (rows, nv) its gradient, (nv,) the rates."""
        return self.residual(), self.jacobian(), self.v

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3), body axes to world, and origin (3,) of a body."""
        return self.kin.pose(body)

    def point(self, frame: str) -> Array:
        """(3,) origin of a Frame in the world."""
        where = self.mechanism.frame(frame)
        rotation, origin = self.kin.pose(where.body)
        return np.asarray(origin + rotation @ where.placement.translation)

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame: velocity of its origin, angular velocity, world axes."""
        return self.kin.jacobian(self.mechanism.frame(frame).body, self.point(frame))

    def masses(self) -> list[MassShare]:
        """All that moves as one body, or as a few of them: Pinocchio's composite inertia and momentum about the centre of mass."""
        return self.kin.work.moving(self.kin.q_pin, self.v)

    def lines(self) -> Array:
        """(loop rows, 6) force line of each loop row on body b: force, moment about the world's origin, per unit."""
        return self._evaluate()[2]

    def factors(self) -> Factors | None:
        """Factors of mass matrix and constraint rows; None when the mass matrix is singular by itself."""
        if self._factors is None:
            self._factors = factor(self.mass_matrix(), self.jacobian(), self._rank)
        return self._factors

    @cached_property
    def _rank(self) -> int | None:
        return rank_where_closed(self.mechanism)

    def correction(self, residual: Array) -> Array:
        """(nv,) smallest change of the rates, or displacement, that takes `residual` (rows,) away: J dv = -residual."""
        factors = self.factors()
        if factors is not None:
            return factors.correction(residual)
        return np.asarray(-np.linalg.lstsq(self.jacobian(), residual, rcond=1e-11)[0], dtype=float)

    def stopping(self, held: Array, targets: Array) -> Array:
        """(nv,) smallest change of the rates, measured by the kinetic energy, that brings the rows `held` (k, nv) to the rates `targets`
        (k,) and keeps the constraints; 0 where the mass matrix is singular by itself."""
        rows = self._with(held)
        factors = factor(self.mass_matrix(), rows)
        left = rows @ self.v
        left[len(rows) - len(held) :] -= targets
        return np.zeros(len(self.v)) if factors is None else factors.correction(left)

    def _with(self, held: Array) -> Array:
        """(rows + k, nv) constraint rows, then those held."""
        return np.vstack([self.jacobian(), held]) if len(self.constraints) else held

    def accelerations(self, force: ArrayLike, held: Array | None = None) -> tuple[Array, Array]:
        """(nv,) accelerations and (rows,) reactions under the generalized `force` (nv,) of drives and loads.

        Reactions are conjugate to the rows: J^T r acts on the tree; the smallest ones where rows are redundant. held (k, nv): rows
        of rates that stay as they are (what sticks); their reactions come last. Raises Untrustworthy when the equations have no
        solution (a motion without inertia); with `held` rows the nearest answer comes back, as they may contradict each other.
        """
        self.evaluations += 1
        net = np.asarray(force, dtype=float) - self.bias()
        if held is not None:
            rows, bias = self._with(held), np.concatenate([self.constraint_bias(), np.zeros(len(held))])
            found = factor(self.mass_matrix(), rows)
            return found.accelerations(net, bias) if found else dense(self.mass_matrix(), rows, net, bias)[:2]
        factors = self.factors()
        if factors is not None:
            return factors.accelerations(net, self.constraint_bias())
        a, r, gap = dense(self.mass_matrix(), self.jacobian(), net, self.constraint_bias())
        if not gap <= 1e-6 * max(1.0, float(np.max(np.abs(net)))):
            raise Untrustworthy(
                f"{self.mechanism.name}: a motion that the constraints allow has no inertia; give the parts that move "
                "in it a mass."
            )
        return a, r


@lru_cache(maxsize=32)
def rank_where_closed(m: Mechanism) -> int | None:
    """Rank of the constraint rows where the loops are closed, if it is below their number; None where they are independent, but
    for rows that are zero."""
    constraints = ConstraintSet(m)
    if not 0 < len(constraints) <= FEW_ROWS:
        return None
    # planar loops have rows that are zero in every pose, closed or not
    moved = integrate(m, m.reference(), np.random.default_rng(5).normal(size=m.nv))
    size = np.abs(constraints.jacobian(TreeKinematics(m, moved))).max(axis=1)
    independent = int(np.count_nonzero(size > 1e-12 * size.max()))
    if rank(constraints.jacobian(TreeKinematics(m))) >= independent:
        return None
    found = structure(m).rank
    return found if found < independent else None


def accelerations(mechanism: Mechanism, q: ArrayLike, v: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Accelerations (nv,) and reactions (rows,) of a mechanism at one state: see `PinPlant.accelerations`."""
    return PinPlant(mechanism, q, v).accelerations(force)
