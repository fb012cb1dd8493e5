"""Inverse dynamics under constraints for laws: the forces of drives that give some coordinates the accelerations asked for.

With m independent rows J of the constraints, k commanded rows R and e unit rows E of freedoms that nobody commands, the matrix
S = [J; R; E] is square. One factorization of it gives the accelerations and the free directions N (nv, k + e):

    S a = [-b; commands; 0],    S N = [0; I]       so that J a = -b, J N = 0

    N^T (M (a + N_e y) + h) = (B N)^T f            k + e equations for the forces f (k,) and the rates' accelerations y (e,)

B rows of the drives. Which rows and unit rows are taken is decided once and kept; rows left out are checked at every state. In a run
the loops are a little open, by the error of a step or the softness of an engine, and rows that repeat others where they are closed do so
nearly only: as many are taken as are independent in closed poses.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv

from mechlab.experiment.laws.protocol import Plant
from mechlab.mechanism.batch_dynamics import ManyEquations
from mechlab.mechanism.free_directions import CONDITION, RANK, independent, pivoted
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import structure

OPEN = 1e-4
"""Relative residual up to which rows that were left out agree with those that were taken; about as much as loops are open is left."""
FALLEN = 1e-3
"""Share of the first determinant above which no pivot is looked at."""
TRIES = 10
"""After so many failures in a row the least-squares solution is taken for the rest of the run."""


class InverseDynamics:
    """Solves M a + h = B^T f + J^T r, J a + b = 0, R a = commands for f, for many states of one mechanism.
    A plant may have `constraint_rows()`, J and b at once, and `mass_times(x)`, M x (nv,) as a new array: then these are called. It may
    have `unreduced` equations with further rates behind those of the Mechanism, and rows that bind these: then they are solved.

    rows (k, nv): R; drives: names of the k joints or shafts of B. Uncommanded freedoms follow their own dynamics.
    """

    def __init__(self, mechanism: Mechanism, rows: Array, drives: tuple[str, ...]) -> None:
        self.mechanism, self.rows = mechanism, np.asarray(rows, dtype=float)
        self.actuation = np.array([mechanism.row(name) for name in drives]).reshape(-1, mechanism.nv)
        self._choice: _Choice | None = None
        self._seen: _Questions | None = None
        self._failed = 0

    def __call__(self, plant: Plant, accelerations: Array) -> Array:
        """(k,) forces that give `rows @ a = accelerations` at the state of the plant, whose constraint rows may repeat each other.

        Where rows contradict each other, or the drives do not command the freedoms (a singular position), the least-squares
        solution: the acceleration of least size, and the forces nearest to what it needs. For a state that is not finite the
        forces are NaN, which ends the run as blown up.
        """
        seen = self._seen
        if seen is None or seen.plant is not plant:
            seen = self._seen = _Questions(plant)
        jacobian, bias = seen.rows()
        choice = self._choice
        if choice is not None and choice.count == len(jacobian):
            forces = choice.solve(seen, jacobian, bias, accelerations)
            if forces is not None:
                return forces
        if self._failed <= TRIES:
            choice = self._choice = self._choose(jacobian)
            forces = None if choice is None else choice.solve(seen, jacobian, bias, accelerations)
            if forces is not None:
                self._failed = 0
                return forces
            self._choice, self._failed = None, self._failed + 1
        return self._least_squares(seen, jacobian, bias, accelerations)

    def many(self, equations: ManyEquations, accelerations: Array) -> Array:
        """(P, k) forces that give `rows @ a = accelerations` (P, k) at P states at once; NaN where the state is to be solved by itself.

        With the free directions N of `equations`, a = x + N y:    [N^T M N, -(B N)^T; R N, 0] [y; f] = [N^T (push - M x); commands - R x]
        (the first rows and f over the largest element of N^T M N).
        """
        free, forces = equations.free, np.full((len(accelerations), len(self.actuation)), np.nan)
        if free is None:
            return forces
        at = free.directions
        f, k = free.mass.shape[1], len(self.actuation)
        system, right = np.zeros((len(forces), f + k, f + k)), np.empty((len(forces), f + k))
        size = np.abs(free.mass).max(axis=(1, 2), initial=1e-300)[:, None]
        system[:, :f, :f], system[:, :f, f:] = free.mass / size[..., None], -np.swapaxes(self.actuation @ at.free, 1, 2)
        system[:, f:, :f] = self.rows @ at.free
        right[:, :f], right[:, f:] = free.push / size, accelerations - (self.rows @ at.particular)[..., 0]
        try:
            inverse = np.linalg.inv(system)
        except np.linalg.LinAlgError:
            return forces
        good = at.served & (np.abs(system).max(axis=(1, 2)) * np.abs(inverse).max(axis=(1, 2)) < CONDITION)
        forces[good] = (size * (inverse @ right[..., None])[:, f:, 0])[good]
        return forces

    def _choose(self, jacobian: Array) -> _Choice | None:
        """Independent constraint rows, and unit rows for what they and the commanded rows leave free; None where there are none."""
        if not (np.isfinite(jacobian).all() and self.rows.size):
            return None
        taken, clear = independent(jacobian)
        commanded, actuation = self._widened(jacobian)
        if not clear:
            taken, _ = independent(jacobian, structure(self.mechanism).rank + jacobian.shape[1] - self.mechanism.nv)
        stacked = np.vstack([jacobian[taken], commanded])
        if len(stacked) > stacked.shape[1]:
            return None
        triangle, order = pivoted(stacked)
        size = np.abs(triangle.diagonal())
        if not size.min() > RANK * size.max():
            return None  # a command repeats another, or what the constraints fix already
        return _Choice(len(jacobian), taken, commanded, np.sort(order[len(stacked) :]), actuation)

    def _widened(self, jacobian: Array) -> tuple[Array, Array]:
        """R and B for all rates of the constraint rows: they do not act on further ones."""
        more = jacobian.shape[1] - self.mechanism.nv
        return np.pad(self.rows, ((0, 0), (0, more))), np.pad(self.actuation, ((0, 0), (0, more)))

    def _least_squares(self, plant: _Questions, jacobian: Array, bias: Array, accelerations: Array) -> Array:
        count = len(self.actuation)
        if not (np.isfinite(accelerations).all() and np.isfinite(jacobian).all() and np.isfinite(bias).all()):
            return np.full(count, np.nan)
        commanded, actuation = self._widened(jacobian)
        stacked, right = np.vstack([jacobian, commanded]), np.concatenate([-bias, accelerations])
        a = np.linalg.lstsq(stacked, right, rcond=1e-11)[0]
        needed = plant.mass_times(a) + plant.bias()
        if not np.isfinite(needed).all():
            return np.full(count, np.nan)
        solution = np.linalg.lstsq(np.vstack([actuation, jacobian]).T, needed, rcond=1e-11)[0]
        return np.asarray(solution[:count])


class _Questions:
    """What a plant answers: J and b, M x, h."""

    def __init__(self, plant: Plant) -> None:
        self.plant, equations = plant, getattr(plant, "unreduced", None) or plant
        self.bias: Callable[[], Array] = equations.bias
        self.rows: Callable[[], tuple[Array, Array]] = getattr(equations, "constraint_rows", None) or self._rows
        self.mass_times: Callable[[Array], Array] = getattr(equations, "mass_times", None) or self._mass_times

    def _rows(self) -> tuple[Array, Array]:
        return self.plant.jacobian(), self.plant.constraint_bias()

    def _mass_times(self, x: Array) -> Array:
        return self.plant.mass_matrix().dot(x)


class _Choice:
    """Which of `count` constraint rows are taken, and S with its constant rows beside the right sides [0 | 0; 0 | I]; `loose`: e."""

    def __init__(self, count: int, taken: NDArray[np.intp], rows: Array, free: NDArray[np.intp], actuation: Array) -> None:
        k, nv = rows.shape
        m = len(taken)
        self.count, self.m, self.commanded, self.loose = count, m, slice(m, m + k), len(free)
        self.determinants: list[float | None] = [None, None]
        self.taken, self.whole, self.actuation = taken, m == count, actuation
        self.left = np.setdiff1d(np.arange(count), taken)
        self.both = np.zeros((nv, 2 * nv + 1 - m), order="F")
        self.both[self.commanded, :nv] = rows
        self.both[np.arange(m + k, nv), free] = 1.0
        self.both[m:, nv + 1 :] = np.eye(nv - m)

    def solve(self, plant: _Questions, jacobian: Array, bias: Array, commands: Array) -> Array | None:
        """(k,) forces; None where the choice does not fit the state."""
        m, actuation = self.m, self.actuation
        both = self.both.copy("F")  # runs in threads share a law
        nv = len(both)
        if self.whole:
            both[:m, :nv] = jacobian
            np.negative(bias, both[:m, nv])
        else:
            both[:m, :nv] = jacobian.take(self.taken, 0)  # half the time of an index
            np.negative(bias.take(self.taken), both[:m, nv])
        both[self.commanded, nv] = commands
        factors, _, solution, info = dgesv(both[:, :nv], both[:, nv:], overwrite_a=True, overwrite_b=True)
        if info or not self._regular(0, factors):
            return None
        free = solution[:, 1:]
        if not self.whole and not self._agrees(jacobian.take(self.left, 0), bias.take(self.left), solution):
            return None
        system, needed = actuation.dot(free).T, plant.mass_times(solution[:, 0])
        needed += plant.bias()
        if self.loose:
            moved = np.array([plant.mass_times(direction) for direction in free.T[len(actuation) :]])
            system = np.hstack([system, -moved.dot(free).T])
        elif len(system) == 1:  # one drive, mostly
            pivot = system.item()
            return free.T.dot(needed) / pivot if abs(pivot) > 0.0 else None
        factors, _, forces, info = dgesv(system, free.T.dot(needed))
        if info or not self._regular(1, factors):
            return None
        return forces[: len(actuation)] if self.loose else forces

    def _regular(self, which: int, factors: Array) -> bool:
        """Whether no pivot of one of the two factorizations is near zero, now or since the determinant was looked at."""
        pivots = factors.diagonal().tolist()
        determinant, first = math.prod(pivots), self.determinants[which]
        if first is None:
            self.determinants[which] = determinant
        elif abs(determinant) > FALLEN * abs(first):
            return True
        sizes = [abs(x) for x in pivots]
        return min(sizes) > RANK * max(sizes)

    def _agrees(self, rows: Array, bias: Array, solution: Array) -> bool:
        """Whether the rows that were left out are met by the accelerations and held by the free directions."""
        gap = rows.dot(solution)
        gap[:, 0] += bias
        each = gap.ravel()
        if each.dot(each) <= OPEN**2:  # mostly the sum of squares tells
            return True
        size = 1.0 + np.abs(solution).max(axis=0)
        return bool((np.abs(gap).max(axis=0) <= OPEN * size).all())
