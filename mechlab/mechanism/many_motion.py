"""Velocities, and accelerations at zero joint accelerations, of a mechanism at many poses at once, with numpy alone.

A joint column is the velocity S_k of the point at the world's origin and the angular velocity for rate 1; it moves with what carries
the joint. With the twist (L, W) of what carries it, axis a and a point p of the axis:

    turning  S = (p x a, a),   S' = ((L + W x p) x a + p x (W x a), W x a)        sliding  S = (a, 0),   S' = (W x a, 0)

The bias of a body is the sum of S' v over the joints that move it; the bias of a constraint row is dJ/dt v. Same numbers as
`TreeKinematics.bias` and `ConstraintSet.bias`; a test holds them together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.errors import unknown
from mechlab.mechanism.constraints import AXES
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.named_rows import LETTERS
from mechlab.mechanism.parts import Frame, Loop


class ManyMotion:
    """The motion of the poses that `poses` is set to, at rates v (n, nv)."""

    def __init__(self, poses: ManyPoses, v: Array) -> None:
        self.poses, self.v = poses, v
        turns, axes, anchors = poses.turns[:, None], poses.axes, poses.anchors
        self.linear, self.angular = poses.twists(v)
        moved = axes * v[..., None]
        first = turns * np.cross(anchors, moved) + (1.0 - turns) * moved
        on = poses.before()
        carried, turning = on @ first, on @ (turns * moved)
        spun = np.cross(turning, moved)
        change = np.cross(carried + np.cross(turning, anchors), moved) + np.cross(anchors, spun)
        self.linear_bias = poses.carries @ (turns * change + (1.0 - turns) * spun)
        self.angular_bias = poses.carries @ (turns * spun)

    def point(self, body: str, at: Array) -> tuple[Array, Array]:
        """(n, 6) velocity and bias acceleration of the body's point at world `at` (n, 3), linear, then angular."""
        i = self.poses.index[body]
        if i < 0:
            return np.zeros((len(at), 6)), np.zeros((len(at), 6))
        w, b = self.angular[:, i], self.angular_bias[:, i]
        moving = self.linear[:, i] + np.cross(w, at)
        bias = self.linear_bias[:, i] + np.cross(b, at) + np.cross(w, moving)
        return np.concatenate([moving, w], axis=1), np.concatenate([bias, b], axis=1)

    def bias(self) -> Array:
        """(n, rows) dJ/dt v of all constraints, in the order of `ConstraintSet`."""
        out = np.zeros((len(self.v), self.poses.rows))
        for loop, place, names in self.poses.loops:
            out[:, place] = self._loop(loop, names)
        for curve, row in self.poses.curves:
            rate = self.v[:, self.poses.mechanism.v_slice[curve.input].start]
            out[:, row] = -self.poses.law(curve)[2] * rate**2
        return out

    def _loop(self, loop: Loop, names: tuple[str, ...]) -> Array:
        (ra, pa), (rb, pb) = self.poses.frame(loop.body_a), self.poses.frame(loop.body_b)
        a, b = loop.placement_a, loop.placement_b
        pa, pb = pa + ra @ a.translation, pb + rb @ b.translation
        (va, aa), (vb, ab) = self.point(loop.body_a, pa), self.point(loop.body_b, pb)
        d, dd, acc = pb - pa, (vb - va)[:, :3], (ab - aa)[:, :3]
        if loop.kind == "distance":
            return (_dot(dd, dd) + _dot(d, acc))[:, None] / loop.length
        wa, wb = va[:, 3:], vb[:, 3:]
        ra, rb = ra @ a.rotation, rb @ b.rotation
        rows = []
        for name in names:
            u_name, _, w_name = name.rpartition(".")[2].partition("_")
            u = ra[:, :, AXES.index(u_name)]
            du = np.cross(wa, u)
            ddu = np.cross(aa[:, 3:], u) + np.cross(wa, du)
            if w_name:
                w = rb[:, :, AXES.index(w_name)]
                dw = np.cross(wb, w)
                ddw = np.cross(ab[:, 3:], w) + np.cross(wb, dw)
                rows.append(_dot(ddu, w) + 2.0 * _dot(du, dw) + _dot(u, ddw))
            else:
                rows.append(_dot(ddu, d) + 2.0 * _dot(du, dd) + _dot(u, acc))
        return np.stack(rows, axis=1)


    def bias_of(self, names: Sequence[str]) -> Array:
        """(n, k) dJ/dt v of joints, shafts and coordinates of frames, as of `rows_of`."""
        m, parts = self.poses.mechanism, [np.zeros((len(self.v), 0))]
        for name in names:
            if name in m.scalar_names:
                parts.append(np.zeros((len(self.v), 1)))
                continue
            frame, part = frame_part(m, name)
            bias = self.point(frame.body, _origin(self.poses, frame))[1]
            parts.append(bias[:, 3:] if part == "rotation" else bias[:, [LETTERS.index(part)]])
        return np.concatenate(parts, axis=1)


def rows_of(poses: ManyPoses, names: Sequence[str]) -> Array:
    """(n, k, nv) rows over the rates of joints, shafts and coordinates of frames, FRAME_rotation as three."""
    m, count = poses.mechanism, len(poses.q)
    parts = [np.zeros((count, 0, m.nv))]
    for name in names:
        if name in m.scalar_names:
            parts.append(np.broadcast_to(m.row(name), (count, 1, m.nv)))
            continue
        frame, part = frame_part(m, name)
        linear, angular = poses.motion(frame.body, _origin(poses, frame))
        if part == "rotation":
            parts.append(np.swapaxes(angular, 1, 2))
        else:
            k = LETTERS.index(part)
            parts.append(linear[:, None, :, k] if k < 3 else angular[:, None, :, k - 3])
    return np.concatenate(parts, axis=1)


def frame_part(m: Mechanism, name: str) -> tuple[Frame, str]:
    """The Frame of a name FRAME_x .. FRAME_wz, FRAME_rotation, and which of these it is. Raises MechlabError that lists the names."""
    for frame in m.frames:
        part = name.removeprefix(f"{frame.name}_")
        if part != name and part in (*LETTERS, "rotation"):
            return frame, part
    raise unknown(f"{m.name}: quantity", name, [*m.scalar_names, *(f"{f.name}_{p}" for f in m.frames for p in (*LETTERS, "rotation"))])


def _origin(poses: ManyPoses, frame: Frame) -> Array:
    rotation, origin = poses.frame(frame.body)
    return np.asarray(origin + rotation @ frame.placement.translation)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=1))
