"""A mechanism at one state of a MuJoCo model, as laws and checks see it.

`MujocoPlant` looks at the MjData of a run; `StateOfMujoco` has a model of its own and can be put into any state.

`MujocoSmallMotions`: what small motions about a rest need, in the engine's own coordinates, connectors of loops included.
`mjd_transitionFD` is not used: it differentiates a step in which loops are springs, so its matrices hold the stiffness of the
constraint solver. Here the engine's smooth forces (qfrc_bias, qfrc_passive) are combined with the exact rows of `Closure`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.closure import Closure, equality_rows
from mechlab.engines.mujoco.curve_rows import evaluating
from mechlab.engines.mujoco.engine_rows import EngineRows
from mechlab.engines.mujoco.model import MujocoMap, passive, to_mujoco
from mechlab.errors import unknown
from mechlab.experiment.laws import Law, applied_force
from mechlab.experiment.tree_plant import MassShare
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, lightest_correction, newton

Terms = tuple[tuple[int, float], ...]


class MujocoPlant:
    """Plant over `data`, which the caller keeps evaluated: inside a control callback and after mj_forward it is.

    `mass_matrix`, `bias`, `jacobian` and `constraint_bias` are the engine's own, in the order of the Mechanism's rates
    (constraint rows span the same space as those of `mechlab.mechanism.ConstraintSet` but are other rows). Only where
    connectors stand in loops, which split the mass of a body, they come from the numpy tree of the Mechanism.
    """

    def __init__(self, mechanism: Mechanism, model: mujoco.MjModel, data: mujoco.MjData, map_: MujocoMap) -> None:
        self.mechanism = mechanism
        self.model = model
        self.data = data
        self.map = map_
        self._qpos, self._qvel = data.qpos, data.qvel
        self._tree_state = self._rows_state = (b"", b"")
        self.memory: dict[Any, Array] = {}
        self._sites: dict[str, int] = {}
        self._terms: dict[str, tuple[float, Terms, Terms]] = {}
        for name in mechanism.scalar_names:
            row = mechanism.row(name)
            columns = [(int(k), float(row[k])) for k in np.flatnonzero(row)]
            q_terms = tuple((int(map_.qpos[mechanism.q_columns[k]]), c) for k, c in columns)
            self._terms[name] = (mechanism.zero(name), q_terms, tuple((int(map_.dof[k]), c) for k, c in columns))

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self.data.time)

    @t.setter
    def t(self, value: float) -> None:
        self.data.time = value

    def _find(self, name: str) -> tuple[float, Terms, Terms]:
        try:
            return self._terms[name]
        except KeyError:
            raise unknown(f"{self.mechanism.name}: joint or shaft", name, self._terms) from None

    def value(self, name: str) -> float:
        """Physical value of a joint or shaft [rad or m]: zero + coordinate."""
        zero, terms, _ = self._find(name)
        qpos, value = self._qpos, 0.0
        for k, c in terms:
            value += c * qpos.item(k)
        return zero + value

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft."""
        qvel, rate = self._qvel, 0.0
        for k, c in self._find(name)[2]:
            rate += c * qvel.item(k)
        return rate

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix, armatures and shafts included."""
        if self._split:
            return self._tree().mass_matrix()
        return self.map.mass_matrix(self.data)

    def mass_times(self, x: Array) -> Array:
        """(nv,) M x."""
        if not self._in_order:
            return self.mass_matrix() @ x
        out = np.empty(len(x))
        mujoco.mj_mulM(self.model, self.data, out, x)
        return out

    def bias(self) -> Array:
        """(nv,) h of M a + h = applied + J^T reactions: velocity, gravity and passive terms (springs, dampers).

        Dry friction is not in it: MuJoCo has it as a constraint.
        """
        data, dof = self.data, self.map.dof
        if self._in_order:
            return np.asarray(data.qfrc_bias - data.qfrc_passive)
        velocity_terms = self._tree().bias_force() if self._split else data.qfrc_bias[dof]
        return np.asarray(velocity_terms - data.qfrc_passive[dof])

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian of loops and relations."""
        return self.constraint_rows()[0]

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        return self.constraint_rows()[1]

    def point(self, frame: str) -> Array:
        """(3,) the site of a Frame in the world."""
        return np.array(self.data.site_xpos[self._site(frame)])

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame: velocity of its site, angular velocity, world axes."""
        out = np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, out[:3], out[3:], self._site(frame))
        return out[:, self.map.dof]

    def _site(self, frame: str) -> int:
        if frame not in self._sites:
            self._sites[frame] = self.map.site(frame)
        return self._sites[frame]

    # -- kept for one state ------------------------------------------------------------------------------------------

    @cached_property
    def _split(self) -> bool:
        """True when connectors share the mass of other bodies: then the engine's matrices are of another tree."""
        return len(self.map.other_dof) > 0

    @cached_property
    def closure(self) -> Closure:
        """The equality constraints of the model with their exact bias."""
        return Closure(self.model)

    @cached_property
    def _engine_rows(self) -> EngineRows | None:
        """The same rows in less time; None where they are others."""
        if mujoco.mj_isSparse(self.model):
            return None
        made = EngineRows(self.model, self.data, self.closure)
        return made if made.agree(self.data, self.closure) else None

    @cached_property
    def _in_order(self) -> bool:
        """Whether the engine's rates are those of the Mechanism, in its order."""
        return np.array_equal(self.map.dof, np.arange(self.model.nv))

    @cached_property
    def _numpy(self) -> tuple[TreeKinematics, ConstraintSet]:
        return TreeKinematics(self.mechanism), ConstraintSet(self.mechanism)

    def _state(self) -> tuple[bytes, bytes]:
        return self._qpos.tobytes(), self._qvel.tobytes()

    def _tree(self) -> TreeKinematics:
        state = self._state()
        if state != self._tree_state:
            self._numpy[0].set(self.map.coordinates(self._qpos), self.map.rates(self._qvel))
            self._tree_state = state
        return self._numpy[0]

    def engine_rows(self) -> tuple[Array, Array]:
        """(rows, engine nv) Jacobian and (rows,) bias of the equality constraints, in the order of the engine's rates."""
        fast = self._engine_rows
        return (fast and fast.rows(self.data)) or self.closure.rows(self.data)

    @cached_property
    def unreduced(self) -> Unreduced | None:
        """The equations with connectors, where these share the mass of other bodies: see `mechlab.experiment.laws.inverse`."""
        return Unreduced(self) if self._split else None

    def constraint_rows(self) -> tuple[Array, Array]:
        """`jacobian` and `constraint_bias`."""
        state = self._qpos.tobytes(), self._qvel.tobytes()
        if state != self._rows_state:
            if self._split:
                tree, constraints = self._tree(), self._numpy[1]
                self._kept = constraints.jacobian(tree), constraints.bias(tree)
            else:
                jacobian, bias = self.engine_rows()
                self._kept = jacobian if self._in_order else jacobian[:, self.map.dof], bias
            self._rows_state = state
        return self._kept


