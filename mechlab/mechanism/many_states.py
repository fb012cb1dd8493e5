"""Motion and masses of a mechanism at P states at once, the state as the last index: each operation runs over all states.

A "link" is what a joint carries, the last link is the ground; joints may be of any kind. Vectors are (..., 3, P). Velocities are
screws at the world's origin: a rate with screw (s, w) on a link with twist (L, W) turns with it, d(s, w)/dt = (W x s + L x w, W x w),
and the mass matrix follows from the inertias of all that a joint carries (Featherstone 2008, sections 2.9 and 6.2).
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism.geometry import Array, skew
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Joint, Shaft

Indices = NDArray[np.intp]
Points = tuple[Indices, Array]
"""The links (k,) of points, and their places in them (k, 3)."""


class StateTree:
    """The tree of a Mechanism, prepared for `ManyStates`."""

    def __init__(self, mechanism: Mechanism) -> None:
        m = self.mechanism = mechanism
        count = len(m.joints)
        self.ground = count
        place: dict[str, tuple[int, Array, Array]] = {GROUND: (count, np.eye(3), np.zeros(3))}
        parents, depth = np.full(count + 1, count), np.zeros(count + 1, dtype=int)
        depth[count] = -1
        # rotation (by rows) and shift in the link that carries the joint = basis[..., 0] + basis[..., 1] sin q (or q of a slide)
        # + basis[..., 2] (1 - cos q); a ball turns after that
        self.basis = np.zeros((count, 12, 3))
        on = np.zeros((count + 1, m.nv))
        axes, links, turns = np.zeros((m.nv, 3)), np.zeros(m.nv, dtype=int), np.ones(m.nv, dtype=bool)
        self.balls: list[tuple[int, slice]] = []
        scalar, columns = [], []
        k = 0
        for body in m.bodies:
            link, rotation, shift = place[body.parent]
            shift = shift + rotation @ body.placement.translation
            rotation = rotation @ body.placement.rotation
            for joint in body.joints:
                s = m.v_slice[joint.name]
                self.basis[k, :9, 0], self.basis[k, 9:, 0] = rotation.ravel(), shift
                if joint.kind == "spherical":
                    self.balls.append((k, m.q_slice[joint.name]))
                    axes[s] = np.eye(3)
                else:
                    scalar.append(k)
                    columns.append(m.q_slice[joint.name].start)
                    axes[s] = joint.axis
                if joint.kind == "revolute":
                    across = skew(joint.axis)
                    self.basis[k, :9, 1], self.basis[k, :9, 2] = (rotation @ across).ravel(), (rotation @ across @ across).ravel()
                elif joint.kind == "prismatic":
                    self.basis[k, 9:, 1] = rotation @ joint.axis
                    turns[s] = False
                links[s], parents[k], depth[k] = k, link, depth[link] + 1
                on[k] = on[link]
                on[k, s] = 1.0
                link, rotation, shift = k, np.eye(3), np.zeros(3)
                k += 1
            place[body.name] = (link, rotation, shift)
        self.place, self.on = place, on
        self.scalar, self.columns = np.array(scalar, dtype=int), np.array(columns, dtype=int)
        self.bends = np.array([m.joints[k].kind == "revolute" for k in scalar], dtype=bool)
        self.levels = [(a, parents[a]) for a in (np.flatnonzero(depth[:count] == d) for d in range(1, max(depth) + 1))]
        self.axes, self.links, self.turns, self.slides = axes, links, turns, np.flatnonzero(~turns)
        self.frames = self.points([(f.body, f.placement.translation) for f in m.frames])
        massive = [b for b in m.bodies if b.inertia.mass > 0.0]
        self.masses = np.array([b.inertia.mass for b in massive])
        self.centres = self.points([(b.name, np.array(b.inertia.com)) for b in massive])
        rotations = [place[b.name][1] for b in massive]
        self.tensors = np.array([r @ b.inertia.matrix() @ r.T for r, b in zip(rotations, massive, strict=True)]).reshape(-1, 3, 3)
        self.gravity = np.array(m.gravity)
        self.own = np.diag([j.armature for j in m.joints for _ in range(j.nv)]).reshape(m.nv, m.nv)
        for shaft in m.shafts:
            self.own = self.own + shaft.inertia * np.outer(m.row(shaft.name), m.row(shaft.name))
        # pairs of rates of which the first carries the link of the second: the elements of the mass matrix
        self.pairs = np.array([(i, j) for j in range(m.nv) for i in np.flatnonzero(on[links[j], : j + 1])], dtype=int).reshape(-1, 2).T
        items: list[Joint | Shaft] = [*(j for j in m.joints if j.nv == 1), *m.shafts]
        passive = [x for x in items if x.damping or x.stiffness]
        self.passive = np.array([m.row(x.name) for x in passive]).reshape(-1, m.nv)
        self.stiffness, self.damping = (np.array([getattr(x, n) for x in passive]) for n in ("stiffness", "damping"))
        self.rest = np.array([x.spring_rest - x.zero for x in passive])
        self.ball_damping = np.array([j.damping if j.kind == "spherical" else 0.0 for j in m.joints for _ in range(j.nv)])
        self.ends = tuple(self.points([(getattr(s, b), np.array(getattr(s, p))) for s in m.springs])
                          for b, p in (("body_a", "point_a"), ("body_b", "point_b")))  # fmt: skip
        self.spring_pairs = self.between(self.ends[0][0], self.ends[1][0])

    def points(self, items: list[tuple[str, Array]]) -> Points:
        """Points of bodies as their links and their places in them."""
        links, places = [], []
        for body, point in items:
            link, rotation, shift = self.place[body]
            links.append(link)
            places.append(shift + rotation @ point)
        return np.array(links, dtype=int), np.array(places).reshape(len(items), 3)

    def between(self, first: Indices, second: Indices) -> tuple[Indices, Indices, Array]:
        """For pairs of links (k,) the rates that move them against each other: pairs (n,), rates (n,), and 1 where the rate moves the
        second, -1 where it moves the first."""
        signs = self.on[second] - self.on[first]
        pairs, rates = np.nonzero(signs)
        return pairs, rates, signs[pairs, rates]


@lru_cache(maxsize=32)
def state_tree(mechanism: Mechanism) -> StateTree:
    """The prepared tree of a Mechanism, made once."""
    return StateTree(mechanism)


class ManyStates:
    """A Mechanism at coordinates q (P, nq) and rates v (P, nv), default 0.

    rotations (links, 3, 3, P), origins (links, 3, P): of the links in the world; axes (nv, 3, P): of the rates. What else is asked for is
    computed then.
    """

    def __init__(self, mechanism: Mechanism, q: Array, v: Array | None = None) -> None:
        tree = self.tree = state_tree(mechanism)
        self.mechanism, self.q, count = mechanism, q, len(q)
        self.v = np.zeros((count, mechanism.nv)) if v is None else v
        steps = np.empty((tree.ground, 12, count))
        steps[:] = tree.basis[:, :, :1]
        if len(tree.scalar):
            values = q[:, tree.columns].T
            weights = np.ones((len(values), 3, count))
            np.sin(values, out=weights[:, 1])
            np.subtract(1.0, np.cos(values), out=weights[:, 2])
            weights[~tree.bends, 1] = values[~tree.bends]
            steps[tree.scalar] = tree.basis[tree.scalar] @ weights
        for k, s in tree.balls:
            turned = np.tensordot(tree.basis[k, :9, 0].reshape(3, 3), _matrices(q[:, s].T), axes=1)
            steps[k, :9] = turned.reshape(9, count)
        turn, shift = steps[:, :9].reshape(-1, 3, 3, count), steps[:, 9:]
        self.rotations, self.origins = np.empty((tree.ground + 1, 3, 3, count)), np.empty((tree.ground + 1, 3, count))
        self.rotations[:-1], self.origins[:-1] = turn, shift
        self.rotations[-1], self.origins[-1] = np.eye(3)[:, :, None], 0.0
        for links, parents in tree.levels:
            by = self.rotations[parents]
            self.rotations[links] = products(by, turn[links])
            self.origins[links] = self.origins[parents] + _times(by, shift[links])
        self.axes = _times(self.rotations[tree.links], tree.axes[:, :, None])

    def positions(self, points: Points) -> Array:
        """(k, 3, P) world positions of points."""
        links, places = points
        return self.origins[links] + _times(self.rotations[links], places[:, :, None])

    def frame_positions(self) -> Array:
        """(P, frames, 3) world positions of the frames."""
        return np.moveaxis(self.positions(self.tree.frames), 2, 0)

    @cached_property
    def screws(self) -> tuple[Array, Array]:
        """(nv, 3, P) velocity of the point at the world's origin and angular velocity, of each rate at 1."""
        tree = self.tree
        linear = crossed(self.origins[tree.links], self.axes)
        if not len(tree.slides):
            return linear, self.axes
        angular = self.axes.copy()
        linear[tree.slides], angular[tree.slides] = self.axes[tree.slides], 0.0
        return linear, angular

    @cached_property
    def turned(self) -> tuple[Array, Array]:
        """(nv, 3, P) rates of the screws."""
        s, w = self.screws
        linear, angular = (x[self.tree.links] for x in self.twists)
        return crossed(angular, s) + crossed(linear, w), crossed(angular, w)

    @cached_property
    def twists(self) -> tuple[Array, Array]:
        """(links, 3, P) velocity of the links' points at the world's origin and angular velocity."""
        return self._summed(self.screws)

    @cached_property
    def biases(self) -> tuple[Array, Array]:
        """(links, 3, P) rates of the twists at no acceleration of the coordinates."""
        return self._summed(self.turned)

    def _summed(self, screws: tuple[Array, Array]) -> tuple[Array, Array]:
        rates, on = self.v.T[:, None, :], self.tree.on
        count = len(self.v)
        first, second = ((on @ (s * rates).reshape(len(s), 3 * count)).reshape(-1, 3, count) for s in screws)
        return first, second

    def motion(self, links: Indices, at: Array) -> tuple[Array, Array, Array, Array]:
        """(k, 3, P) velocity and acceleration, at no acceleration of the coordinates, of the links' points at world `at` (k, 3, P), the
        angular velocity between them and the angular acceleration last."""
        spin, bend = self.twists[1][links], self.biases[1][links]
        speed = self.twists[0][links] + crossed(spin, at)
        return speed, spin, self.biases[0][links] + crossed(bend, at) + crossed(spin, speed), bend

    @cached_property
    def _mass_at(self) -> tuple[Array, Array]:
        """(k, 3, P) centres of mass and (k, 3, 3, P) tensors about them, world axes."""
        tree = self.tree
        turn = self.rotations[tree.centres[0]]
        return self.positions(tree.centres), products(products(turn, tree.tensors[..., None]), np.swapaxes(turn, 1, 2))

    def masses(self) -> Array:
        """(P, nv, nv) mass matrices."""
        tree, count = self.tree, len(self.q)
        (s, w), (centres, tensors) = self.screws, self._mass_at
        weights = tree.masses[:, None, None]
        moments = weights * centres
        spread = tensors - moments[:, :, None] * centres[:, None]
        spread[:, range(3), range(3)] += dot(moments, centres)[:, None]
        carried = tree.on[tree.centres[0]].T  # of each rate: the bodies that it moves
        flat = np.concatenate([moments, spread.reshape(-1, 9, count)], axis=1).reshape(len(weights), -1)
        whole = (carried @ flat).reshape(-1, 12, count)
        mass, moment, inertia = (carried @ tree.masses)[:, None, None], whole[:, :3], whole[:, 3:].reshape(-1, 3, 3, count)
        push, turn = mass * s + crossed(w, moment), crossed(moment, s) + _times(inertia, w)
        i, j = tree.pairs
        found = dot(s[i], push[j]) + dot(w[i], turn[j])
        found += tree.own[i, j][:, None]
        out = np.empty((*tree.own.shape, count))
        out[:] = tree.own[..., None]
        out[i, j] = out[j, i] = found
        return np.ascontiguousarray(out.transpose(2, 0, 1))

    def bias(self) -> Array:
        """(P, nv) forces of velocity and weight, without springs and dampers."""
        tree, count = self.tree, len(self.q)
        (s, w), (centres, tensors) = self.screws, self._mass_at
        _, spin, lift, bend = self.motion(tree.centres[0], centres)
        force = tree.masses[:, None, None] * (lift - tree.gravity[:, None])
        torque = _times(tensors, bend) + crossed(spin, _times(tensors, spin)) + crossed(centres, force)
        carried = tree.on[tree.centres[0]].T
        force, torque = ((carried @ x.reshape(len(x), 3 * count)).reshape(-1, 3, count) for x in (force, torque))
        return np.ascontiguousarray((dot(s, force) + dot(w, torque)).T)

    def passive(self) -> Array:
        """(P, nv) forces of springs and dampers."""
        tree, q, v = self.tree, self.q[:, self.mechanism.q_columns], self.v
        out = -((q @ tree.passive.T - tree.rest) * tree.stiffness + (v @ tree.passive.T) * tree.damping) @ tree.passive
        out -= tree.ball_damping * v
        if not len(self.mechanism.springs):
            return np.asarray(out)
        length, rate, gradient = self._springs
        which, rates, _ = tree.spring_pairs
        for k, spring in enumerate(self.mechanism.springs):
            tension = spring.stiffness * (length[k] - spring.rest_length) + spring.damping * rate[k]
            own = which == k
            out[:, rates[own]] -= (np.where(length[k] < 1e-12, 0.0, tension) * gradient[own]).T
        return np.asarray(out)

    @cached_property
    def _springs(self) -> tuple[Array, Array, Array]:
        """(k, P) lengths of the springs between points and their rates, and (n, P) slopes of the lengths along `spring_pairs`."""
        (s, w), (which, rates, signs) = self.screws, self.tree.spring_pairs
        a, b = (self.positions(x) for x in self.tree.ends)
        d = b - a
        length = np.sqrt(dot(d, d))
        along = d / np.maximum(length, 1e-300)[:, None]
        # the velocity of A along d may be taken at B, since both points lie on the line d
        gradient = signs[:, None] * dot(along[which], s[rates] + crossed(w[rates], b[which]))
        rate = np.zeros_like(length)
        np.add.at(rate, which, gradient * self.v.T[rates])
        return length, rate, gradient

    def kinetic_energy(self) -> Array:
        """(P,) kinetic energy [J]: bodies, armatures and shafts."""
        links = self.tree.centres[0]
        centres, tensors = self._mass_at
        spin = self.twists[1][links]
        speed = self.twists[0][links] + crossed(spin, centres)
        bodies = self.tree.masses @ dot(speed, speed) + dot(spin, _times(tensors, spin)).sum(axis=0)
        return np.asarray(0.5 * (bodies + ((self.v @ self.tree.own) * self.v).sum(axis=1)))

    def potential_energy(self) -> Array:
        """(P,) potential energy [J]: gravity, springs of joints and shafts, springs between points."""
        tree = self.tree
        centres = self.positions(tree.centres)
        out = -np.tensordot(np.outer(tree.masses, tree.gravity), centres, axes=2)
        stretch = self.q[:, self.mechanism.q_columns] @ tree.passive.T - tree.rest
        out += 0.5 * stretch**2 @ tree.stiffness
        for length, spring in zip(self._springs[0] if self.mechanism.springs else (), self.mechanism.springs, strict=True):
            out += 0.5 * spring.stiffness * (length - spring.rest_length) ** 2
        return np.asarray(out)


