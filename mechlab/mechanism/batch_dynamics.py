"""Accelerations of a mechanism at many states at once: M a + h = force + J^T r, J a = -dJ/dt v, without dry friction.

The mathematics is that of `TreeKinematics`, `ConstraintSet` and `statics.passive_force`, which take one state; see `ManyStates`.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.free_directions import FreeDirections, free_directions
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_states import ManyStates, state_tree
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.small_systems import solve_positive
from mechlab.mechanism.state_rows import state_rows

BLOCK = 70_000
"""Numbers in the largest array of a block of states: it stays in the processor's cache."""
SOFTENED = 1e-9
"""Share of its elements that is added to the diagonal of J M^-1 J^T, so that redundant rows leave it regular; the steps of
refinement take its effect away again."""
ROUNDING = 1e-20
"""Share of the largest element of that diagonal below which another one is rounding: (1e-16)^2, and bodies 1e12 times as light."""
REFINED = 4
WIDE = 24
"""From so many rates on the equations are solved in the directions that the rows leave free."""
SOLVED_TO = 1e-9
"""A state whose equations are left with more than this, relative to their size, is solved by least squares."""


@dataclass(frozen=True)
class FreeEquations:
    """The equations in the directions N that the rows leave free, a = x + N y: mass y = push, for P states. across (P, f, nv): N^T;
    mass (P, f, f): N^T M N; push (P, f): N^T (push - M x)."""

    directions: FreeDirections
    across: Array
    mass: Array
    push: Array


@dataclass(frozen=True)
class ManyEquations:
    """M a = push + force + J^T r, J a = needed at P states: mass (P, nv, nv), push (P, nv) of weight, velocity, springs and dampers,
    rows (P, m, nv) and needed (P, m) of the constraints."""

    mass: Array
    push: Array
    rows: Array
    needed: Array

    @cached_property
    def free(self) -> FreeEquations | None:
        """The same in the free directions; None where `free_directions` has none."""
        at = free_directions(self.rows, self.needed[..., None])
        if at is None:
            return None
        across = np.swapaxes(at.free, 1, 2)
        push = across @ (self.push[..., None] - self.mass @ at.particular)
        return FreeEquations(at, across, across @ (self.mass @ at.free), push[..., 0])

    def accelerations(self, force: Array) -> Array:
        """(P, nv) accelerations under the generalized forces (P, nv)."""
        push = self.push + force
        if not self.rows.shape[1]:
            try:
                return np.asarray(np.linalg.solve(self.mass, push[..., None])[..., 0])
            except np.linalg.LinAlgError:
                pass
        if self.mass.shape[1] < WIDE:
            return constrained_accelerations(self.mass, push, self.rows, self.needed)
        found = self._in_free_directions(force)
        left = np.isnan(found[:, 0])
        if left.any():
            found[left] = constrained_accelerations(self.mass[left], push[left], self.rows[left], self.needed[left])
        return found

    def _in_free_directions(self, force: Array) -> Array:
        """(P, nv) accelerations; NaN where the free directions do not serve."""
        free = self.free
        if free is None:
            return np.full_like(force, np.nan)
        try:
            y = np.linalg.solve(free.mass, free.push[..., None] + free.across @ force[..., None])
        except np.linalg.LinAlgError:
            return np.full_like(force, np.nan)
        at = free.directions
        return np.asarray(np.where(at.served[:, None], (at.particular + at.free @ y)[..., 0], np.nan))


class BatchDynamics:
    """The equations of motion of a mechanism, whatever its joints."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.tree, self.rows = mechanism, state_tree(mechanism), state_rows(mechanism)

    def accelerations(self, q: Array, v: Array, force: Array) -> Array:
        """(P, nv) accelerations at q (P, nq), v (P, nv) under the generalized forces (P, nv)."""
        found = [self.equations(q[b], v[b]).accelerations(force[b]) for b in self.blocks(len(q))]
        return np.concatenate(found) if found else np.zeros_like(v)

    def blocks(self, count: int) -> Iterator[slice]:
        """Parts of `count` states whose equations fit in memory together."""
        widest = max(9 * len(self.tree.masses), 3 * len(self.rows.offset_pairs[0]), 3 * len(self.tree.pairs[0]), 1)
        size = max(1, BLOCK // widest)
        return (slice(k, k + size) for k in range(0, count, size))

    def equations(self, q: Array, v: Array) -> ManyEquations:
        """The equations at q (P, nq), v (P, nv); many states are taken in `blocks`."""
        at = ManyStates(self.mechanism, q, v)
        mass, push = at.masses(), at.passive() - at.bias()
        if not self.rows.count:
            return ManyEquations(mass, push, np.zeros((len(q), 0, v.shape[1])), np.zeros((len(q), 0)))
        return ManyEquations(mass, push, self.rows.jacobian(at), -self.rows.bias(at))


def constrained_accelerations(mass: Array, push: Array, rows: Array, needed: Array) -> Array:
    """(P, nv) a of M a = push + J^T r, J a = needed; rows may be redundant. Where M is singular, or the refinement does not settle,
    a state is solved by least squares."""
    across_ = np.swapaxes(rows, 1, 2)
    a = np.full_like(push, np.nan)
    bad: NDArray[np.bool_] = np.ones(len(push), dtype=bool)
    try:
        spread = solve_positive(mass, np.concatenate([across_, push[..., None]], axis=2))
        free, spread = spread[..., -1], spread[..., :-1]
        small = rows @ spread
        # rows between light bodies would fall below the share that is added, were all not scaled to the same diagonal; those that are
        # rounding are left out
        diagonal = np.einsum("kii->ki", small)
        some = diagonal > ROUNDING * diagonal.max(axis=1, keepdims=True)
        scale = np.where(some, 1.0 / np.sqrt(np.where(some, diagonal, 1.0)), 0.0)
        small = small * scale[:, :, None] * scale[:, None, :]
        inverse = solve_positive(small + SOFTENED * np.eye(small.shape[1]), np.broadcast_to(np.eye(small.shape[1]), small.shape))
    except np.linalg.LinAlgError:
        pass
    else:
        missing = scale * (needed - (rows @ free[..., None])[..., 0])
        reaction = np.zeros_like(missing)
        for _ in range(REFINED):
            reaction = reaction + (inverse @ (missing - (small @ reaction[..., None])[..., 0])[..., None])[..., 0]
        reaction = scale * reaction
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
