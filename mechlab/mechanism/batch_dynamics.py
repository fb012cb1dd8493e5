"""Accelerations of a mechanism at many states at once: M a + h = force + J^T r, J a = -dJ/dt v, without dry friction.

The mathematics is that of `TreeKinematics`, `ConstraintSet` and `statics.passive_force`, which take one state; here the state is
the first index. Velocities are screws at the world's origin: a joint with screw S = (s, w) on a link with twist V turns with it,
dS/dt = V x S (Featherstone 2008, section 2.9).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism.batch_tree import BatchRows, BatchTree, Poses, across, crossed
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft

BLOCK = 400_000
"""Numbers in the largest array of a block of states."""
SOFTENED = 1e-9
"""Share of the largest diagonal element that is added to that of J M^-1 J^T, so that redundant rows leave it regular; the steps of
refinement take its effect away again."""
REFINED = 4
SOLVED_TO = 1e-9
"""A state whose equations are left with more than this, relative to their size, is solved by least squares."""


@dataclass(frozen=True)
class ManyEquations:
    """M a = push + force + J^T r, J a = needed at P states: mass (P, nv, nv), push (P, nv) of weight, velocity, springs and dampers,
    rows (P, m, nv) and needed (P, m) of the constraints."""

    mass: Array
    push: Array
    rows: Array
    needed: Array

    def accelerations(self, force: Array) -> Array:
        """(P, nv) accelerations under the generalized forces (P, nv)."""
        push = self.push + force
        if not self.rows.shape[1]:
            try:
                return np.asarray(np.linalg.solve(self.mass, push[..., None])[..., 0])
            except np.linalg.LinAlgError:
                pass
        return constrained_accelerations(self.mass, push, self.rows, self.needed)


class BatchDynamics:
    """The equations of motion of a mechanism whose joints have one coordinate each. Raises ValueError for a spherical joint."""

    def __init__(self, mechanism: Mechanism) -> None:
        m = self.mechanism = mechanism
        tree = self.tree = BatchTree(m)
        self.rows = BatchRows(tree)
        self.own = np.diag([j.armature for j in m.joints]).reshape(m.nv, m.nv)
        for s in m.shafts:
            self.own = self.own + s.inertia * np.outer(m.row(s.name), m.row(s.name))
        items: list[Joint | Shaft] = [*m.joints, *m.shafts]
        passive = [x for x in items if x.damping or x.stiffness]
        self.passive = np.array([m.row(x.name) for x in passive]).reshape(-1, m.nv)
        self.stiffness, self.damping = (np.array([getattr(x, n) for x in passive]) for n in ("stiffness", "damping"))
        self.rest = np.array([x.spring_rest - x.zero for x in passive])
        self.ends = tuple(tree.points([(getattr(s, b), np.array(getattr(s, p))) for s in m.springs])
                          for b, p in (("body_a", "point_a"), ("body_b", "point_b")))  # fmt: skip
        self.between = (tree.on[self.ends[1][0]] - tree.on[self.ends[0][0]])[:, None, :]

    def accelerations(self, q: Array, v: Array, force: Array) -> Array:
        """(P, nv) accelerations at q (P, nv), v (P, nv) under the generalized forces (P, nv)."""
        found = [self.equations(q[b], v[b]).accelerations(force[b]) for b in self.blocks(len(q))]
        return np.concatenate(found) if found else np.zeros_like(q)

    def blocks(self, count: int) -> Iterator[slice]:
        """Parts of `count` states whose equations fit in memory together."""
        widest = max(6 * len(self.tree.masses), 3 * len(self.rows.a[0]), 1) * max(self.mechanism.nv, 1)
        size = max(1, BLOCK // widest)
        return (slice(k, k + size) for k in range(0, count, size))

    def equations(self, q: Array, v: Array) -> ManyEquations:
        """The equations at q (P, nv), v (P, nv); many states are taken in `blocks`."""
        tree, poses = self.tree, self.tree.at(q)
        screws = tree.screws(poses)
        linear, angular = tree.twists(screws, tree.every, v)
        s, w = screws
        turned = (crossed(angular, s) + crossed(linear, w), crossed(angular, w))
        mass, bias = self._masses(poses, screws, turned, v)
        push = self._passive(poses, screws, q, v) - bias
        if not self.rows.count:
            return ManyEquations(mass, push, np.zeros((len(q), 0, v.shape[1])), np.zeros((len(q), 0)))
        return ManyEquations(mass, push, self.rows.evaluate(q)[1], -self.rows.bias(poses, screws, turned, q, v))

    def _masses(
        self, poses: Poses, screws: tuple[Array, Array], turned: tuple[Array, Array], v: Array
    ) -> tuple[Array, Array]:
        """Mass matrices (P, nv, nv), and forces (P, nv) of velocity and weight."""
        tree = self.tree
        links = tree.mass_at[0]
        centres = tree.positions(poses, tree.mass_at)
        on = tree.on[links][:, None, None, :]
        linear, angular = (x.transpose(1, 2, 0) for x in screws)
        arms = across(centres)
        moves, turns = (linear - arms @ angular) * on, angular * on
        turn = poses.frames[links, :, :3, :3]
        tensors = turn @ tree.tensors @ np.swapaxes(turn, 2, 3)
        slow, spin = tree.twists(screws, links, v)
        gain, bend = tree.twists(turned, links, v)
        speed = slow + crossed(spin, centres)
        lift = gain + crossed(bend, centres) + crossed(spin, speed) - tree.gravity
        twist = (tensors @ bend[..., None])[..., 0] + crossed(spin, (tensors @ spin[..., None])[..., 0])
        weights = tree.masses[:, None, None]
        count, nv = v.shape

        def flat(x: Array) -> Array:
            return x.transpose(1, 0, 2, 3).reshape(count, -1, nv)

        mass = np.swapaxes(flat(moves), 1, 2) @ flat(weights[..., None] * moves)
        mass += np.swapaxes(flat(turns), 1, 2) @ flat(tensors @ turns)
        bias = ((weights * lift)[:, :, None] @ moves + twist[:, :, None] @ turns)[:, :, 0].sum(axis=0)
        return mass + self.own, bias

    def _passive(self, poses: Poses, screws: tuple[Array, Array], q: Array, v: Array) -> Array:
        """(P, nv) forces of springs and dampers."""
        tree = self.tree
        pull = (q @ self.passive.T - self.rest) * self.stiffness + (v @ self.passive.T) * self.damping
        out = -pull @ self.passive
        if not len(self.mechanism.springs):
            return np.asarray(out)
        a, b = (tree.positions(poses, x) for x in self.ends)
        d = b - a
        length = np.sqrt(np.sum(d * d, axis=2))
        linear, angular = (x.transpose(1, 2, 0) for x in screws)
        along = d / np.maximum(length, 1e-300)[..., None]
        # d . (velocity of B - of A); the velocity of A may be taken at B, since both points lie on the line d
        gradient = (along[:, :, None, :] @ (linear - across(b) @ angular))[:, :, 0] * self.between
        rate = (gradient * v).sum(axis=2)
        for k, spring in enumerate(self.mechanism.springs):
            tension = spring.stiffness * (length[k] - spring.rest_length) + spring.damping * rate[k]
            out -= np.where(length[k] < 1e-12, 0.0, tension)[:, None] * gradient[k]
        return np.asarray(out)


def constrained_accelerations(mass: Array, push: Array, rows: Array, needed: Array) -> Array:
    """(P, nv) a of M a = push + J^T r, J a = needed; rows may be redundant. Where M is singular, or the refinement does not settle,
    a state is solved by least squares."""
    across_ = np.swapaxes(rows, 1, 2)
    a = np.full_like(push, np.nan)
    bad: NDArray[np.bool_] = np.ones(len(push), dtype=bool)
    try:
        spread = np.linalg.solve(mass, np.concatenate([across_, push[..., None]], axis=2))
        free, spread = spread[..., -1], spread[..., :-1]
        small = rows @ spread
        soft = SOFTENED * np.max(np.abs(small), axis=(1, 2))[:, None, None] * np.eye(small.shape[1])
        inverse = np.linalg.inv(small + soft)
    except np.linalg.LinAlgError:
        pass
    else:
        missing = needed - (rows @ free[..., None])[..., 0]
        reaction = np.zeros_like(missing)
        for _ in range(REFINED):
            reaction = reaction + (inverse @ (missing - (small @ reaction[..., None])[..., 0])[..., None])[..., 0]
        a = free + (spread @ reaction[..., None])[..., 0]
        left = np.max(np.abs((rows @ a[..., None])[..., 0] - needed), axis=1)
        forces = (across_ @ reaction[..., None])[..., 0] + push
        unmoved = np.max(np.abs((mass @ a[..., None])[..., 0] - forces), axis=1)
        sizes = np.max(np.abs(a), axis=1) + np.max(np.abs(needed), axis=1)
        bad = ~((left <= SOLVED_TO * sizes) & (unmoved <= SOLVED_TO * np.max(np.abs(forces), axis=1, initial=1e-300)))
    nv = mass.shape[1]
    for k in np.flatnonzero(bad):
        whole = np.block([[mass[k], across_[k]], [rows[k], np.zeros((rows.shape[1], rows.shape[1]))]])
        a[k] = np.linalg.lstsq(whole, np.concatenate([push[k], needed[k]]), rcond=1e-12)[0][:nv]
    return a
