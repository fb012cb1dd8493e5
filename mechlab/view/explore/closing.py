"""The equations of a mechanism with its drives held, at many poses at once."""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import generic, independent_rows, rank
from mechlab.view.explore.many import ManyPoses, displacement, rotation_vectors

CLOSED = 1e-11
"""Residual [m, rad] below which a pose counts as closed, when it no longer falls."""


class Closing:
    """Independent closure rows, rows of the drives, and rows that hold at home what the drives leave free: as many as
    there are rates. The rows of `drives` are the last but `len(held)` ones.

    With N (nv, k) the motions that are left and d(q) (nv,) the displacement from home, the held rows are N^T d = 0.
    Raises MechlabError where the drives cannot be told apart from the constraints.
    """

    def __init__(self, mechanism: Mechanism, drives: tuple[str, ...], size: float) -> None:
        self.mechanism, self.drives = mechanism, drives
        self.many = ManyPoses(mechanism)
        self.home = mechanism.reference()
        constraints = ConstraintSet(mechanism)
        self.keep = independent_rows(mechanism, constraints)
        self.drive_rows = np.array([mechanism.row(n) for n in drives]).reshape(len(drives), mechanism.nv)
        self.home_values = np.array([mechanism.value(n, self.home) for n in drives])
        self.held = self._left_free(constraints)
        self.first_drive = len(self.keep)
        if len(self.keep) + len(drives) + len(self.held) != mechanism.nv:
            raise MechlabError(
                f"{mechanism.name}: the drives {', '.join(drives)} hold each other; none can be moved while the others rest."
            )
        self.scale = np.ones(mechanism.nv)
        """Length of a unit of each coordinate: 1 for turns, 1 / size for slides."""
        for joint in mechanism.joints:
            if joint.kind == "prismatic":
                self.scale[mechanism.v_slice[joint.name]] = 1.0 / size

    def _left_free(self, constraints: ConstraintSet) -> Array:
        m = self.mechanism
        matrix = np.vstack([constraints.jacobian(TreeKinematics(m)), self.drive_rows])
        with_drives = rank(np.vstack([generic(m)[1], self.drive_rows]))
        free = m.nv - max(structure(m).rank, with_drives)
        return np.asarray(np.linalg.svd(matrix)[2][m.nv - free :])

    def values(self, q: Array) -> Array:
        """(n, drives) values at q (n, nq)."""
        return np.column_stack([self.mechanism.value(n, q) for n in self.drives])

    def equations(self, q: Array) -> tuple[Array, Array, Array]:
        """Residuals (n, nv), the drives against home; Jacobian (n, nv, nv); largest residual (n,) of all closure rows,
        redundant ones included."""
        m, n = self.mechanism, len(q)
        residual, jacobian = self.many.set(q).residual_and_jacobian()
        worst = np.abs(residual).max(axis=1, initial=0.0)
        held, held_jacobian = self._held(q)
        drives = np.broadcast_to(self.drive_rows, (n, *self.drive_rows.shape))
        out = np.concatenate([residual[:, self.keep], self.values(q) - self.home_values, held], axis=1)
        return (
            out,
            np.concatenate([jacobian[:, self.keep], drives, held_jacobian], axis=1).reshape(n, m.nv, m.nv),
            worst,
        )

    def _held(self, q: Array) -> tuple[Array, Array]:
        m, n = self.mechanism, len(q)
        away = displacement(m, np.broadcast_to(self.home, q.shape), q)
        jacobian = np.tile(self.held, (n, 1, 1))
        if len(self.held):
            for joint in m.joints:
                if joint.kind == "spherical":
                    s = m.v_slice[joint.name]
                    jacobian[:, :, s] = self.held[:, s] @ right_jacobian_inverses(
                        rotation_vectors(q[:, m.q_slice[joint.name]])
                    )
        return away @ self.held.T, jacobian

    def distances(self, q: Array) -> Array:
        """(n,) smallest singular value of the rows, each measured by its largest size at q: 0 where assembly modes meet."""
        jacobian = self.equations(q)[1]
        return smallest_values(jacobian, row_sizes(jacobian))


def row_sizes(jacobians: Array) -> Array:
    """(k,) largest length of each row of matrices (n, k, k): a row that vanishes somewhere is not hidden by scaling."""
    return np.asarray(np.maximum(np.linalg.norm(jacobians, axis=2).max(axis=0), 1e-12))


def smallest_values(jacobians: Array, sizes: Array) -> Array:
    """(n,) smallest singular values of matrices (n, k, k) whose rows are divided by `sizes` (k,)."""
    return np.asarray(np.linalg.svd(jacobians / sizes[:, None], compute_uv=False)[:, -1])


def right_jacobian_inverses(vectors: Array) -> Array:
    """(n, 3, 3): rates of rotation vectors (n, 3) from angular velocities in the body (Chirikjian 2012, 10.86)."""
    hat = np.zeros((len(vectors), 3, 3))
    hat[:, 2, 1], hat[:, 0, 2], hat[:, 1, 0] = vectors.T
    hat -= np.swapaxes(hat, 1, 2)
    angle = np.linalg.norm(vectors, axis=1)
    safe = np.maximum(angle, 1e-4)
    factor = 1.0 / safe**2 - (1.0 + np.cos(safe)) / (2.0 * safe * np.sin(safe))
    return np.asarray(np.eye(3) + 0.5 * hat + np.where(angle < 1e-4, 1.0 / 12.0, factor)[:, None, None] * (hat @ hat))
