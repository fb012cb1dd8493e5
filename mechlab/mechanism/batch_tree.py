"""Kinematics of a tree, its loops and its relations at many poses at once, with numpy alone.

For mechanisms whose joints have one coordinate each; `mechlab.mechanism.many_poses` takes spherical joints too and is slower.
Many poses cost a few microseconds each; the cost of a single pose is set by the number of numpy calls, hence homogeneous
matrices and products of whole arrays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.constraints import _LOOP_TABLE, AXES
from mechlab.mechanism.geometry import Array, skew
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND

_GROUND = np.eye(4)
CACHED = 20_000
"""Frames of links at a time, where poses are taken in parts: 3 MB, which stay in the processor's cache."""


@dataclass(frozen=True)
class Poses:
    """All joints at P poses: frames (n + 1, P, 4, 4) of their links in the world, the last one the ground."""

    frames: Array


class BatchTree:
    """The tree of a Mechanism; a "link" is what a joint carries, and link nv is the ground.

    Raises ValueError for a spherical joint.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        m = self.mechanism = mechanism
        if any(j.nv != 1 for j in m.joints):
            raise ValueError(f"{m.name}: joints of one coordinate only")
        n = m.nv
        self.ground = n
        place: dict[str, tuple[int, Array, Array]] = {GROUND: (n, np.eye(3), np.zeros(3))}
        parents, depth = np.full(n + 1, n), np.zeros(n + 1, dtype=int)
        depth[n] = -1
        # frame in the parent's = basis[0] + basis[1] sin q (or q of a slide) + basis[2] (1 - cos q)
        basis = np.zeros((n, 3, 4, 4))
        self.axes = np.zeros((n, 1, 4, 1))
        self.revolute = np.array([j.kind == "revolute" for j in m.joints], dtype=bool)
        self.turns_only = bool(self.revolute.all())
        self.below = np.zeros((n + 1, n), dtype=bool)
        k = 0
        for body in m.bodies:
            link, rotation, shift = place[body.parent]
            shift = shift + rotation @ body.placement.translation
            rotation = rotation @ body.placement.rotation
            for joint in body.joints:
                across = skew(joint.axis)
                basis[k, 0, :3, :3], basis[k, 0, :3, 3], basis[k, 0, 3, 3] = rotation, shift, 1.0
                if joint.kind == "revolute":
                    basis[k, 1, :3, :3], basis[k, 2, :3, :3] = rotation @ across, rotation @ across @ across
                else:
                    basis[k, 1, :3, 3] = rotation @ joint.axis
                self.axes[k, 0, :3, 0] = joint.axis
                parents[k], depth[k] = link, depth[link] + 1
                self.below[k] = self.below[link]
                self.below[k, k] = True
                link, rotation, shift = k, np.eye(3), np.zeros(3)
                k += 1
            place[body.name] = (link, rotation, shift)
        self.place, self.parents = place, parents
        self.basis = basis.reshape(n, 3, 16)
        levels = [np.flatnonzero(depth[:n] == d) for d in range(max(depth) + 1)]
        self._levels = [(evenly(a), evenly(parents[a])) for a in levels[1:]]
        self._first, self._slides = evenly(levels[0]), evenly(np.flatnonzero(~self.revolute))
        self.on = self.below.astype(float)
        massive = [b for b in m.bodies if b.inertia.mass > 0.0 and place[b.name][0] != n]
        self.masses = np.array([b.inertia.mass for b in massive])
        self.mass_at = self.points([(b.name, np.array(b.inertia.com)) for b in massive])
        turns = [place[b.name][1] for b in massive]
        self.tensors = np.array([r @ b.inertia.matrix() @ r.T for r, b in zip(turns, massive, strict=True)]).reshape(
            len(massive), 1, 3, 3
        )
        self.frames = self.points([(f.body, f.placement.translation) for f in m.frames])
        self.gravity = np.array(m.gravity)
        self._shape = self.shape(*self.frames)[..., :3].reshape(3, -1) if n == 1 else np.zeros((3, 0))

    def points(self, items: list[tuple[str, Array]]) -> tuple[Array, Array]:
        """Points of bodies as (their links (k,), their places in the links (k, 1, 4, 1), homogeneous)."""
        links, places = [], []
        for body, point in items:
            link, rotation, shift = self.place[body]
            links.append(link)
            places.append([*(shift + rotation @ point), 1.0])
        return np.array(links, dtype=int), np.array(places).reshape(len(items), 1, 4, 1)

    def at(self, q: ArrayLike) -> Poses:
        """The tree at coordinates q (P, nv)."""
        q = np.asarray(q, dtype=float).T
        n, count = q.shape
        weights = np.empty((n, count, 3))
        weights[:, :, 0] = 1.0
        np.sin(q, out=weights[:, :, 1])
        np.subtract(1.0, np.cos(q), out=weights[:, :, 2])
        if not self.turns_only:
            weights[self._slides, :, 1] = q[self._slides]
        steps = (weights @ self.basis).reshape(n, count, 4, 4)
        frames = np.empty((n + 1, count, 4, 4))
        frames[n] = _GROUND
        frames[self._first] = steps[self._first]
        for links, parents in self._levels:
            if isinstance(links, slice):
                np.matmul(frames[parents], steps[links], out=frames[links])
            else:
                frames[links] = frames[parents] @ steps[links]
        return Poses(frames)

    def positions(self, poses: Poses, at: tuple[Array, Array]) -> Array:
        """(k, P, 3) world positions of points."""
        links, places = at
        return np.asarray((poses.frames[links] @ places)[:, :, :3, 0])

    def shape(self, links: Array, places: Array) -> Array:
        """(3, k, 4) for a tree of one joint: points = first + second sin q (or q of a slide) + third (1 - cos q)."""
        fixed = np.zeros((3, 4, 4))
        fixed[0] = _GROUND
        both = np.stack([self.basis[0].reshape(3, 4, 4), fixed])
        return np.asarray((both[links].swapaxes(0, 1) @ places[None, :, 0])[..., 0])

    def frame_positions(self, q: ArrayLike) -> Array:
        """(P, frames, 3) world positions of the frames."""
        if self.ground == 1:
            return self._swept(q)
        q = np.asarray(q, dtype=float)
        size = max(1, CACHED // self.ground)
        parts = [self.positions(self.at(q[k : k + size]), self.frames) for k in range(0, max(len(q), 1), size)]
        return np.swapaxes(parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1), 0, 1)

    def _swept(self, q: ArrayLike) -> Array:
        """`frame_positions` of a tree of one joint, in closed form."""
        x = np.asarray(q, dtype=float)[:, 0]
        waves = np.empty((len(x), 3))
        waves[:, 0] = 1.0
        if self.revolute[0]:
            np.sin(x, out=waves[:, 1])
            np.subtract(1.0, np.cos(x), out=waves[:, 2])
        else:
            waves[:, 1], waves[:, 2] = x, 0.0
        return (waves @ self._shape).reshape(len(x), -1, 3)

    def screws(self, poses: Poses) -> tuple[Array, Array]:
        """(n, P, 3) velocity of the point at the world's origin and (n, P, 3) angular velocity, of each joint at rate 1."""
        joints = poses.frames[:-1]
        angular = (joints @ self.axes)[:, :, :3, 0]
        linear = crossed(joints[..., :3, 3], angular)
        if not self.turns_only:
            linear[self._slides] = angular[self._slides]
            angular = angular.copy()
            angular[self._slides] = 0.0
        return linear, angular

    def twists(self, screws: tuple[Array, Array], links: Array | NDArray[np.intp], u: Array) -> tuple[Array, Array]:
        """(k, P, 3) velocity of the links' point at the world's origin and angular velocity, for rates u (P, nv)."""
        rates, on = u.T[:, :, None], self.on[links]
        n, count = u.shape[1], u.shape[0]
        first, second = (np.asarray(on @ (s * rates).reshape(n, 3 * count)).reshape(-1, count, 3) for s in screws)
        return first, second


