"""Kinematics of a tree at many poses at once, with numpy alone: what a path of closed poses needs, without a loop over poses.

For mechanisms whose joints have one coordinate each. A pose costs a few microseconds where there are many of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.mechanism import Mechanism
from mechlab.mechanism.constraints import _LOOP_TABLE, AXES
from mechlab.mechanism.geometry import Array, skew
from mechlab.mechanism.model import GROUND


@dataclass(frozen=True)
class Poses:
    """All joints at P poses: rotations (P, n, 3, 3) and origins (P, n, 3) of what each joint carries, its axis (P, n, 3)
    in the world; the last row of rotations and origins is the ground."""

    rotations: Array
    origins: Array
    axes: Array


class BatchTree:
    """The tree of a Mechanism. A "link" is what a joint carries; link nv is the ground.

    Raises ValueError for a spherical joint.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        m = self.mechanism = mechanism
        if any(j.nv != 1 for j in m.joints):
            raise ValueError(f"{m.name}: joints of one coordinate only")
        n = m.nv
        self.ground = n
        place: dict[str, tuple[int, Array, Array]] = {GROUND: (n, np.eye(3), np.zeros(3))}
        self._links: list[tuple[int, bool, Array]] = []
        self._turned = np.zeros((3, n, 3, 3))
        self._axis = np.zeros((n, 3))
        self.revolute = np.array([j.kind == "revolute" for j in m.joints], dtype=bool)
        self.below = np.zeros((n + 1, n), dtype=bool)
        k = 0
        for body in m.bodies:
            link, rotation, shift = place[body.parent]
            shift = shift + rotation @ body.placement.translation
            rotation = rotation @ body.placement.rotation
            for joint in body.joints:
                across = skew(joint.axis)
                turning = joint.kind == "revolute"
                self._turned[0, k] = rotation
                if turning:
                    self._turned[1, k], self._turned[2, k] = rotation @ across, rotation @ across @ across
                self._axis[k] = joint.axis
                self._links.append((link, turning, shift))
                self.below[k] = self.below[link]
                self.below[k, k] = True
                link, rotation, shift = k, np.eye(3), np.zeros(3)
                k += 1
            place[body.name] = (link, rotation, shift)
        self.place = place
        massive = [b for b in m.bodies if b.inertia.mass > 0.0 and place[b.name][0] != n]
        self.masses = np.array([b.inertia.mass for b in massive])
        self.mass_at = self.points([(b.name, np.array(b.inertia.com)) for b in massive])
        turns = [place[b.name][1] for b in massive]
        self.tensors = np.array([r @ b.inertia.matrix() @ r.T for r, b in zip(turns, massive, strict=True)]).reshape(
            len(massive), 3, 3
        )
        self.frames = self.points([(f.body, f.placement.translation) for f in m.frames])
        self.gravity = np.array(m.gravity)
        self.stride = min(64, max(1, 200_000 // (max(1, len(massive)) * n * 3)))

    def points(self, items: list[tuple[str, Array]]) -> tuple[Array, Array]:
        """Points of bodies as (their links (k,), their places in the links (k, 3))."""
        links, places = [], []
        for body, point in items:
            link, rotation, shift = self.place[body]
            links.append(link)
            places.append(shift + rotation @ point)
        return np.array(links, dtype=int), np.array(places).reshape(len(items), 3)

    def at(self, q: ArrayLike) -> Poses:
        """The tree at coordinates q (P, nv)."""
        q = np.asarray(q, dtype=float)
        count, n = q.shape
        angle = np.where(self.revolute, q, 0.0)
        s, c = np.sin(angle), 1.0 - np.cos(angle)
        turned = self._turned[0] + s[..., None, None] * self._turned[1] + c[..., None, None] * self._turned[2]
        rotations, origins = np.empty((count, n + 1, 3, 3)), np.empty((count, n + 1, 3))
        rotations[:, n], origins[:, n] = np.eye(3), 0.0
        for k, (link, turning, shift) in enumerate(self._links):
            if link == n:
                rotations[:, k], origins[:, k] = turned[:, k], shift
            else:
                np.matmul(rotations[:, link], turned[:, k], out=rotations[:, k])
                origins[:, k] = origins[:, link] + rotations[:, link] @ shift
            if not turning:
                origins[:, k] += (rotations[:, k] @ self._axis[k]) * q[:, k, None]
        axes = (rotations[:, :n] @ self._axis[:, :, None])[..., 0]
        return Poses(rotations, origins, axes)

    def positions(self, poses: Poses, at: tuple[Array, Array]) -> Array:
        """(P, k, 3) world positions of points."""
        links, places = at
        return np.asarray(poses.origins[:, links] + (poses.rotations[:, links] @ places[:, :, None])[..., 0])

    def frame_positions(self, q: ArrayLike) -> Array:
        """(P, frames, 3) world positions of the frames."""
        return self.positions(self.at(q), self.frames)

    def jacobians(self, poses: Poses, links: Array, points: Array) -> tuple[Array, Array]:
        """(P, k, 3, nv) linear at world points (P, k, 3) of the links (k,), and angular."""
        n = self.ground
        on = self.below[links][:, None, :]
        axes = np.swapaxes(poses.axes, 1, 2)[:, None]
        arms = points[..., None] - np.swapaxes(poses.origins[:, :n], 1, 2)[:, None]
        linear = np.empty(np.broadcast_shapes(axes.shape, arms.shape))
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            linear[:, :, i] = axes[:, :, j] * arms[:, :, k] - axes[:, :, k] * arms[:, :, j]
        if not self.revolute.all():
            linear = np.where(self.revolute, linear, axes)
        return np.where(on, linear, 0.0), np.where(on & self.revolute, axes, 0.0)

    def velocities(self, poses: Poses, links: Array, points: Array, u: Array) -> tuple[Array, Array]:
        """(P, k, 3) linear at world points of the links and angular, for rates u (P, nv)."""
        n = self.ground
        spin = np.where(self.revolute, u, 0.0)[..., None] * poses.axes
        push = crossed(poses.origins[:, :n], spin)
        if not self.revolute.all():
            push += np.where(self.revolute, 0.0, u)[..., None] * poses.axes
        on = self.below[links].astype(float)
        angular, moment = on @ spin, on @ push
        return moment + crossed(angular, points), angular


def crossed(a: Array, b: Array) -> Array:
    """Cross products along the last axis, without the checks that make numpy's slow for few of them."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[..., j] * b[..., k], a[..., k] * b[..., j], out=out[..., i])
    return out


class BatchRows:
    """Residual and Jacobian of all loops and relations at many poses; rows as in `mechlab.mechanism.ConstraintSet`, in
    another order."""

    def __init__(self, tree: BatchTree) -> None:
        self.tree = tree
        m = tree.mechanism
        loops = [x for x in m.loops if x.kind != "distance"]
        rods = [x for x in m.loops if x.kind == "distance"]
        self.a = tree.points([(x.body_a, x.placement_a.translation) for x in loops])
        self.b = tree.points([(x.body_b, x.placement_b.translation) for x in loops])
        self.turn_a = np.array([tree.place[x.body_a][1] @ x.placement_a.rotation for x in loops]).reshape(-1, 3, 3)
        self.turn_b = np.array([tree.place[x.body_b][1] @ x.placement_b.rotation for x in loops]).reshape(-1, 3, 3)
        offsets = [(i, AXES.index(u)) for i, x in enumerate(loops) for u in _LOOP_TABLE[x.kind][0]]
        angles = [(i, AXES.index(u), AXES.index(w)) for i, x in enumerate(loops) for u, w in _LOOP_TABLE[x.kind][1]]
        self.offsets = np.array(offsets, dtype=int).reshape(-1, 2).T
        self.angles = np.array(angles, dtype=int).reshape(-1, 3).T
        self.rod_a = tree.points([(x.body_a, x.placement_a.translation) for x in rods])
        self.rod_b = tree.points([(x.body_b, x.placement_b.translation) for x in rods])
        self.lengths = np.array([x.length for x in rods])
        self.relations = np.array([m.coefficient_row(x.coefficients) for x in m.relations]).reshape(-1, m.nv)
        self.count = self.offsets.shape[1] + self.angles.shape[1] + len(rods) + len(m.relations)

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Residual (P, rows) and Jacobian (P, rows, nv) at q (P, nv)."""
        tree = self.tree
        poses = tree.at(q)
        count, n = q.shape
        residuals, jacobians = [], []
        if len(self.a[0]):
            (la, _), (lb, _) = self.a, self.b
            pa, pb = tree.positions(poses, self.a), tree.positions(poses, self.b)
            ra, rb = poses.rotations[:, la] @ self.turn_a, poses.rotations[:, lb] @ self.turn_b
            ja, wa = tree.jacobians(
                poses, la, pb
            )  # of the point of A that is where B's is: with it the turning of A counts
            jb, wb = tree.jacobians(poses, lb, pb)
            back = np.swapaxes(ra, 2, 3)
            i, k = self.offsets
            residuals.append((back @ (pb - pa)[..., None])[:, i, k, 0])
            jacobians.append((back @ (jb - ja))[:, i, k])
            if self.angles.shape[1]:
                i, j, k = self.angles
                u, w = np.swapaxes(ra, 2, 3)[:, i, j], np.swapaxes(rb, 2, 3)[:, i, k]
                residuals.append(np.sum(u * w, axis=-1))
                jacobians.append((crossed(u, w)[:, :, None, :] @ (wa - wb)[:, i])[:, :, 0])
        if len(self.lengths):
            pa, pb = tree.positions(poses, self.rod_a), tree.positions(poses, self.rod_b)
            d = pb - pa
            relative = tree.jacobians(poses, self.rod_b[0], pb)[0] - tree.jacobians(poses, self.rod_a[0], pa)[0]
            residuals.append((np.sum(d * d, axis=-1) - self.lengths**2) / (2.0 * self.lengths))
            jacobians.append((d[:, :, None, :] @ relative)[:, :, 0] / self.lengths[:, None])
        if len(self.relations):
            residuals.append(q @ self.relations.T)
            jacobians.append(np.broadcast_to(self.relations, (count, *self.relations.shape)))
        return np.concatenate(residuals, axis=1), np.concatenate(jacobians, axis=1)
