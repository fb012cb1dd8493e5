"""Kinematics of a tree at many poses at once: poses, closure residuals and Jacobians, the pose as first index.

The mathematics is that of `TreeKinematics` and `ConstraintSet`, which take one pose; a test compares the two row by
row.
"""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.constraints import AXES, ConstraintSet
from mechlab.mechanism.curve import CurveRelation
from mechlab.mechanism.geometry import Array, quaternion_products, skew
from mechlab.mechanism.kinematics import moving_rates, turning_rates
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, LinearRelation, Loop, Spring

_STILL = np.eye(3)


class ManyPoses:
    """Kinematics of a Mechanism at the n poses of the last `set(q)`, q (n, nq).

    rotations (n, nb, 3, 3), origins (n, nb, 3): body to world; axes, anchors (n, nv, 3): axis and a point of it for
    each rate, world.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.index = {GROUND: -1} | {b.name: i for i, b in enumerate(mechanism.bodies)}
        self._parents = [self.index[b.parent] for b in mechanism.bodies]
        self._columns, self.turns = moving_rates(mechanism), turning_rates(mechanism)
        self.carries = np.zeros((len(mechanism.bodies), mechanism.nv))
        for i, columns in enumerate(self._columns):
            self.carries[i, columns] = 1.0
        constraints = ConstraintSet(mechanism)
        self.loops = [
            (x, constraints.slices[x.name], constraints.items[k].rows) for k, x in enumerate(mechanism.loops)
        ]
        self._relations = [(x, constraints.slices[x.name].start) for x in mechanism.relations]
        self.curves = [(x, constraints.slices[x.name].start) for x in mechanism.curves]
        self.rows = len(constraints)
        # a turn about an axis = basis[0] + basis[1] sin q + basis[2] (1 - cos q) (Rodrigues)
        basis: list[tuple[Array, Array, Array]] = []
        self._turning: list[str] = []
        self._balls: dict[str, Array] = {}
        for body in mechanism.bodies:
            r0 = body.placement.rotation
            for joint in body.joints:
                if joint.kind == "spherical":
                    self._balls[joint.name] = r0
                elif joint.kind == "revolute":
                    self._turning.append(joint.name)
                    hat = skew(np.array(joint.axis))
                    basis.append((r0, r0 @ hat, r0 @ hat @ hat))
                r0 = r0 if joint.kind == "prismatic" else np.eye(3)
        self._basis = np.array(basis).reshape(-1, 3, 9)

    def set(self, q: Array) -> ManyPoses:
        """Move to coordinates q (n, nq)."""
        m, n = self.mechanism, len(q)
        self.q = q
        # the body or rate comes first in memory, the pose as an index
        rotations, origins = np.empty((len(m.bodies), n, 3, 3)), np.empty((len(m.bodies), n, 3))
        axes, anchors = np.zeros((m.nv, n, 3)), np.zeros((m.nv, n, 3))
        steps = self._steps(q)
        for i, (parent, body) in enumerate(zip(self._parents, m.bodies, strict=True)):
            p0, still = body.placement.translation, body.placement.rotation
            rotation = None if parent < 0 else rotations[parent]
            origin = np.broadcast_to(p0, (n, 3)) if rotation is None else origins[parent] + rotation @ p0
            for joint in body.joints:
                k, axis = m.v_slice[joint.name].start, np.array(joint.axis)
                if joint.kind == "prismatic":
                    axes[k] = still @ axis if rotation is None else rotation @ (still @ axis)
                    anchors[k] = origin = origin + axes[k] * q[:, m.q_slice[joint.name]]
                    continue
                rotation, still = steps[joint.name] if rotation is None else rotation @ steps[joint.name], _STILL
                if joint.kind == "revolute":
                    axes[k], anchors[k] = rotation @ axis, origin
                else:
                    axes[k : k + 3], anchors[k : k + 3] = np.moveaxis(rotation, 2, 0), origin
            rotations[i] = still if rotation is None else rotation if still is _STILL else rotation @ still
            origins[i] = origin
        self.rotations, self.origins = np.swapaxes(rotations, 0, 1), np.swapaxes(origins, 0, 1)
        self.axes, self.anchors = np.swapaxes(axes, 0, 1), np.swapaxes(anchors, 0, 1)
        return self

    def _steps(self, q: Array) -> dict[str, Array]:
        """Joint that turns -> (n, 3, 3) its rotation at q (n, nq), after that of the placement of its body where it is the first."""
        weights = np.empty((len(self._turning), len(q), 3))
        angles = q[:, [self.mechanism.q_slice[name].start for name in self._turning]].T
        weights[..., 0], weights[..., 1], weights[..., 2] = 1.0, np.sin(angles), 1.0 - np.cos(angles)
        found = (weights @ self._basis).reshape(len(self._turning), len(q), 3, 3)
        steps = dict(zip(self._turning, found, strict=True))
        return steps | {name: r0 @ matrices(q[:, self.mechanism.q_slice[name]]) for name, r0 in self._balls.items()}

    def poses(self) -> Array:
        """(n, nb, 4, 4) of the bodies, in the order of the Mechanism."""
        out = np.zeros((*self.origins.shape[:2], 4, 4))
        out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = self.rotations, self.origins, 1.0
        return out

    def frame_positions(self) -> Array:
        """(n, frames, 3) world positions of the frames."""
        out = np.empty((len(self.q), len(self.mechanism.frames), 3))
        for k, frame in enumerate(self.mechanism.frames):
            rotation, origin = self.frame(frame.body)
            out[:, k] = rotation @ frame.placement.translation + origin
        return out

    def before(self) -> Array:
        """(nv, nv) 1 where a rate (second index) moves the joint of another (first index) as a whole: the joints that carry it."""
        m = self.mechanism
        out = np.zeros((m.nv, m.nv))
        for parent, body in zip(self._parents, m.bodies, strict=True):
            on = self.carries[parent].copy() if parent >= 0 else np.zeros(m.nv)
            for joint in body.joints:
                s = m.v_slice[joint.name]
                out[s] = on
                on[s] = 1.0
        return out

    def twists(self, v: Array) -> tuple[Array, Array]:
        """(n, nb, 3) velocity of the point of each body that is at the world's origin, and angular velocity, at rates v (n, nv)."""
        turning, turns = self.axes * v[..., None], self.turns[:, None]
        linear = turns * _cross(self.anchors, turning) + (1.0 - turns) * turning
        return self.carries @ linear, self.carries @ (turns * turning)

    def spring(self, spring: Spring, v: Array) -> tuple[Array, Array]:
        """(n,) length [m] of a spring between two points, and its rate [m/s] at rates v (n, nv); 0 where the points meet."""
        (ra, pa), (rb, pb) = self.frame(spring.body_a), self.frame(spring.body_b)
        a, b = pa + ra @ np.array(spring.point_a), pb + rb @ np.array(spring.point_b)
        d = b - a
        length = np.linalg.norm(d, axis=1)
        columns = self._between(spring.body_a, spring.body_b)
        relative = self.motion(spring.body_b, b, columns)[0] - self.motion(spring.body_a, a, columns)[0]
        rate = ((relative @ d[:, :, None])[..., 0] * v[:, columns]).sum(axis=1)
        apart = length >= 1e-12
        return np.where(apart, length, 0.0), np.where(apart, rate / np.where(apart, length, 1.0), 0.0)

    def residual_and_jacobian(self) -> tuple[Array, Array]:
        """(n, rows) and (n, rows, nv) of all constraints, in the order of `ConstraintSet`."""
        n, nv = len(self.q), self.mechanism.nv
        residual, jacobian = np.zeros((n, self.rows)), np.zeros((n, self.rows, nv))
        for loop, place, names in self.loops:
            columns = self._between(loop.body_a, loop.body_b)
            residual[:, place], jacobian[:, place, columns] = self._loop(loop, names, columns)
        for relation, row in self._relations:
            residual[:, row], jacobian[:, row] = self._relation(relation)
        for curve, row in self.curves:
            residual[:, row], slope, _ = self.law(curve)
            jacobian[:, row, self.mechanism.v_slice[curve.output].start] = 1.0
            jacobian[:, row, self.mechanism.v_slice[curve.input].start] = -slope
        return residual, jacobian

    def frame(self, body: str) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) body to world and origins (n, 3) of a body or the ground."""
        i = self.index[body]
        if i < 0:
            return np.tile(np.eye(3), (len(self.q), 1, 1)), np.zeros((len(self.q), 3))
        return self.rotations[:, i], self.origins[:, i]

    def _between(self, a: str, b: str) -> list[int]:
        """The rates that move one body or both."""
        return sorted({k for body in (a, b) if self.index[body] >= 0 for k in self._columns[self.index[body]]})

    def motion(self, body: str, point: Array, columns: list[int] | None = None) -> tuple[Array, Array]:
        """(n, columns, 3) velocity of the body's point at world `point` (n, 3) for each of some rates, default all, and angular
        velocity."""
        i = self.index[body]
        columns = list(range(self.mechanism.nv)) if columns is None else columns
        on = self.carries[i, columns][:, None] if i >= 0 else np.zeros((len(columns), 1))
        axes, turns = on * self.axes[:, columns], self.turns[columns][:, None]
        linear = turns * _cross(axes, point[:, None] - self.anchors[:, columns]) + (1.0 - turns) * axes
        return linear, turns * axes

    def _loop(self, loop: Loop, names: tuple[str, ...], columns: list[int]) -> tuple[Array, Array]:
        (ra, pa), (rb, pb) = self.frame(loop.body_a), self.frame(loop.body_b)
        a, b = loop.placement_a, loop.placement_b
        pa, pb = pa + ra @ a.translation, pb + rb @ b.translation
        (va, wa), (vb, wb) = self.motion(loop.body_a, pa, columns), self.motion(loop.body_b, pb, columns)
        d, relative = pb - pa, vb - va
        if loop.kind == "distance":
            value = ((d * d).sum(axis=1) - loop.length**2) / (2.0 * loop.length)
            return value[:, None], (relative @ d[:, :, None])[:, None, :, 0] / loop.length
        ra, rb = ra @ a.rotation, rb @ b.rotation
        values, rows = [], []
        for name in names:
            u_name, _, w_name = name.rpartition(".")[2].partition("_")
            u = ra[:, :, AXES.index(u_name)]
            if w_name:
                w = rb[:, :, AXES.index(w_name)]
                values.append((u * w).sum(axis=1))
                rows.append(((wa - wb) @ _cross(u, w)[:, :, None])[..., 0])
            else:
                values.append((u * d).sum(axis=1))
                rows.append((relative @ u[:, :, None] + wa @ _cross(u, d)[:, :, None])[..., 0])
        return np.stack(values, axis=1), np.stack(rows, axis=1)

    def law(self, relation: CurveRelation) -> tuple[Array, Array, Array]:
        """(n,) residual, f' and f'' of a curve."""
        m = self.mechanism
        f, slope, bend = relation.curve.many(m.value(relation.input, self.q))
        return m.value(relation.output, self.q) - f, slope, bend

    def _relation(self, relation: LinearRelation) -> tuple[Array, Array]:
        m = self.mechanism
        total = sum(float(c) * self.q[:, m.q_slice[n].start] for n, c in relation.coefficients)
        return np.asarray(total), m.coefficient_row(relation.coefficients)


