"""Kinematics of a tree, in world axes: poses, velocities, Jacobians, bias accelerations.

`Kinematics` is the interface that every constraint is written against. `TreeKinematics` implements it with numpy;
Pinocchio implements it in `mechlab.engines.pinocchio`. A six-vector is (linear at the given point, angular), both
in world axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.geometry import (
    Array,
    axis_rotation,
    cross,
    quaternion_exp,
    quaternion_product,
    quaternion_to_matrix,
)
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND


class Kinematics(Protocol):
    """Poses, velocities and Jacobians of a tree at one state, as far as constraints need them."""

    mechanism: Mechanism
    q: Array
    v: Array

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3) body to world and origin (3,) of a body."""
        ...

    def jacobian(self, body: str, point: ArrayLike) -> Array:
        """(6, nv): velocity of the body's point that is now at world `point` (3,), and angular velocity, from v."""
        ...

    def velocity(self, body: str, point: ArrayLike) -> Array:
        """(6,) velocity of the body's point at world `point`, and angular velocity."""
        ...

    def bias(self, body: str, point: ArrayLike) -> Array:
        """(6,) acceleration of that point and angular acceleration when all joint accelerations are zero."""
        ...


def moving_rates(m: Mechanism) -> list[list[int]]:
    """For each body the rates that move it: those of its joints and of the bodies that carry it."""
    out: dict[str, list[int]] = {GROUND: []}
    at = m.v_slice
    for body in m.bodies:
        own = [k for j in body.joints for k in range(at[j.name].start, at[j.name].stop)]
        out[body.name] = out[body.parent] + own if own else out[body.parent]
    return [out[b.name] for b in m.bodies]


def turning_rates(m: Mechanism) -> Array:
    """(nv,) 1 for rates of rotation, 0 for those of slides."""
    out = np.ones(m.nv)
    out[[m.v_slice[name].start for name in m.slides]] = 0.0
    return out


