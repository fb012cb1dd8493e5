"""States of a run of a file <-> coordinates and rates of its mechanism, many at a time."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, key
from mechlab.engines.mujoco.model_file.coordinates import BALL, CONJUGATE, FREE, FileCoordinates
from mechlab.experiment.model_file import ModelFile
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class FileStates:
    """Where the joints of a mechanism stand in the compiled model of its file; `dof` (nv,): the engine's address of each rate.

    It converts as `FileCoordinates`, arrays of states at once. Raises MechlabError for a model of another file.
    """

    def __init__(self, file: ModelFile, model: mujoco.MjModel) -> None:
        self.one = FileCoordinates(file, model)
        self.mechanism: Mechanism = file.mechanism
        m = self.mechanism
        self._from: list[int] = []
        self._to: list[int] = []
        self._turns: list[tuple[slice, slice]] = []
        dof = np.zeros(m.nv, dtype=int)
        for k in range(model.njnt):
            names = file.joints[key(model, OBJECT.mjOBJ_JOINT, k)]
            a, d = int(model.jnt_qposadr[k]), int(model.jnt_dofadr[k])
            for i, name in enumerate(names):
                here = m.v_slice[name]
                dof[here] = np.arange(d + i, d + i + here.stop - here.start)
                if int(model.jnt_type[k]) in (int(FREE), int(BALL)) and i == len(names) - 1:
                    self._turns.append((m.q_slice[name], slice(a + i, a + i + 4)))
                else:
                    self._to.append(m.q_slice[name].start)
                    self._from.append(a + i)
        self.dof = dof

    def coordinates(self, qpos: Array) -> Array:
        """(n, nq) coordinates of the mechanism at (n, model.nq) of the engine."""
        zero = self.one.reference
        q = np.tile(self.mechanism.reference(), (len(qpos), 1))
        q[:, self._to] = qpos[:, self._from] - zero[self._from]
        for here, there in self._turns:
            q[:, here] = _products(zero[there] * CONJUGATE, qpos[:, there])
        return q

    def rates(self, qvel: Array) -> Array:
        """(..., nv) rates or accelerations of the mechanism at those of the engine."""
        return np.asarray(qvel)[..., self.dof]

    def of(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Coordinates (nq,) and rates (nv,) of the present state."""
        return self.one.to_mechanism(data.qpos, data.qvel)

    def put(self, data: mujoco.MjData, q: Array, v: Array) -> None:
        """Move to coordinates and rates of the mechanism."""
        data.qpos[:], data.qvel[:] = self.one.to_file(q, v)


def _products(a: Array, b: Array) -> Array:
    """(n, 4) Hamilton products of a (4,) and b (n, 4), (w, x, y, z)."""
    w, x, y, z = a
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return np.asarray(b @ left.T)
