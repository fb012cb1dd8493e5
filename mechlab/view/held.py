"""What the drives of a mechanism leave free, held at home, so that one value of a drive is one pose."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import generic, rank


class Held:
    """Rows that forbid what is left free with `drives` held: at home, the motions of the null space.

    With N (nv, k) those motions and d(q) (nv,) the displacement from home (coordinates, and rotation vectors of
    spherical joints), the rows are N^T d = 0.
    """

    def __init__(self, mechanism: Mechanism, drives: tuple[str, ...]) -> None:
        self.mechanism = mechanism
        best = structure(mechanism)
        matrix = np.vstack(
            [
                ConstraintSet(mechanism).jacobian(TreeKinematics(mechanism)),
                np.array([mechanism.row(n) for n in drives]).reshape(len(drives), mechanism.nv),
            ]
        )
        free = mechanism.nv - rank_with(mechanism, drives, best.rank)
        self.basis = np.linalg.svd(matrix)[2][mechanism.nv - free :]

    def residual(self, q: Array) -> Array:
        """(k,) what has moved [rad or m]."""
        m = self.mechanism
        moved = np.empty(m.nv)
        for joint in m.joints:
            values = q[m.q_slice[joint.name]]
            moved[m.v_slice[joint.name]] = rotation_vector(values) if joint.kind == "spherical" else values
        return np.asarray(self.basis @ moved)

    def jacobian(self, q: Array) -> Array:
        """(k, nv)."""
        out = self.basis.copy()
        for joint in self.mechanism.joints:
            if joint.kind == "spherical":
                columns = self.mechanism.v_slice[joint.name]
                vector = rotation_vector(q[self.mechanism.q_slice[joint.name]])
                out[:, columns] = self.basis[:, columns] @ right_jacobian_inverse(vector)
        return out


def rank_with(mechanism: Mechanism, drives: tuple[str, ...], rank_alone: int) -> int:
    """Rank of the constraints together with held `drives` at a generic pose."""
    rows = np.array([mechanism.row(n) for n in drives]).reshape(len(drives), mechanism.nv)
    return max(rank_alone, rank(np.vstack([generic(mechanism)[1], rows])))


def rotation_vector(quaternion: Array) -> Array:
    """(3,) axis times angle [rad], at most pi, of a unit quaternion w, x, y, z."""
    w, axis = quaternion[0], quaternion[1:]
    if w < 0:
        w, axis = -w, -axis
    size = float(np.linalg.norm(axis))
    return np.asarray(axis * (2.0 if size < 1e-12 else 2.0 * np.arctan2(size, w) / size), dtype=np.float64)


def right_jacobian_inverse(vector: Array) -> Array:
    """(3, 3): rate of the rotation vector from the angular velocity in the body (Chirikjian 2012, 10.86)."""
    x, y, z = vector
    hat = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = float(np.linalg.norm(vector))
    if angle < 1e-4:
        return np.asarray(np.eye(3) + 0.5 * hat + hat @ hat / 12.0)
    factor = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    return np.asarray(np.eye(3) + 0.5 * hat + factor * (hat @ hat))
