"""States of a model file <-> states of the mechanism that was read from it, one or many at a time.

A hinge or slide: coordinate = qpos - qpos of the reference pose. A ball joint: the rotation from the reference pose. A free
joint: three coordinates along the axes of the world, from the place of the reference pose, and the rotation from there.
Rates are the same numbers in both.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, key
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import ModelFile
from mechlab.mechanism.geometry import Array, quaternion_products

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


class FileCoordinates:
    """Converts states between a compiled model file and its mechanism; `dof` (nv,): the engine's address of each rate.

    Raises MechlabError for a model of another file.
    """

    def __init__(self, file: ModelFile, model: mujoco.MjModel) -> None:
        m = self.mechanism = file.mechanism
        self.model = model
        self.reference = np.array(file.reference or model.qpos0, dtype=float)
        names = [key(model, OBJECT.mjOBJ_JOINT, k) for k in range(model.njnt)]
        # a file that mechlab wrote has joints of connector bodies, NAME:1, which a mechanism does not have
        missing = [n for n in names if n not in file.joints and ":" not in n] + [n for n in file.joints if n not in names]
        if missing or self.reference.shape != (model.nq,):
            raise MechlabError(f"{file.name}: the model has other joints than the file that was read: {', '.join(missing)}.")
        self.dof = np.zeros(m.nv, dtype=int)
        self._turns: list[tuple[slice, slice]] = []
        scalars: list[tuple[int, int]] = []
        for k, name in enumerate(names):
            a, d = int(model.jnt_qposadr[k]), int(model.jnt_dofadr[k])
            for i, joint in enumerate(file.joints.get(name, ())):
                place, rate = m.q_slice[joint], m.v_slice[joint]
                self.dof[rate] = np.arange(d + i, d + i + rate.stop - rate.start)
                if m.joint(joint).nv == 3:
                    self._turns.append((place, slice(a + i, a + i + 4)))
                else:
                    scalars.append((place.start, a + i))
        self._to, self._from = np.array(scalars, dtype=int).reshape(-1, 2).T

    def coordinates(self, qpos: Array) -> Array:
        """(..., nq) coordinates of the mechanism at (..., model.nq) of the engine."""
        q = np.tile(self.mechanism.reference(), (*qpos.shape[:-1], 1))
        q[..., self._to] = qpos[..., self._from] - self.reference[self._from]
        for here, there in self._turns:
            q[..., here] = quaternion_products(self.reference[there] * CONJUGATE, qpos[..., there])
        return q

    def rates(self, qvel: Array) -> Array:
        """(..., nv) rates or accelerations of the mechanism at those of the engine."""
        return np.asarray(qvel)[..., self.dof]

    def to_mechanism(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """Coordinates and rates of the mechanism at a state of the file."""
        return self.coordinates(np.asarray(qpos)), self.rates(qvel)

    def to_file(self, q: Array, v: Array) -> tuple[Array, Array]:
        """qpos and qvel of the file at coordinates (nq,) and rates (nv,) of the mechanism."""
        qpos, qvel = self.reference.copy(), np.zeros(self.model.nv)
        qpos[self._from] += q[self._to]
        for here, there in self._turns:
            qpos[there] = quaternion_products(self.reference[there], q[here])
        qvel[self.dof] = v
        return qpos, qvel