def evenly(indices: NDArray[np.intp]) -> slice | NDArray[np.intp]:
    """The indices (k,) as a slice where they rise evenly, or are one and the same: what it takes is not copied."""
    if not len(indices):
        return slice(0, 0)
    first, last = int(indices[0]), int(indices[-1])
    step = int(indices[1]) - first if len(indices) > 1 else 1
    even = step > 0 and np.array_equal(indices, np.arange(first, last + 1, step))
    return slice(first, last + 1, max(step, 1)) if even or np.all(indices == first) else indices


_CROSS = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _CROSS[_i, _j, _k], _CROSS[_i, _k, _j] = -1.0, 1.0
_CROSS_ROWS = _CROSS.reshape(3, 9)


def across(a: Array) -> Array:
    """(..., 3, 3) matrices with across(a) @ b = a x b."""
    return np.asarray((a @ _CROSS_ROWS).reshape(*a.shape, 3))


def crossed(a: Array, b: Array) -> Array:
    """Cross products along the last axis, in few calls."""
    return np.asarray((across(a) @ b[..., None])[..., 0])


def fixed_frames(turns: Array, places: Array) -> Array:
    """(k, 1, 4, 4) of rotations (k, 1, 3, 3) and places (k, 1, 4, 1), homogeneous."""
    out = np.zeros((len(turns), 1, 4, 4))
    out[..., :3, :3], out[..., 3] = turns, places[..., 0]
    return out


