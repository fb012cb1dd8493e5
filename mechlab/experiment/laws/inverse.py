"""Inverse dynamics under constraints for laws: the forces of drives that give some coordinates the accelerations asked for.

With m independent rows J of the constraints, k commanded rows R and e unit rows E of freedoms that nobody commands, the matrix
S = [J; R; E] is square. One factorisation of it gives the accelerations and the free directions N (nv, k + e):

    S a = [-b; commands; 0],    S N = [0; I]       so that J a = -b, J N = 0

    N^T (M (a + N_e y) + h) = (B N)^T f            k + e equations for the forces f (k,) and the rates' accelerations y (e,)

B rows of the drives. Which rows and unit rows are taken is decided once and kept; rows left out are checked at every state.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr
from scipy.linalg.lapack import dgesv

from mechlab.experiment.laws.protocol import Plant
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

RANK = 1e-9
"""Pivots below this share of the largest are taken for zero; rows of constraints are of size 1 or of a length in m."""
AGREE = 1e-10
"""Relative residual up to which rows that were left out agree with those that were taken: rounding is 1e-13."""
TRIES = 10
"""After so many failures in a row the least-squares solution is taken for the rest of the run."""


class InverseDynamics:
    """Solves M a + h = B^T f + J^T r, J a + b = 0, R a = commands for f, for many states of one mechanism.
    A plant may have `constraint_rows()`, J and b at once, and `mass_times(x)`, M x (nv,) as a new array: then these are called.

    rows (k, nv): R; drives: names of the k joints or shafts of B. Uncommanded freedoms follow their own dynamics.
    """

    def __init__(self, mechanism: Mechanism, rows: Array, drives: tuple[str, ...]) -> None:
        self.rows = np.asarray(rows, dtype=float)
        self.actuation = np.array([mechanism.row(name) for name in drives]).reshape(-1, mechanism.nv)
        self._choice: _Choice | None = None
        self._failed = 0

    def __call__(self, plant: Plant, accelerations: Array) -> Array:
        """(k,) forces that give `rows @ a = accelerations` at the state of the plant, whose constraint rows may repeat each other.

        Where rows contradict each other, or the drives do not command the freedoms (a singular position), the least-squares
        solution: the acceleration of least size, and the forces nearest to what it needs. For a state that is not finite the
        forces are NaN, which ends the run as blown up.
        """
        rows = getattr(plant, "constraint_rows", None)
        jacobian, bias = (plant.jacobian(), plant.constraint_bias()) if rows is None else rows()
        if self._failed <= TRIES:
            for _ in range(2):
                choice = self._choice
                if choice is None or choice.count != len(jacobian):
                    choice = self._choice = _choose(jacobian, self.rows)
                    if choice is None:
                        break
                forces = choice.solve(plant, jacobian, bias, accelerations, self.actuation)
                if forces is not None:
                    self._failed = 0
                    return forces
                self._choice = None  # other rows may do at this state
            self._failed += 1
        return self._least_squares(plant, jacobian, bias, accelerations)

    def _least_squares(self, plant: Plant, jacobian: Array, bias: Array, accelerations: Array) -> Array:
        count = len(self.actuation)
        if not (np.isfinite(accelerations).all() and np.isfinite(jacobian).all() and np.isfinite(bias).all()):
            return np.full(count, np.nan)
        stacked, right = np.vstack([jacobian, self.rows]), np.concatenate([-bias, accelerations])
        a = np.linalg.lstsq(stacked, right, rcond=1e-11)[0]
        needed = plant.mass_matrix() @ a + plant.bias()
        if not np.isfinite(needed).all():
            return np.full(count, np.nan)
        solution = np.linalg.lstsq(np.vstack([self.actuation, jacobian]).T, needed, rcond=1e-11)[0]
        return np.asarray(solution[:count])


class _Choice:
    """Which of `count` constraint rows are taken, and the matrix S with its constant rows; `loose`: e; `size` of its pivots."""

    def __init__(self, count: int, taken: Array, rows: Array, free: Array, size: float) -> None:
        k, nv = rows.shape
        m = len(taken)
        self.count, self.m, self.commanded, self.loose, self.size = count, m, slice(m, m + k), len(free), size
        self.taken, self.whole = taken, m == count
        self.left = np.setdiff1d(np.arange(count), taken)
        self.matrix = np.zeros((nv, nv), order="F")
        self.matrix[self.commanded] = rows
        self.matrix[np.arange(m + k, nv), free] = 1.0
        self.right = np.zeros((nv, 1 + nv - m), order="F")
        self.right[m:, 1:] = np.eye(nv - m)

    def solve(self, plant: Plant, jacobian: Array, bias: Array, commands: Array, actuation: Array) -> Array | None:
        """(k,) forces; None where the choice does not fit the state."""
        m, matrix, right = (
            self.m,
            self.matrix.copy(order="F"),
            self.right.copy(order="F"),
        )  # runs in threads share a law
        if self.whole:
            matrix[:m] = jacobian
            np.negative(bias, right[:m, 0])
        else:
            matrix[:m] = jacobian[self.taken]
            np.negative(bias[self.taken], right[:m, 0])
        right[self.commanded, 0] = commands
        factors, _, solution, info = dgesv(matrix, right, overwrite_a=True, overwrite_b=True)
        if info or not min(map(abs, factors.diagonal().tolist())) > RANK * self.size:
            return None
        a, free = solution[:, 0], solution[:, 1:]
        if not self.whole and not self._agrees(jacobian[self.left], bias[self.left], solution):
            return None
        k, system, times = (
            len(actuation),
            actuation.dot(free).T,
            getattr(plant, "mass_times", None) or plant.mass_matrix().dot,
        )
        needed = times(a)
        needed += plant.bias()
        if self.loose:
            moved = np.array([times(direction) for direction in free.T[k:]])
            system = np.hstack([system, -moved.dot(free).T])
        factors, _, forces, info = dgesv(system, free.T.dot(needed))
        pivots = [abs(x) for x in factors.diagonal().tolist()]
        if info or not min(pivots) > RANK * max(pivots):
            return None
        return forces if len(forces) == k else forces[:k]

    def _agrees(self, rows: Array, bias: Array, solution: Array) -> bool:
        """Whether the rows that were left out are met by the accelerations and held by the free directions."""
        gap = rows.dot(solution)
        gap[:, 0] += bias
        size = 1.0 + np.abs(solution).max(axis=0)
        return bool((np.abs(gap).max(axis=0) <= AGREE * size).all())


def _choose(jacobian: Array, rows: Array) -> _Choice | None:
    """Independent constraint rows, and unit rows for what they and the commanded rows leave free; None where there are none."""
    if not (np.isfinite(jacobian).all() and rows.size):
        return None
    taken = np.zeros(0, dtype=int)
    if len(jacobian):
        triangle, order = qr(jacobian.T, mode="r", pivoting=True)
        size = np.abs(triangle.diagonal())
        taken = np.sort(order[: int(np.sum(size > RANK * size.max(initial=1e-300)))])
    stacked = np.vstack([jacobian[taken], rows])
    if len(stacked) > stacked.shape[1]:
        return None
    triangle, order = qr(stacked, mode="r", pivoting=True)
    size = np.abs(triangle.diagonal())
    if not size.min() > RANK * size.max():
        return None  # a command repeats another, or what the constraints fix already
    return _Choice(len(jacobian), taken, rows, np.sort(order[len(stacked) :]), float(size.max()))