def moved(mechanism: Mechanism, q: Array, dv: Array) -> Array:
    """Coordinates (n, nq) after displacements dv (n, nv), as `integrate` for one pose."""
    if mechanism.nq == mechanism.nv:
        return q + dv
    out = np.empty_like(q)
    for joint in mechanism.joints:
        qs, vs = mechanism.q_slice[joint.name], mechanism.v_slice[joint.name]
        if joint.kind == "spherical":
            angle = np.linalg.norm(dv[:, vs], axis=1, keepdims=True)
            turn = np.hstack([np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * dv[:, vs]])
            product = quaternion_products(q[:, qs], turn)
            out[:, qs] = product / np.linalg.norm(product, axis=1, keepdims=True)
        else:
            out[:, qs] = q[:, qs] + dv[:, vs]
    return out


def displacement(mechanism: Mechanism, start: Array, end: Array) -> Array:
    """(n, nv) such that `moved(start, displacement) == end`; spherical joints turn by at most pi."""
    if mechanism.nq == mechanism.nv:
        return end - start
    out = np.empty((len(start), mechanism.nv))
    for joint in mechanism.joints:
        qs, vs = mechanism.q_slice[joint.name], mechanism.v_slice[joint.name]
        if joint.kind == "spherical":
            back = start[:, qs] * np.array([1.0, -1.0, -1.0, -1.0])
            out[:, vs] = rotation_vectors(quaternion_products(back, end[:, qs]))
        else:
            out[:, vs] = end[:, qs] - start[:, qs]
    return out


def rotation_vectors(wxyz: Array) -> Array:
    """(n, 3) axis times angle [rad], at most pi, of unit quaternions (n, 4) w, x, y, z."""
    wxyz = np.where(wxyz[:, :1] < 0, -wxyz, wxyz)
    size = np.linalg.norm(wxyz[:, 1:], axis=1)
    factor = np.where(size < 1e-12, 2.0, 2.0 * np.arctan2(size, wxyz[:, 0]) / np.maximum(size, 1e-300))
    return np.asarray(wxyz[:, 1:] * factor[:, None])


def matrices(wxyz: Array) -> Array:
    """(n, 3, 3) rotations of quaternions (n, 4) w, x, y, z, normalized first."""
    w, x, y, z = (wxyz / np.linalg.norm(wxyz, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _cross(a: Array, b: Array) -> Array:
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