class BatchRows:
    """Residual and Jacobian of all loops, relations and curves at many poses; rows as in `mechlab.mechanism.ConstraintSet`, in
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
        both = np.concatenate([self.turn_a, self.turn_b]), np.concatenate([self.a[1], self.b[1]])
        self._ends = np.concatenate([self.a[0], self.b[0]]), fixed_frames(*both)
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
        self.curves = [(x.curve, m.zero(x.output), m.zero(x.input)) for x in m.curves]
        self.curve_ends = np.array([(m.v_slice[x.output].start, m.v_slice[x.input].start) for x in m.curves], dtype=int).reshape(-1, 2)
        self.names = (
            *(f"{loops[i].name}.{AXES[u]}" for i, u in offsets), *(f"{loops[i].name}.{AXES[u]}_{AXES[w]}" for i, u, w in angles),
            *(f"{x.name}.length" for x in rods), *(x.name for x in m.relations),
            *(x.name for x in m.curves),
        )  # fmt: skip
        self.count = len(self.names)
        kinds = np.repeat(
            ("offset", "angle", "offset", "relation"), (len(offsets), len(angles), len(rods), len(m.relations) + len(m.curves))
        )
        self.kinds = {kind: np.flatnonzero(kinds == kind) for kind in ("offset", "angle", "relation")}
        """Kind of row -> its rows: lengths [m], sines of angles, sums of relations [rad or m]."""

    def ends(self, poses: Poses) -> tuple[Array, Array, Array, Array]:
        """Place (k, P, 3) and axes, as columns (k, P, 3, 3), of the frames of both ends of the loops: pa, ra, pb, rb."""
        links, ends = self._ends
        at, k = poses.frames[links] @ ends, len(links) // 2
        return at[:k, :, :3, 3], at[:k, :, :3, :3], at[k:, :, :3, 3], at[k:, :, :3, :3]

    def system(self, q: Array) -> Array:
        """(P, rows, nv + 1) Jacobian and, in the last column, residual at q (P, nv)."""
        tree = self.tree
        poses = tree.at(q)
        count, n = q.shape
        parts = []
        if len(self.a[0]) or len(self.lengths):
            linear, angular = (s.transpose(1, 2, 0) for s in tree.screws(poses))
        if len(self.a[0]):
            pa, ra, pb, rb = self.ends(poses)
            back = np.swapaxes(ra, 2, 3)
            own = np.empty((len(pa), count, 3, n + 1))
            # velocity relative to the point of A that coincides with the point of B, which takes in the rotation of A
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
                u, w = back[i, :, j], rb[i, :, :, k]
                turned = np.empty((len(i), count, n + 1))
                turned[..., :n] = (crossed(w, u)[:, :, None, :] @ angular * self.between[i])[:, :, 0]
                turned[..., n] = np.einsum("ipk,ipk->ip", u, w)
                parts.append(turned.transpose(1, 0, 2))
        if len(self.lengths):
            pa, pb = tree.positions(poses, self.rod_a), tree.positions(poses, self.rod_b)
            d = pb - pa
            both = np.empty((len(d), count, n + 1))
            # both ends lie on the line of the rod, so the velocity of A along it may be taken at B
            both[..., :n] = (d[:, :, None, :] @ (linear - across(pb) @ angular) * self.rod_between)[:, :, 0]
            both[..., n] = 0.5 * (np.sum(d * d, axis=-1) - self.lengths[:, None] ** 2)
            parts.append((both / self.lengths[:, None, None]).transpose(1, 0, 2))
        if len(self.relations):
            linked = np.empty((count, len(self.relations), n + 1))
            linked[..., :n], linked[..., n] = self.relations, q @ self.relations.T
            parts.append(linked)
        if self.curves:
            value, slope, _ = self.laws(q)
            coupled = np.zeros((count, len(self.curves), n + 1))
            at, (b, a) = np.arange(len(self.curves)), self.curve_ends.T
            coupled[:, at, b], coupled[:, at, a], coupled[..., n] = 1.0, -slope, value
            parts.append(coupled)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def residual(self, q: Array) -> Array:
        """(P, rows) residual at q (P, nv); cheaper than `system`."""
        tree = self.tree
        poses, parts = tree.at(q), []
        if len(self.a[0]):
            pa, ra, pb, rb = self.ends(poses)
            i, k = self.offsets
            apart = ((pb - pa)[:, :, None] @ ra)[:, :, 0]
            parts.append(apart[i, :, k])
            if self.angles.shape[1]:
                i, j, k = self.angles
                parts.append(np.einsum("ipk,ipk->ip", ra[i, :, :, j], rb[i, :, :, k]))
        if len(self.lengths):
            d = tree.positions(poses, self.rod_b) - tree.positions(poses, self.rod_a)
            lengths = self.lengths[:, None]
            parts.append(0.5 * (np.sum(d * d, axis=-1) - lengths**2) / lengths)
        if len(self.relations):
            parts.append(self.relations @ q.T)
        if self.curves:
            parts.append(self.laws(q)[0].T)
        return np.concatenate(parts).T if parts else np.zeros((len(q), 0))

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Residual (P, rows) and Jacobian (P, rows, nv) at q (P, nv)."""
        if not self.count:
            return np.zeros((len(q), 0)), np.zeros((len(q), 0, self.tree.ground))
        found = self.system(q)
        return found[..., -1], found[..., :-1]

    def laws(self, q: Array) -> tuple[Array, Array, Array]:
        """(P, curves) residual, f' and f'' of the curves at q (P, nv)."""
        out = np.empty((3, len(q), len(self.curves)))
        for k, ((curve, zero_b, zero_a), (b, a)) in enumerate(zip(self.curves, self.curve_ends, strict=True)):
            out[:, :, k] = curve.many(zero_a + q[:, a])
            out[0, :, k] = zero_b + q[:, b] - out[0, :, k]
        return out[0], out[1], out[2]
