"""All constraint rows of a Mechanism at once on Pinocchio's joint columns.

Every row between bodies a and b is one line or one couple W (6,) in world axes: r' = W . (V_b - V_a), V the spatial
velocity (linear at the world's origin, angular). With the joint columns S (6, nv) and the selection N (rows, nv), +1
where a column moves only b, -1 where it moves only a:

    J = N * (W S),     dJ/dt v = r'' without accelerations of the joints

    offset row  u . (p_b - p_a):   W = (u, p_b x u)         angle row  u . w:   W = (0, w x u)

(u fixed in a, w in b). Same rows, names and units as `mechlab.mechanism.ConstraintSet`; a test holds them together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Loop

Indices = NDArray[np.int_]
_NEXT = np.array([1, 2, 0])
_MATRIX = np.zeros((6, 16))
"""(v, w) @ _MATRIX: the matrix of a twist by rows, [w x, v; 0, 0]."""
_MATRIX[[0, 1, 2], [3, 7, 11]] = 1.0
_MATRIX[[3, 4, 5], [9, 2, 4]] = 1.0
_MATRIX[[3, 4, 5], [6, 8, 1]] = -1.0
_TWICE = np.array([1.0, 2.0, 1.0])


class PinConstraints:
    """residual, jacobian and bias of all rows at the state of a PinKinematics; loops in order, then relations, then curves."""

    def __init__(self, kin: PinKinematics) -> None:
        m = kin.mechanism
        self.kin = kin
        self._pose = -1
        self._seen: tuple[Array, Array, Array, Array] = (
            np.zeros(0),
            np.zeros((0, 6)),
            np.zeros((7, 0, 3)),
            np.zeros((0, 4, 4)),
        )
        names = ConstraintSet(m)
        self.rows, self.slices = names.rows, names.slices
        self.loops = m.loops
        self.relations = np.array([m.coefficient_row(r.coefficients) for r in m.relations]).reshape(-1, m.nv)
        self._relation_q = np.zeros((len(m.relations), m.nq))
        for i, relation in enumerate(m.relations):
            for name, c in relation.coefficients:
                self._relation_q[i, m.q_slice[name].start] += float(c)
        self._curves = tuple(
            (m.q_slice[x.output].start, m.q_slice[x.input].start, m.v_slice[x.input].start, m.zero(x.output), m.zero(x.input), x.curve)
            for x in m.curves
        )
        if self._curves:  # their rows stand behind those of the relations; the slopes are filled in at each pose
            self._relation_q = np.vstack([self._relation_q, np.zeros((len(self._curves), m.nq))])
            self.relations = np.vstack([self.relations, [m.row(x.output) for x in m.curves]])
            for i, (b, *_) in enumerate(self._curves):
                self._relation_q[len(m.relations) + i, b] = 1.0
        rows = [
            (k, r.removeprefix(f"{x.name}.")) for k, x in enumerate(m.loops) for r in self.rows[self.slices[x.name]]
        ]
        self.loop_of_row = np.array([k for k, _ in rows], dtype=int)
        self.offset = np.array([i for i, (_, r) in enumerate(rows) if r in "xyz"], dtype=int)
        self.angle = np.array([i for i, (_, r) in enumerate(rows) if "_" in r], dtype=int)
        self.length = np.array([i for i, (_, r) in enumerate(rows) if r == "length"], dtype=int)
        self._a = np.array([kin.pin.joint_of[x.body_a] for x in m.loops], dtype=int)
        self._b = np.array([kin.pin.joint_of[x.body_b] for x in m.loops], dtype=int)
        self._fixed = np.concatenate([_fixed(kin, m.loops, "a"), _fixed(kin, m.loops, "b")])
        self._lengths = np.array([m.loops[self.loop_of_row[i]].length for i in self.length])
        selection = kin.support[self._b] - kin.support[self._a]
        self.selection = selection[self.loop_of_row] if len(rows) else np.zeros((0, m.nv))
        joints = sorted(set(self._a.tolist()) | set(self._b.tolist()))
        place = {j: i for i, j in enumerate(joints)}
        self._place = np.array([place[j] for j in (*self._a, *self._b)], dtype=int)
        self._joints = joints
        k = self.loop_of_row
        self._sides = np.concatenate([kin.support[self._a], kin.support[self._b]])
        self._picked = _picked([r for _, r in rows], k, len(m.loops))
        self._ends = self._picked[:3].ravel()
        moved = np.ones(len(rows))
        moved[self.angle] = 0.0
        self._moved = moved[:, None]

    def __len__(self) -> int:
        return len(self.rows)

    def frames(self) -> tuple[Array, Array]:
        """(loops, 4, 4) poses of the frames a and b of all loops."""
        both = self._frames()
        return both[: len(self.loops)], both[len(self.loops) :]

    def _frames(self) -> Array:
        """(2 loops, 4, 4) frames a of all loops, then frames b."""
        placed = self.kin.placed().oMi
        poses = np.concatenate([placed[j].homogeneous for j in self._joints]).reshape(-1, 4, 4)
        return np.asarray(poses.take(self._place, axis=0) @ self._fixed)

    def evaluate(self) -> tuple[Array, Array, Array]:
        """(rows,) residual, (rows, nv) Jacobian, (rows, 6) lines of the loop rows, from one look at the poses."""
        kin = self.kin
        if self._curves:
            return self._with_curves()
        if not len(self.loop_of_row):
            return self._relation_q @ kin.q, self.relations, np.zeros((0, 6))
        residual, lines, _, _ = self._look()
        jacobian = self.selection * (lines @ kin.spatial)
        if len(self.relations):
            return (
                np.concatenate([residual, self._relation_q @ kin.q]),
                np.concatenate([jacobian, self.relations]),
                lines,
            )
        return residual, jacobian, lines

    def _with_curves(self) -> tuple[Array, Array, Array]:
        """`evaluate` with the rows of curves: output - f(input)."""
        kin = self.kin
        residual, jacobian, lines = np.zeros(0), np.zeros((0, self.selection.shape[1])), np.zeros((0, 6))
        if len(self.loop_of_row):
            residual, lines, _, _ = self._look()
            jacobian = self.selection * (lines @ kin.spatial)
        sums, rows = self._relation_q @ kin.q, self.relations.copy()
        first = len(sums) - len(self._curves)
        for i, (_, a, column, zero_b, zero_a, curve) in enumerate(self._curves, first):
            value, slope, _ = curve.at(zero_a + float(kin.q[a]))
            sums[i] += zero_b - value
            rows[i, column] = -slope
        return np.concatenate([residual, sums]), np.concatenate([jacobian, rows]), lines

    def _look(self) -> tuple[Array, Array, Array, Array]:
        """Residual (rows,) and lines W (rows, 6) of the loop rows, the vectors (7, rows, 3) that `_picked` takes from the frames, and
        the frames (2 loops, 4, 4); once for each pose."""
        if self._pose != self.kin.pose_count:
            frames = self._frames()
            self._seen = (*self._lines(frames), frames)
            self._pose = self.kin.pose_count
        return self._seen

    def _lines(self, frames: Array) -> tuple[Array, Array, Array]:
        parts: Array = np.take(frames, self._picked)
        u, held, start, u1, u2, held1, held2 = (parts[i] for i in range(7))
        d = held - start
        residual = np.add.reduce(u * d, axis=1)
        lines = np.empty((len(u), 6))
        lines[:, :3] = u * self._moved
        lines[:, 3:] = held1 * u2 - held2 * u1
        if len(self.length):
            i = self.length
            u[i] = d[i] / self._lengths[:, None]
            residual[i] = ((d[i] * d[i]).sum(axis=1) / self._lengths - self._lengths) / 2.0
            lines[i, :3] = u[i]
            lines[i, 3:] = cross_rows(held[i], u[i])
        return residual, lines, parts

    def residual(self) -> Array:
        """(rows,) r(q)."""
        if self._curves:
            return self._with_curves()[0]
        own = self._look()[0] if len(self.loop_of_row) else np.zeros(0)
        return np.concatenate([own, self._relation_q @ self.kin.q]) if len(self.relations) else own

    def jacobian(self) -> Array:
        """(rows, nv) J(q)."""
        return self.evaluate()[1]

    def bias(self) -> Array:
        """(rows,) dJ/dt v."""
        out = np.zeros(len(self.rows))
        kin = self.kin
        if kin.still:
            return out
        for row, (_, a, column, _, zero, curve) in enumerate(self._curves, len(out) - len(self._curves)):
            out[row] = -curve.at(zero + float(kin.q[a]))[2] * float(kin.v[column]) ** 2
        if not len(self.loop_of_row):
            return out
        own, frames, loops = len(self.loop_of_row), self._look()[3], len(self._sides)
        # a frame F moves by F' = W F, F'' = W' F + W F', W the twist of its body as a matrix
        turns = self._sides.dot((kin.spatial * kin.v).T).dot(_MATRIX).reshape(loops, 4, 4)
        changes = self._sides.dot((kin.spatial_rate * kin.v).T).dot(_MATRIX).reshape(loops, 4, 4)
        moved = np.empty((3, *frames.shape))
        moved[0] = frames
        np.matmul(turns, frames, out=moved[1])
        np.add(changes @ frames, turns @ moved[1], out=moved[2])
        parts: Array = moved.reshape(3, -1).take(self._ends, axis=1).reshape(3, 3, 3 * own)
        d = parts[:, 1] - parts[:, 2]
        # r = u . d, so that r'' = u . d'' + 2 u' . d' + u'' . d
        np.add.reduce(_TWICE.dot(parts[::-1, 0] * d).reshape(own, 3), axis=1, out=out[:own])
        if len(self.length):
            d, dd, ddd = d.reshape(3, own, 3)[:, self.length]
            out[self.length] = (dd * dd + d * ddd).sum(axis=1) / self._lengths
        return out


def _picked(rows: list[str], loop: Indices, loops: int) -> Indices:
    """(7, rows, 3) flat indices into the frames (2 loops, 4, 4) of all loops, a then b: of u; of p_b or w; of p_a or
    zeros; then of u, and of p_b or w, with x y z rotated by one and by two places, as cross products need them."""
    axis = np.arange(3)
    places = np.empty((7, len(rows), 3), dtype=int)
    for i, (row, k) in enumerate(zip(rows, loop.tolist(), strict=True)):
        a, b = 16 * k, 16 * (loops + k)
        u = a + 4 * axis + "xyz".find(row[0]) if row != "length" else a + 4 * axis
        if "_" in row:
            held, start = b + 4 * axis + "xyz".find(row[-1]), a + 12 + axis
        else:
            held, start = b + 4 * axis + 3, a + 4 * axis + 3
        places[:, i] = u, held, start, np.roll(u, -1), np.roll(u, -2), np.roll(held, -1), np.roll(held, -2)
    return places


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


def cross_rows(a: Array, b: Array) -> Array:
    """Row-wise cross product of (n, 3) and (n, 3)."""
    a_next, b_next = a.take(_NEXT, axis=1), b.take(_NEXT, axis=1)
    return (a * b_next - a_next * b).take(_NEXT, axis=1)