def crossed(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 3, P)."""
    a0, a1, a2 = a[..., 0, :], a[..., 1, :], a[..., 2, :]
    b0, b1, b2 = b[..., 0, :], b[..., 1, :], b[..., 2, :]
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-2)


def dot(a: Array, b: Array) -> Array:
    """Scalar products of vectors (..., 3, P)."""
    return np.asarray(a[..., 0, :] * b[..., 0, :] + a[..., 1, :] * b[..., 1, :] + a[..., 2, :] * b[..., 2, :])


def _times(a: Array, b: Array) -> Array:
    """Matrices (..., 3, 3, P) times vectors (..., 3, P)."""
    return np.asarray(a[..., 0, :] * b[..., None, 0, :] + a[..., 1, :] * b[..., None, 1, :] + a[..., 2, :] * b[..., None, 2, :])


def products(a: Array, b: Array) -> Array:
    """Matrices (..., 3, 3, P) times matrices (..., 3, 3, P)."""
    out = a[..., 0, None, :] * b[..., None, 0, :, :]
    out += a[..., 1, None, :] * b[..., None, 1, :, :]
    out += a[..., 2, None, :] * b[..., None, 2, :, :]
    return np.asarray(out)


def _matrices(wxyz: Array) -> Array:
    """(3, 3, P) rotations of quaternions (4, P) w, x, y, z, normalized first."""
    w, x, y, z = wxyz / np.sqrt((wxyz * wxyz).sum(axis=0))
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