class Unreduced:
    """Rows, masses and forces of a MujocoPlant in all rates of the engine: those of the Mechanism first, then those of connectors."""

    def __init__(self, plant: MujocoPlant) -> None:
        self._plant, self._data = plant, plant.data
        self._order = np.concatenate([plant.map.dof, plant.map.other_dof])
        self._all, self._moved = np.zeros(plant.model.nv), np.zeros(plant.model.nv)

    def constraint_rows(self) -> tuple[Array, Array]:
        """(rows, engine nv) Jacobian and (rows,) dJ/dt v."""
        jacobian, bias = self._plant.engine_rows()
        return jacobian[:, self._order], bias

    def mass_times(self, x: Array) -> Array:
        """(engine nv,) M x."""
        self._all[self._order] = x
        mujoco.mj_mulM(self._plant.model, self._data, self._moved, self._all)
        return self._moved[self._order]

    def bias(self) -> Array:
        """(engine nv,) h of M a + h = applied + J^T reactions."""
        return np.asarray((self._data.qfrc_bias - self._data.qfrc_passive)[self._order])


class StateOfMujoco(MujocoPlant):
    """A MujocoPlant with a model of its own, from which the actuators are taken out: `set(q, v)`, then ask."""

    def __init__(self, mechanism: Mechanism) -> None:
        model, data = to_mujoco(mechanism)
        passive(model)
        super().__init__(mechanism, model, data, MujocoMap(mechanism, model))
        self.set(mechanism.reference())

    def set(self, q: ArrayLike, v: ArrayLike | None = None, t: float = 0.0) -> StateOfMujoco:
        """Move to coordinates q (nq,), rates v (nv,) (default 0), time t [s]; connectors follow."""
        data = self.data
        data.time = t
        data.qpos[:] = self.map.engine_coordinates(np.asarray(q, dtype=float))
        rates = np.zeros(self.mechanism.nv) if v is None else np.asarray(v, dtype=float)
        data.qvel[:] = self.map.engine_rates(data.qpos, rates)
        with evaluating(self.map.curves, data):
            mujoco.mj_forward(self.model, data)
        return self

    def relation_rows(self) -> Array:
        """(relations, nv) rows of the tendons that stand for the relations, in their order."""
        equalities, closure = self.map.equalities, self.closure
        k = [closure.slices[equalities[r.name][0]].start for r in self.mechanism.relations]
        return closure.rows(self.data)[0][k][:, self.map.dof]

    def closing(self) -> tuple[Array, Array, Array]:
        """(rows,) residual and (rows, engine nv) gradient of the engine's equality rows (efc_pos, efc_J), (engine nv,) rates;
        columns of the Mechanism first, in its order, then those of connectors."""
        residual, jacobian = equality_rows(self.model, self.data)
        order = np.concatenate([self.map.dof, self.map.other_dof])
        return residual, jacobian[:, order], self.data.qvel[order]

    def correction(self, residual: Array) -> Array:
        """(nv,) smallest displacement in the sense of the kinetic energy, connectors included, that takes `residual` away."""
        order = np.concatenate([self.map.dof, self.map.other_dof])
        mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, mass)
        dq = lightest_correction(mass[np.ix_(order, order)], self.closing()[1], residual)
        return dq[: self.mechanism.nv]

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3), body axes to world, and origin (3,) of a body."""
        k = self.map.body(body)
        return self.data.xmat[k].reshape(3, 3).copy(), self.data.xpos[k].copy()

    def masses(self) -> list[MassShare]:
        """Of every body that moves with its inertial frame; connectors, which hold a share of a body's mass, are among them."""
        model, data, out, twist = self.model, self.data, [], np.zeros(6)
        for k in range(1, model.nbody):
            if model.body_weldid[k]:
                turned = data.ximat[k].reshape(3, 3)
                tensor = turned @ np.diag(model.body_inertia[k]) @ turned.T
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, k, twist, 0)
                mass, centre = float(model.body_mass[k]), data.xipos[k].copy()
                out.append(MassShare(mass, centre, tensor, mass * twist[3:], tensor @ twist[:3]))
        return out


