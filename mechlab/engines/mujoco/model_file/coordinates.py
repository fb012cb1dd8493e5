"""States of a model file <-> states of the mechanism that was read from it.

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
from mechlab.mechanism.geometry import Array, quaternion_product

FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


class FileCoordinates:
    """Converts states between a compiled model file and its mechanism. Raises MechlabError for a model of another file."""

    def __init__(self, file: ModelFile, model: mujoco.MjModel) -> None:
        self.file, self.model = file, model
        self.reference = np.array(file.reference or model.qpos0, dtype=float)
        names = [key(model, OBJECT.mjOBJ_JOINT, k) for k in range(model.njnt)]
        missing = [n for n in names if n not in file.joints and ":" not in n]
        if missing or self.reference.shape != (model.nq,):
            raise MechlabError(
                f"{file.name}: the model has other joints than the file that was read: {', '.join(missing)}."
            )
        # a file that mechlab wrote has joints of connector bodies, NAME:1, which a mechanism does not have
        self._parts = [(k, file.joints[name]) for k, name in enumerate(names) if name in file.joints]

    def to_mechanism(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """Coordinates (nq,) and rates (nv,) of the mechanism at a state of the file."""
        m, model = self.file.mechanism, self.model
        q, v = m.reference(), np.zeros(m.nv)
        for k, names in self._parts:
            a, d = int(model.jnt_qposadr[k]), int(model.jnt_dofadr[k])
            x, zero = np.asarray(qpos)[a:], self.reference[a:]
            kind = int(model.jnt_type[k])
            shift = 3 if kind == FREE else 0
            for i, name in enumerate(names):
                place, rate = m.q_slice[name], m.v_slice[name]
                if kind in (FREE, BALL) and i == len(names) - 1:
                    q[place] = quaternion_product(zero[shift : shift + 4] * CONJUGATE, x[shift : shift + 4])
                    v[rate] = qvel[d + shift : d + shift + 3]
                else:
                    q[place], v[rate] = x[i] - zero[i], qvel[d + i]
        return q, v

    def to_file(self, q: Array, v: Array) -> tuple[Array, Array]:
        """qpos and qvel of the file at coordinates and rates of the mechanism."""
        m, model = self.file.mechanism, self.model
        qpos, qvel = np.array(self.reference), np.zeros(model.nv)
        for k, names in self._parts:
            a, d = int(model.jnt_qposadr[k]), int(model.jnt_dofadr[k])
            for name in names:
                place, rate = m.q_slice[name], m.v_slice[name]
                if m.joint(name).nv == 3:
                    qpos[a : a + 4] = quaternion_product(self.reference[a : a + 4], q[place])
                    qvel[d : d + 3] = v[rate]
                else:
                    qpos[a], qvel[d] = self.reference[a] + q[place][0], v[rate][0]
                    a, d = a + 1, d + 1
        return qpos, qvel
