"""Residual and Jacobian of all loops and relations at many poses at once."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.constraints import _LOOP_TABLE, AXES
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchTree, across, crossed


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
        self.turn_a = np.array([tree.place[x.body_a][1] @ x.placement_a.rotation for x in loops]).reshape(-1, 1, 3, 3)
        self.turn_b = np.array([tree.place[x.body_b][1] @ x.placement_b.rotation for x in loops]).reshape(-1, 1, 3, 3)
        offsets = [(i, AXES.index(u)) for i, x in enumerate(loops) for u in _LOOP_TABLE[x.kind][0]]
        angles = [(i, AXES.index(u), AXES.index(w)) for i, x in enumerate(loops) for u, w in _LOOP_TABLE[x.kind][1]]
        self.offsets = np.array(offsets, dtype=int).reshape(-1, 2).T
        self.angles = np.array(angles, dtype=int).reshape(-1, 3).T
        self.full = len(offsets) == 3 * len(loops)
        on = tree.on
        self.between = (on[self.b[0]] - on[self.a[0]])[:, None, None, :]
        self.rod_a = tree.points([(x.body_a, x.placement_a.translation) for x in rods])
        self.rod_b = tree.points([(x.body_b, x.placement_b.translation) for x in rods])
        self.rod_between = (on[self.rod_b[0]] - on[self.rod_a[0]])[:, None, None, :]
        self.lengths = np.array([x.length for x in rods])
        self.relations = np.array([m.coefficient_row(x.coefficients) for x in m.relations]).reshape(-1, m.nv)
        self.count = self.offsets.shape[1] + self.angles.shape[1] + len(rods) + len(m.relations)

    def system(self, q: Array) -> Array:
        """(P, rows, nv + 1) Jacobian and, in the last column, residual at q (P, nv)."""
        tree = self.tree
        poses = tree.at(q)
        count, n = q.shape
        parts = []
        if len(self.a[0]) or len(self.lengths):
            linear, angular = (s.transpose(1, 2, 0) for s in tree.screws(poses))
        if len(self.a[0]):
            ra = poses.frames[self.a[0]]
            pa, pb = (ra @ self.a[1])[:, :, :3, 0], tree.positions(poses, self.b)
            back = np.swapaxes(ra[:, :, :3, :3] @ self.turn_a, 2, 3)
            own = np.empty((len(pa), count, 3, n + 1))
            # of the point of A that is where B's is: with it the turning of A counts
            np.multiply(linear - across(pb) @ angular, self.between, out=own[..., :n])
            own[..., n] = pb - pa
            own = back @ own
            if self.full:
                parts.append(own.transpose(1, 0, 2, 3).reshape(count, -1, n + 1))
            else:
                i, k = self.offsets
                parts.append(own[i, :, k].transpose(1, 0, 2))
            if self.angles.shape[1]:
                i, j, k = self.angles
                rb = poses.frames[self.b[0]][:, :, :3, :3] @ self.turn_b
                u, w = back[i, :, j], rb[i, :, :, k]
                turned = np.empty((len(i), count, n + 1))
                turned[..., :n] = (crossed(w, u)[:, :, None, :] @ angular * self.between[i])[:, :, 0]
                turned[..., n] = np.sum(u * w, axis=-1)
                parts.append(turned.transpose(1, 0, 2))
        if len(self.lengths):
            pa, pb = tree.positions(poses, self.rod_a), tree.positions(poses, self.rod_b)
            d = pb - pa
            both = np.empty((len(d), count, n + 1))
            # both ends lie on the line of the rod, so that its direction at B takes the turning of both sides
            both[..., :n] = (d[:, :, None, :] @ (linear - across(pb) @ angular) * self.rod_between)[:, :, 0]
            both[..., n] = 0.5 * (np.sum(d * d, axis=-1) - self.lengths[:, None] ** 2)
            parts.append((both / self.lengths[:, None, None]).transpose(1, 0, 2))
        if len(self.relations):
            linked = np.empty((count, len(self.relations), n + 1))
            linked[..., :n], linked[..., n] = self.relations, q @ self.relations.T
            parts.append(linked)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Residual (P, rows) and Jacobian (P, rows, nv) at q (P, nv)."""
        if not self.count:
            return np.zeros((len(q), 0)), np.zeros((len(q), 0, self.tree.ground))
        found = self.system(q)
        return found[..., -1], found[..., :-1]