class MujocoSmallMotions:
    """A mechanism under laws, held still at time 0; implements `mechlab.studies.modes.eigen.Dynamics` on MuJoCo.

    A pose x is the engine's qpos; displacements and rates have the engine's nv entries.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...] = ()) -> None:
        self.mechanism, self.laws = mechanism, laws
        self.plant = StateOfMujoco(mechanism)
        self.model, self.data, self.map = self.plant.model, self.plant.data, self.plant.map
        self.nv = int(self.model.nv)

    def pose(self, q: ArrayLike) -> Array:
        """The engine's qpos of coordinates q (nq,), connectors placed."""
        return self.map.engine_coordinates(np.asarray(q, dtype=float))

    def coordinates(self, x: Array) -> Array:
        """(nq,) coordinates of the Mechanism."""
        return self.map.coordinates(x)

    def rates(self, basis: Array) -> Array:
        """(nv, k) columns in the order of the Mechanism's rates, of columns (engine nv, k)."""
        return np.asarray(basis[self.map.dof])

    def moved(self, x: Array, dv: Array) -> Array:
        """The pose after the displacement dv (engine nv,), not closed again."""
        out = x.copy()
        mujoco.mj_integratePos(self.model, out, dv, 1.0)
        return out

    def closed(self, x: Array) -> Assembly:
        """The nearest pose in which all equalities are closed: Newton on the engine's efc_pos and efc_J."""
        return newton(lambda qpos: equality_rows(self.model, self._at(qpos)), self.moved, x)

    def rows(self, x: Array) -> Array:
        """(rows, engine nv) Jacobian of all equalities."""
        return self.plant.closure.rows(self._at(x))[0]

    def mass(self, x: Array) -> Array:
        """(engine nv, engine nv) mass matrix, armatures and shafts included."""
        out = np.zeros((self.nv, self.nv))
        mujoco.mj_fullM(self.model, self._at(x), out)
        return out

    def force(self, x: Array, v: Array | None = None) -> Array:
        """(engine nv,) g of M a + g = J^T reactions: weight, springs, dampers, velocity terms, less the laws."""
        data = self._at(x, v)
        out = data.qfrc_bias - data.qfrc_passive
        out[self.map.dof] -= applied_force(self.mechanism, self.laws, 0.0, self.plant)[0]
        return np.asarray(out)

    def _at(self, x: Array, v: Array | None = None) -> mujoco.MjData:
        data = self.data
        data.qpos[:] = x
        data.qvel[:] = 0.0 if v is None else v
        self.map.curves.place(data.qpos)
        mujoco.mj_fwdPosition(self.model, data)
        mujoco.mj_fwdVelocity(self.model, data)
        return data
