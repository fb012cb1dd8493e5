"""What small motions about a rest need, from MuJoCo: closed poses, forces, constraint rows and mass matrix.

All in the engine's own coordinates: connectors of loops are bodies like others. `mjd_transitionFD` is not used: it
differentiates a step in which loops are springs, so its matrices hold the stiffness of the constraint solver. Here the
engine's smooth forces (qfrc_bias, qfrc_passive) are combined with exact rows from mj_jac (see `Closure`).
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.closure import Closure
from mechlab.engines.mujoco.model import MujocoMap, equality_jacobian, passive, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.experiment.laws import Law, applied_force
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, newton


class MujocoSmallMotions:
    """A mechanism under laws, held still at time 0; implements `mechlab.studies.modes.eigen.Dynamics` on MuJoCo.

    A pose x is the engine's qpos; displacements and rates have the engine's nv entries.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...] = ()) -> None:
        self.mechanism, self.laws = mechanism, laws
        self.model, self.data = to_mujoco(mechanism)
        passive(self.model)
        self.map = MujocoMap(mechanism, self.model)
        self.plant = MujocoPlant(mechanism, self.model, self.data, self.map)
        self.nv = int(self.model.nv)
        self._closure = Closure(self.model)

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

        def evaluate(qpos: Array) -> tuple[Array, Array]:
            data = self._at(qpos)
            rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            return data.efc_pos[rows].copy(), equality_jacobian(self.model, data)

        return newton(evaluate, self.moved, x)

    def rows(self, x: Array) -> Array:
        """(rows, engine nv) Jacobian of all equalities."""
        return self._closure.rows(self._at(x))[0]

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
        mujoco.mj_fwdPosition(self.model, data)
        mujoco.mj_fwdVelocity(self.model, data)
        return data
