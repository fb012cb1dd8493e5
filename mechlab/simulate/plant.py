"""The state of a MuJoCo run as laws see it: `mechlab.experiment.laws.Plant` over an MjData, fast and by name."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from mechlab.errors import unknown
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.simulate.closure import Closure
from mechlab.simulate.model import MujocoMap

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
        self._terms: dict[str, tuple[float, Terms, Terms]] = {}
        for name in mechanism.scalar_names:
            row = mechanism.row(name)
            columns = [(int(k), float(row[k])) for k in np.flatnonzero(row)]
            q_terms = tuple((int(map_.qpos[mechanism._q_columns[k]]), c) for k, c in columns)
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

    def bias(self) -> Array:
        """(nv,) h of M a + h = applied + J^T reactions: velocity, gravity and passive terms (springs, dampers).

        Dry friction is not in it: MuJoCo has it as a constraint.
        """
        dof = self.map.dof
        velocity_terms = self._tree().bias_force() if self._split else self.data.qfrc_bias[dof]
        return np.asarray(velocity_terms - self.data.qfrc_passive[dof])

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian of loops and relations."""
        return self._rows()[0]

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        return self._rows()[1]

    # -- kept for one state ------------------------------------------------------------------------------------------

    @cached_property
    def _split(self) -> bool:
        """True when connectors share the mass of other bodies: then the engine's matrices are of another tree."""
        return len(self.map.other_dof) > 0

    @cached_property
    def _closure(self) -> Closure:
        return Closure(self.model)

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

    def _rows(self) -> tuple[Array, Array]:
        state = self._state()
        if state != self._rows_state:
            if self._split:
                tree, constraints = self._tree(), self._numpy[1]
                self._kept = constraints.jacobian(tree), constraints.bias(tree)
            else:
                jacobian, bias = self._closure.rows(self.data)
                self._kept = jacobian[:, self.map.dof], bias
            self._rows_state = state
        return self._kept
