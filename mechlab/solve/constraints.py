"""All constraint rows of a Mechanism at once on Pinocchio's joint columns.

Every row between bodies a and b is one line or one couple W (6,) in world axes: r' = W . (V_b - V_a), V the spatial
velocity (linear at the world's origin, angular). With the joint columns S (6, nv) and the selection N (rows, nv), +1
where a column moves only b, -1 where it moves only a:

    J = N * (W S),     dJ/dt v = W . (dV_b - dV_a) + W' . (V_b - V_a)

    offset row  u . (p_b - p_a):   W = (u, p_b x u)         angle row  u . w:   W = (0, w x u)

(u fixed in a, w in b). Same rows, names and units as `mechlab.mechanism.ConstraintSet`; a test holds them together.
"""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Loop
from mechlab.solve.kinematics import PinKinematics

_NEXT = np.array([1, 2, 0])


class PinConstraints:
    """residual, jacobian and bias of all rows at the state of a PinKinematics; loops in order, then relations."""

    def __init__(self, kin: PinKinematics) -> None:
        m = kin.mechanism
        self.kin = kin
        self._pose = -1
        self._seen: tuple[Array, ...] = ()
        names = ConstraintSet(m)
        self.rows, self.slices = names.rows, names.slices
        self.loops = m.loops
        self.relations = np.array([m.coefficient_row(r.coefficients) for r in m.relations]).reshape(-1, m.nv)
        self._relation_q = np.zeros((len(m.relations), m.nq))
        for i, relation in enumerate(m.relations):
            for name, c in relation.coefficients:
                self._relation_q[i, m.q_slice[name].start] += float(c)
        rows = [
            (k, r.removeprefix(f"{x.name}.")) for k, x in enumerate(m.loops) for r in self.rows[self.slices[x.name]]
        ]
        self.loop_of_row = np.array([k for k, _ in rows], dtype=int)
        self.offset = np.array([i for i, (_, r) in enumerate(rows) if r in "xyz"], dtype=int)
        self.angle = np.array([i for i, (_, r) in enumerate(rows) if "_" in r], dtype=int)
        self.length = np.array([i for i, (_, r) in enumerate(rows) if r == "length"], dtype=int)
        self._u = np.array(["xyz".find(r[0]) for _, r in rows], dtype=int)
        self._w = np.array(["xyz".find(r[-1]) for _, r in rows], dtype=int)
        self._a = np.array([kin.pin.joint_of[x.body_a] for x in m.loops], dtype=int)
        self._b = np.array([kin.pin.joint_of[x.body_b] for x in m.loops], dtype=int)
        self._fixed_a = _fixed(kin, m.loops, "a")
        self._fixed_b = _fixed(kin, m.loops, "b")
        self._lengths = np.array([m.loops[self.loop_of_row[i]].length for i in self.length])
        selection = kin.support[self._b] - kin.support[self._a]
        self.selection = selection[self.loop_of_row] if len(rows) else np.zeros((0, m.nv))
        self._joints = sorted(set(self._a.tolist()) | set(self._b.tolist()))
        place = {j: i for i, j in enumerate(self._joints)}
        self._ia = np.array([place[j] for j in self._a], dtype=int)
        self._ib = np.array([place[j] for j in self._b], dtype=int)

    def __len__(self) -> int:
        return len(self.rows)

    def frames(self) -> tuple[Array, Array]:
        """(loops, 4, 4) poses of the frames a and b of all loops."""
        data = self.kin.data
        poses = np.array([data.oMi[j].homogeneous for j in self._joints]).reshape(-1, 4, 4)
        return poses[self._ia] @ self._fixed_a, poses[self._ib] @ self._fixed_b

    def evaluate(self) -> tuple[Array, Array, Array]:
        """(rows,) residual, (rows, nv) Jacobian, (rows, 6) lines of the loop rows, from one look at the poses."""
        kin = self.kin
        if not len(self.loop_of_row):
            return self._relation_q @ kin.q, self.relations, np.zeros((0, 6))
        residual, lines, _, _, _, _ = self._look()
        jacobian = self.selection * (lines @ kin.spatial)
        if len(self.relations):
            return (
                np.concatenate([residual, self._relation_q @ kin.q]),
                np.concatenate([jacobian, self.relations]),
                lines,
            )
        return residual, jacobian, lines

    def _look(self) -> tuple[Array, ...]:
        """Residual, lines W (rows, 6), directions u and w (rows, 3) of the loop rows, frames a and b; once for each
        pose."""
        if self._pose != self.kin.pose_count:
            a, b = self.frames()
            self._seen = (*self._lines(a, b), a, b)
            self._pose = self.kin.pose_count
        return self._seen

    def _lines(self, a: Array, b: Array) -> tuple[Array, Array, Array, Array]:
        k = self.loop_of_row
        u = a[k, :3, self._u]
        w = b[k, :3, self._w]
        pb = b[k, :3, 3]
        d = pb - a[k, :3, 3]
        residual = np.einsum("ij,ij->i", u, d)
        lines = np.empty((len(k), 6))
        if len(self.length):
            i = self.length
            u[i] = d[i] / self._lengths[:, None]
            residual[i] = (np.einsum("ij,ij->i", d[i], d[i]) / self._lengths - self._lengths) / 2.0
        lines[:, :3] = u
        lines[:, 3:] = _cross(pb, u)
        if len(self.angle):
            i = self.angle
            residual[i] = np.einsum("ij,ij->i", u[i], w[i])
            lines[i, :3] = 0.0
            lines[i, 3:] = _cross(w[i], u[i])
        return residual, lines, u, w

    def residual(self) -> Array:
        """(rows,) r(q)."""
        return self.evaluate()[0]

    def jacobian(self) -> Array:
        """(rows, nv) J(q)."""
        return self.evaluate()[1]

    def bias(self) -> Array:
        """(rows,) dJ/dt v."""
        out = np.zeros(len(self.rows))
        kin = self.kin
        if kin.still or not len(self.loop_of_row):
            return out
        _, lines, u, w, a, b = self._look()
        k = self.loop_of_row
        twists, rates = kin.twists()
        va, vb = twists[self._a[k]], twists[self._b[k]]
        pb = b[k, :3, 3]
        pb_rate = vb[:, :3] + _cross(vb[:, 3:], pb)
        u_rate = _cross(va[:, 3:], u)
        if len(self.length):
            i = self.length
            pa = a[k[i], :3, 3]
            u_rate[i] = (pb_rate[i] - va[i, :3] - _cross(va[i, 3:], pa)) / self._lengths[:, None]
        line_rates = np.empty_like(lines)
        line_rates[:, :3] = u_rate
        line_rates[:, 3:] = _cross(pb_rate, u) + _cross(pb, u_rate)
        if len(self.angle):
            i = self.angle
            line_rates[i, :3] = 0.0
            line_rates[i, 3:] = _cross(_cross(vb[i, 3:], w[i]), u[i]) + _cross(w[i], u_rate[i])
        relative = rates[self._b[k]] - rates[self._a[k]]
        out[: len(k)] = np.einsum("ij,ij->i", lines, relative) + np.einsum("ij,ij->i", line_rates, vb - va)
        return out


def _fixed(kin: PinKinematics, loops: tuple[Loop, ...], side: str) -> Array:
    """(loops, 4, 4) loop frames in the pin joint that carries them."""
    out = np.zeros((len(loops), 4, 4))
    for i, loop in enumerate(loops):
        body, placement = (
            (loop.body_a, loop.placement_a) if side == "a" else (loop.body_b, loop.placement_b)
        )  # fmt: skip
        carried = np.eye(4)
        carried[:3, :3], carried[:3, 3] = kin.pin.offset_of[body]
        out[i] = carried @ placement.matrix()
    return out


def _cross(a: Array, b: Array) -> Array:
    """Row-wise cross product of (n, 3) and (n, 3)."""
    a_next, b_next = a.take(_NEXT, axis=1), b.take(_NEXT, axis=1)
    return (a * b_next - a_next * b).take(_NEXT, axis=1)
