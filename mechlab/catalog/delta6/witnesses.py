"""Three witnesses of one Mechanism behind one face: the numpy tree, Pinocchio, MuJoCo. Each answers from its own
kinematics and its own constraint rows; an engine that is not installed is left out."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mechlab.experiment.laws import Plant
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force


class Witness(Plant, Protocol):
    """A Plant that can be moved to a state, and that knows its residual and its points."""

    name: str

    def at(self, q: ArrayLike, v: ArrayLike | None = None) -> Witness:
        """Move to coordinates q (nq,) and rates v (nv,), default zero."""
        ...

    def closing(self) -> tuple[Array, Array]:
        """(rows,) how far loops and relations are open, and the gradient (rows, nv) of that."""
        ...

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3) and origin (3,) of a body."""
        ...

    def point(self, frame: str) -> Array:
        """(3,) position of a Frame."""
        ...

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame: linear, angular, world axes."""
        ...


class NumpyWitness:
    """The numpy tree of `mechlab.mechanism`."""

    name = "numpy"

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.t = mechanism, 0.0
        self.tree, self.constraints = TreeKinematics(mechanism), ConstraintSet(mechanism)

    def at(self, q: ArrayLike, v: ArrayLike | None = None) -> NumpyWitness:
        """Move to a state."""
        self.tree.set(q, v)
        return self

    def value(self, name: str) -> float:
        """Value of a joint or shaft."""
        return float(self.mechanism.value(name, self.tree.q))

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft."""
        return float(self.mechanism.row(name) @ self.tree.v)

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix."""
        return self.tree.mass_matrix()

    def bias(self) -> Array:
        """(nv,) velocity, gravity and passive terms."""
        return self.tree.bias_force() - passive_force(self.tree)

    def closing(self) -> tuple[Array, Array]:
        """Residual and Jacobian."""
        return self.constraints.residual(self.tree), self.jacobian()

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian."""
        return self.constraints.jacobian(self.tree)

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        return self.constraints.bias(self.tree)

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation and origin of a body."""
        return self.tree.pose(body)

    def point(self, frame: str) -> Array:
        """Position of a Frame."""
        return _point(self.mechanism, self.tree, frame)

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame."""
        return self.tree.jacobian(self.mechanism.frame(frame).body, self.point(frame))


class _OverPlant:
    """What the engines' witnesses have in common: an engine's Plant at a state."""

    plant: Any

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.t = mechanism, 0.0

    def value(self, name: str) -> float:
        """Value of a joint or shaft."""
        return float(self.plant.value(name))

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft."""
        return float(self.plant.rate(name))

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix."""
        return np.asarray(self.plant.mass_matrix())

    def bias(self) -> Array:
        """(nv,) velocity, gravity and passive terms."""
        return np.asarray(self.plant.bias())

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian."""
        return np.asarray(self.plant.jacobian())

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        return np.asarray(self.plant.constraint_bias())


class PinocchioWitness(_OverPlant):
    """Pinocchio's data, with the constraint rows of `mechlab.engines.pinocchio`."""

    name = "pinocchio"

    def __init__(self, mechanism: Mechanism) -> None:
        from mechlab.engines.pinocchio.dynamics import PinPlant

        super().__init__(mechanism)
        self.plant = PinPlant(mechanism)

    def at(self, q: ArrayLike, v: ArrayLike | None = None) -> PinocchioWitness:
        """Move to a state."""
        self.plant.set(q, v)
        return self

    def closing(self) -> tuple[Array, Array]:
        """Residual and Jacobian."""
        return self.plant.residual(), self.plant.jacobian()

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation and origin of a body."""
        rotation, origin = self.plant.kin.pose(body)
        return rotation, origin

    def point(self, frame: str) -> Array:
        """Position of a Frame."""
        return _point(self.mechanism, self.plant.kin, frame)

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame."""
        return np.asarray(self.plant.kin.jacobian(self.mechanism.frame(frame).body, self.point(frame)))


class MujocoWitness(_OverPlant):
    """A MjData of the generated MJCF file, with the engine's own rows."""

    name = "mujoco"

    def __init__(self, mechanism: Mechanism) -> None:
        from mechlab.engines.mujoco import MujocoMap, MujocoPlant, to_mujoco

        super().__init__(mechanism)
        self.model, self.data = to_mujoco(mechanism)
        self.map = MujocoMap(mechanism, self.model)
        self.plant = MujocoPlant(mechanism, self.model, self.data, self.map)

    def at(self, q: ArrayLike, v: ArrayLike | None = None) -> MujocoWitness:
        """Move to a state."""
        import mujoco

        self.data.qpos[:] = self.map.engine_coordinates(np.asarray(q, dtype=float))
        rates = np.zeros(self.mechanism.nv) if v is None else np.asarray(v, dtype=float)
        self.data.qvel[:] = self.map.engine_rates(self.data.qpos, rates)
        mujoco.mj_forward(self.model, self.data)
        return self

    def closing(self) -> tuple[Array, Array]:
        """Residual and gradient of the engine's equality rows (efc_pos, efc_J)."""
        import mujoco

        from mechlab.engines.mujoco.model import equality_jacobian

        rows = self.data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        return np.array(self.data.efc_pos[rows]), equality_jacobian(self.model, self.data)[:, self.map.dof]

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation and origin of a body."""
        k = self.map.body(body)
        return self.data.xmat[k].reshape(3, 3).copy(), self.data.xpos[k].copy()

    def point(self, frame: str) -> Array:
        """Position of a Frame."""
        return np.array(self.data.site_xpos[self.map.site(frame)])

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame."""
        import mujoco

        out = np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, out[:3], out[3:], self.map.site(frame))
        return out[:, self.map.dof]


def _point(mechanism: Mechanism, kin: Any, frame: str) -> Array:
    where = mechanism.frame(frame)
    rotation, origin = kin.pose(where.body)
    return np.asarray(origin + rotation @ where.placement.translation)


def witnesses(mechanism: Mechanism) -> tuple[Witness, ...]:
    """The numpy tree and the engines that are installed, in the reference pose."""
    out: list[Witness] = [NumpyWitness(mechanism)]
    for kind in (PinocchioWitness, MujocoWitness):
        try:
            out.append(kind(mechanism))
        except ModuleNotFoundError as missing:
            if missing.name not in ("pinocchio", "mujoco"):
                raise
    return tuple(out)