class TreeKinematics:
    """Kinematics of a Mechanism's tree with numpy alone, at the state of the last `set(q, v)`.

    q (nq,) as in `Mechanism.reference()`, v (nv,).
    """

    def __init__(self, mechanism: Mechanism, q: ArrayLike | None = None, v: ArrayLike | None = None) -> None:
        self.mechanism = mechanism
        self.index = {GROUND: -1} | {b.name: i for i, b in enumerate(mechanism.bodies)}
        self._parents = [self.index[b.parent] for b in mechanism.bodies]
        self._placements = [(b.placement.rotation, b.placement.translation) for b in mechanism.bodies]
        self._joints = [
            [(j.kind, np.array(j.axis), mechanism.q_slice[j.name], mechanism.v_slice[j.name].start) for j in b.joints]
            for b in mechanism.bodies
        ]
        self._columns = [np.array(k, dtype=int) for k in moving_rates(mechanism)]
        n = len(mechanism.bodies)
        self.rotations = np.empty((n, 3, 3))
        self.origins = np.empty((n, 3))
        self.axes = np.zeros((mechanism.nv, 3))
        self.anchors = np.zeros((mechanism.nv, 3))
        self.turns = turning_rates(mechanism)
        self.set(mechanism.reference() if q is None else q, v)

    def set(self, q: ArrayLike, v: ArrayLike | None = None, only: Sequence[int] | None = None) -> TreeKinematics:
        """Move to coordinates q (nq,) and rates v (nv,); rates default to zero. `only`: indices of the bodies that are
        moved, in rising order, with all their parents; the others stay where they were. Raises MechlabError for a wrong
        size."""
        q = np.asarray(q, dtype=float)
        m = self.mechanism
        if q.shape != (m.nq,):
            raise MechlabError(f"{m.name}: coordinates have shape {q.shape}, expected ({m.nq},).")
        if v is not None and np.shape(v) != (m.nv,):
            raise MechlabError(f"{m.name}: rates have shape {np.shape(v)}, expected ({m.nv},).")
        self.q = q
        self._motion: tuple[Array, Array, Array, Array] | None = None
        self.v = np.zeros(m.nv) if v is None else np.asarray(v, dtype=float)
        for i in range(len(self._parents)) if only is None else only:
            parent, (r0, p0), joints = self._parents[i], self._placements[i], self._joints[i]
            if parent >= 0:
                carrier = self.rotations[parent]
                rotation, origin = carrier.dot(r0), self.origins[parent] + carrier.dot(p0)
            else:
                rotation, origin = r0, p0
            for kind, axis, qs, k in joints:
                if kind == "revolute":
                    self.axes[k] = rotation.dot(axis)
                    self.anchors[k] = origin
                    rotation = rotation.dot(axis_rotation(axis, q[qs.start]))
                elif kind == "prismatic":
                    self.axes[k] = rotation.dot(axis)
                    origin = origin + self.axes[k] * q[qs.start]
                    self.anchors[k] = origin
                else:
                    rotation = rotation.dot(quaternion_to_matrix(q[qs]))
                    self.axes[k : k + 3] = rotation.T
                    self.anchors[k : k + 3] = origin
            self.rotations[i] = rotation
            self.origins[i] = origin
        return self

    def _body(self, body: str) -> int:
        try:
            return self.index[body]
        except KeyError:
            raise unknown(f"{self.mechanism.name}: body", body, self.index) from None

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3) body to world and origin (3,) of a body."""
        i = self._body(body)
        if i < 0:
            return np.eye(3), np.zeros(3)
        return self.rotations[i], self.origins[i]

    def matrix(self, body: str) -> Array:
        """(4, 4) pose of a body."""
        out = np.eye(4)
        out[:3, :3], out[:3, 3] = self.pose(body)
        return out

    def jacobian(self, body: str, point: ArrayLike) -> Array:
        """(6, nv): linear velocity at the world `point` and angular velocity, from v."""
        out = np.zeros((6, self.mechanism.nv))
        i = self._body(body)
        if i < 0:
            return out
        k = self._columns[i]
        axes, turns = self.axes[k].T, self.turns[k]
        a0, a1, a2 = axes
        r0, r1, r2 = (np.asarray(point, dtype=float) - self.anchors[k]).T
        turned = np.empty(axes.shape)
        turned[0], turned[1], turned[2] = a1 * r2 - a2 * r1, a2 * r0 - a0 * r2, a0 * r1 - a1 * r0
        out[:3, k] = turns * turned + (1.0 - turns) * axes
        out[3:, k] = turns * axes
        return out

    def _moving(self) -> tuple[Array, Array, Array, Array]:
        """Per body, at its origin: velocity, angular velocity, and their rates at zero joint acceleration."""
        if self._motion is None:
            n = len(self._parents)
            lin, ang, lin_b, ang_b = (np.zeros((n, 3)) for _ in range(4))
            for i, parent in enumerate(self._parents):
                if parent >= 0:
                    w, wb = ang[parent], ang_b[parent]
                    arm = self.rotations[parent] @ self._placements[i][1]
                    vel = lin[parent] + cross(w, arm)
                    acc = lin_b[parent] + cross(wb, arm) + cross(w, cross(w, arm))
                else:
                    w, wb, vel, acc = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
                for kind, _axis, _qs, k in self._joints[i]:
                    if kind == "revolute":
                        spin = self.axes[k] * self.v[k]
                        wb = wb + cross(w, spin)
                        w = w + spin
                    elif kind == "prismatic":
                        slide = self.axes[k] * self.v[k]
                        offset = self.axes[k] * self.q[_qs.start]
                        vel = vel + cross(w, offset) + slide
                        acc = acc + cross(wb, offset) + cross(w, cross(w, offset)) + 2.0 * cross(w, slide)
                    else:
                        spin = self.v[k : k + 3] @ self.axes[k : k + 3]
                        wb = wb + cross(w, spin)
                        w = w + spin
                lin[i], ang[i], lin_b[i], ang_b[i] = vel, w, acc, wb
            self._motion = (lin, ang, lin_b, ang_b)
        return self._motion

    def velocity(self, body: str, point: ArrayLike) -> Array:
        """(6,) velocity at the world `point` of the body, and angular velocity."""
        i = self._body(body)
        if i < 0:
            return np.zeros(6)
        lin, ang, _, _ = self._moving()
        arm = np.asarray(point, dtype=float) - self.origins[i]
        return np.concatenate([lin[i] + cross(ang[i], arm), ang[i]])

    def bias(self, body: str, point: ArrayLike) -> Array:
        """(6,) acceleration at the world `point`, and angular acceleration, at zero joint acceleration."""
        i = self._body(body)
        if i < 0:
            return np.zeros(6)
        _, ang, lin_b, ang_b = self._moving()
        arm = np.asarray(point, dtype=float) - self.origins[i]
        w = ang[i]
        return np.concatenate([lin_b[i] + cross(ang_b[i], arm) + cross(w, cross(w, arm)), ang_b[i]])

    # -- dynamics, body by body --------------------------------------------------------------------------------------

    def mass_matrix(self) -> Array:
        """(nv, nv): sum over bodies of J^T m J, plus the inertia of armatures and shafts."""
        m = self.mechanism
        out = np.zeros((m.nv, m.nv))
        for i, body in enumerate(m.bodies):
            if body.inertia.mass == 0.0:
                continue
            r = self.rotations[i]
            columns = self._columns[i]  # of the joints that move the body
            j = self.jacobian(body.name, self.origins[i] + r @ np.array(body.inertia.com))[:, columns]
            tensor = r @ body.inertia.matrix() @ r.T
            out[np.ix_(columns, columns)] += body.inertia.mass * j[:3].T @ j[:3] + j[3:].T @ tensor @ j[3:]
        for joint in m.joints:
            s = m.v_slice[joint.name]
            out[s, s] += joint.armature * np.eye(joint.nv)
        for shaft in m.shafts:
            row = m.row(shaft.name)
            out += shaft.inertia * np.outer(row, row)
        return out

    def bias_force(self) -> Array:
        """(nv,) h(q, v) of M a + h = applied forces: Coriolis, centrifugal and gravity terms (no passive forces)."""
        m = self.mechanism
        out = np.zeros(m.nv)
        gravity = np.array(m.gravity)
        for i, body in enumerate(m.bodies):
            if body.inertia.mass == 0.0:
                continue
            r = self.rotations[i]
            com = self.origins[i] + r @ np.array(body.inertia.com)
            j = self.jacobian(body.name, com)
            acc = self.bias(body.name, com)
            w = self.velocity(body.name, com)[3:]
            tensor = r @ body.inertia.matrix() @ r.T
            out += j[:3].T @ (body.inertia.mass * (acc[:3] - gravity))
            out += j[3:].T @ (tensor @ acc[3:] + cross(w, tensor @ w))
        return out


def integrate(mechanism: Mechanism, q: ArrayLike, dv: ArrayLike) -> Array:
    """Coordinates after the displacement dv (nv,): q + dv, and q * exp(dv) for spherical joints (dv in body axes)."""
    q = np.asarray(q, dtype=float)
    dv = np.asarray(dv, dtype=float)
    if mechanism.nq == mechanism.nv:
        return q + dv
    out = np.empty_like(q)
    for joint in mechanism.joints:
        qs, vs = mechanism.q_slice[joint.name], mechanism.v_slice[joint.name]
        if joint.kind == "spherical":
            turned = quaternion_product(q[qs], quaternion_exp(dv[vs]))
            out[qs] = turned / np.linalg.norm(turned)
        else:
            out[qs] = q[qs] + dv[vs]
    return out


def unit_quaternions(mechanism: Mechanism, q: Array) -> Array:
    """(n, nq) coordinates with quaternions of unit length, as interpolation and extrapolation do not keep it."""
    out = q.copy()
    for joint in mechanism.joints:
        if joint.kind == "spherical":
            s = mechanism.q_slice[joint.name]
            out[:, s] /= np.linalg.norm(out[:, s], axis=1, keepdims=True)
    return out
