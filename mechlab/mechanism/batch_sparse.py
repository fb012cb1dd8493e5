"""Closures of large mechanisms at many poses at once, sparse: rows that know their columns.

A loop moves only the joints between its ends. In a row of N four-bars that are 3 of 2 N + 1, whatever N is; dense normal equations
cost the cube of N, least squares by elimination (`sparse_squares`) its first power.
"""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.batch_tree import CACHED, BatchRows, BatchTree, crossed
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.sparse_squares import LARGE, Indices, SparseLeastSquares

VOID = 1e-14
"""Size of a row at a generic pose below which it is rounding."""


class SparseRows:
    """Residual and Jacobian of all loops, relations and curves at many poses as the entries that can differ from zero; rows as in
    `BatchRows.system`, poses as the last index.

    row, column (nnz,): where the entries of `at(q)` stand.
    """

    def __init__(self, rows: BatchRows) -> None:
        self.rows, self.tree = rows, rows.tree
        self.count = rows.count
        loops, rods = _columns(rows.between), _columns(rows.rod_between)
        self._loops, self._rods = loops, rods
        self._sign, self._rod_sign = (_taken(s, c) for s, c in ((rows.between, loops), (rows.rod_between, rods)))
        linked, self._relations = np.nonzero(rows.relations)
        self._coefficients = rows.relations[linked, self._relations]
        offsets, angles, ends = rows.offsets[0], rows.angles[0], np.arange(len(rods))
        parts = [
            (loops[offsets], self._sign[offsets]),
            (loops[angles], self._sign[angles]),
            (rods[ends], self._rod_sign[ends]),
        ]
        first, self._kept, row, column = 0, [], [], []
        for columns, sign in parts:
            kept = np.nonzero(sign)
            self._kept.append(kept)
            row.append(first + kept[0])
            column.append(columns[kept])
            first += len(columns)
        coupled = rows.curve_ends
        curved = first + len(rows.relations) + np.arange(len(coupled))
        self.row: Indices = np.concatenate([*row, first + linked, curved, curved])
        self.column: Indices = np.concatenate([*column, self._relations, coupled[:, 0], coupled[:, 1]])

    def at(self, q: Array) -> tuple[Array, Array]:
        """Entries (nnz, P) of the Jacobian and residual (rows, P) at q (P, nv)."""
        rows, tree = self.rows, self.tree
        poses = tree.at(q)
        linear, angular = tree.screws(poses)
        values, residual = [], []
        if len(rows.a[0]):
            pa, ra, pb, rb = rows.ends(poses)
            back = np.swapaxes(ra, 2, 3)
            turns = angular[self._loops]
            moves = linear[self._loops] - crossed(pb[:, None], turns)
            i, k = rows.offsets
            found = np.einsum("gpx,gcpx->gcp", back[i, :, k], moves[i]) * self._sign[i][..., None]
            values.append(found[self._kept[0]])
            residual.append(np.einsum("gpx,gpx->gp", back[i, :, k], (pb - pa)[i]))
            i, j, k = rows.angles
            u, w = back[i, :, j], rb[i, :, :, k]
            found = np.einsum("gpx,gcpx->gcp", crossed(w, u), turns[i]) * self._sign[i][..., None]
            values.append(found[self._kept[1]])
            residual.append(np.einsum("gpx,gpx->gp", u, w))
        if len(rows.lengths):
            pa, pb = tree.positions(poses, rows.rod_a), tree.positions(poses, rows.rod_b)
            d, lengths = pb - pa, rows.lengths[:, None]
            moves = linear[self._rods] - crossed(pb[:, None], angular[self._rods])
            found = np.einsum("gpx,gcpx->gcp", d / lengths[..., None], moves) * self._rod_sign[..., None]
            values.append(found[self._kept[2]])
            residual.append(0.5 * (np.sum(d * d, axis=2) / lengths - lengths))
        if len(rows.relations):
            values.append(np.repeat(self._coefficients[:, None], len(q), axis=1))
            residual.append(rows.relations @ q.T)
        if rows.curves:
            value, slope, _ = rows.laws(q)
            values += [np.ones(slope.T.shape), -slope.T]
            residual.append(value.T)
        if not values:
            return np.zeros((0, len(q))), np.zeros((0, len(q)))
        return np.concatenate(values), np.concatenate(residual)


