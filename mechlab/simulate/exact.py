"""Accelerations and reactions of hard constraints, from the engine's own terms: for models with distance loops.

MuJoCo holds a distance by a tendon equality, whose dJ/dt v it ignores: its positions converge, its accelerations and
forces do not. They are had from the same mass matrix, forces and Jacobians by

    M a - J^T r = qfrc_smooth + forces of friction and limits,    J a = -dJ/dt v

with the exact rows of `Closure`; redundant rows share their load in the least-squares sense.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.simulate.closure import Closure
from mechlab.simulate.model import constraint_jacobian


class ExactDynamics:
    """Solves the constrained equations at the state of a MjData after mj_forward."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.closure = Closure(model)
        self._mass = np.zeros((model.nv, model.nv))

    def solve(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """(engine nv,) accelerations and (rows,) reactions of the rows of `closure`."""
        model = self.model
        mujoco.mj_fullM(model, data, self._mass)
        jacobian, bias = self.closure.rows(data)
        other = data.efc_type != mujoco.mjtConstraint.mjCNSTR_EQUALITY
        rows = constraint_jacobian(model, data)
        force = data.qfrc_smooth + rows[other].T @ data.efc_force[other]
        free = np.linalg.solve(self._mass, np.column_stack([force, jacobian.T]))
        compliance = jacobian @ free[:, 1:]
        # Scaled to a unit diagonal, so that rows in metres and in radians are cut off alike; void rows stay void.
        diagonal = np.diag(compliance)
        scale = 1.0 / np.sqrt(np.maximum(diagonal, 1e-14 * np.max(diagonal, initial=1e-300)))
        scaled = compliance * scale[:, None] * scale
        reaction = scale * np.linalg.lstsq(scaled, -scale * (bias + jacobian @ free[:, 0]), rcond=1e-11)[0]
        return free[:, 0] + free[:, 1:] @ reaction, reaction