def _columns(between: Array) -> Indices:
    """(k, c) columns of each loop, from what is +1, -1 or 0 (k, 1, 1, n); filled up with columns that it does not move."""
    signs = between.reshape(len(between), between.shape[-1]) != 0.0
    most = int(signs.sum(axis=1).max(initial=0))
    return np.argsort(~signs, axis=1, kind="stable")[:, :most]


def _taken(between: Array, columns: Indices) -> Array:
    """(k, c) the signs at those columns."""
    return np.take_along_axis(between.reshape(len(between), between.shape[-1]), columns, axis=1)


class SparseClosing:
    """The Newton step of closing many poses while one coordinate is given; raises ValueError where dense equations are cheaper."""

    def __init__(self, rows: BatchRows, coordinate: int) -> None:
        if rows.tree.ground - 1 <= LARGE:
            raise ValueError("a small mechanism")
        self._rows = SparseRows(rows)
        others = np.flatnonzero(np.arange(rows.tree.ground) != coordinate)
        place = np.full(rows.tree.ground, -1)
        place[others] = np.arange(len(others))
        columns = place[self._rows.column]
        self._known = np.flatnonzero(columns >= 0)
        self._given = np.flatnonzero(columns < 0)
        self.equations = SparseLeastSquares(self._rows.row[self._known], columns[self._known], len(others))
        if not self.equations.pays:
            raise ValueError("a mechanism whose loops meet most of its joints")

    def solve(self, q: Array) -> tuple[Array, float]:
        """(P, n, 2) what to subtract from the other coordinates to close, and minus their rates for the rate 1 of the given one;
        and the largest change by the step of refinement. Raises LinAlgError for a singular pose."""
        size = max(1, CACHED // (self.equations.n + 1))
        parts = [self._some(q[k : k + size]) for k in range(0, max(len(q), 1), size)]
        return np.concatenate([found for found, _ in parts]), max(change for _, change in parts)

    def _some(self, q: Array) -> tuple[Array, float]:
        values, residual = self._rows.at(q)
        sides = np.zeros((self._rows.count, 2, len(q)))
        sides[:, 0] = residual
        sides[self._rows.row[self._given], 1] = values[self._given]
        found, change = self.equations.solve(values[self._known], sides)
        return found.transpose(2, 0, 1), change


def smallest_of_rows(matrices: Array) -> Array | None:
    """(P,) smallest singular value over the rows of matrices (P, m, n) that are not zero in all of them, m of them in full rank; None
    where it costs less to compute it densely, and where rows repeat each other."""
    count, m, n = matrices.shape
    if min(m, n) <= LARGE:
        return None
    pattern = np.any(matrices != 0.0, axis=0)
    rows, columns = np.nonzero(pattern[pattern.any(axis=1)])
    values = matrices[:, pattern].T
    equations = SparseLeastSquares(columns, rows, int(rows.max(initial=-1)) + 1)
    if not equations.pays or equations.n > n:
        return None
    try:
        return equations.smallest(values)
    except np.linalg.LinAlgError:
        return None


def smallest_of_closures(mechanism: Mechanism, generic: Array, poses: Array, rank: int) -> Array | None:
    """(P,) smallest singular value of the rows of all loops and relations at poses (P, nq), each row by its size at a generic pose
    (nq,); None where it costs less to compute it densely, and where more rows are there than their rank."""
    if mechanism.nv <= LARGE or any(j.nv != 1 for j in mechanism.joints):
        return None
    rows = SparseRows(BatchRows(BatchTree(mechanism)))
    values, _ = rows.at(generic[None])
    sizes = np.sqrt(np.bincount(rows.row, values[:, 0] ** 2, rows.count))
    there = sizes > VOID
    if np.count_nonzero(there) != rank:
        return None
    kept = np.flatnonzero(there[rows.row])
    number = np.cumsum(there) - 1
    equations = SparseLeastSquares(rows.column[kept], number[rows.row[kept]], rank)
    if not equations.pays:
        return None
    values, _ = rows.at(poses)
    try:
        return equations.smallest(values[kept] / sizes[rows.row[kept], None])
    except np.linalg.LinAlgError:
        return None
