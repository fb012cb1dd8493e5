"""Least squares with one sparse pattern at many poses: the elimination (which column after which) is planned once; every step of it
is then one numpy call over all columns that do not meet each other and over all poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

LARGE = 60
"""Joints up to which dense equations are as fast; below it numbers do not change by a bit."""
FEWER = 50
"""A product of the elimination costs as much as this many of the dense equations."""
LANCZOS = 20
"""Steps to a smallest singular value."""

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class _Round:
    """Columns (k,) that are eliminated together, as none meets another, and what their elimination touches.

    below: for each entry of the factor below the diagonal its place among all entries; of: which of the columns it is in (k,
    local); row: its row. left, right: pairs of such entries (local), sorted by what they change; first: where a new target begins;
    target: the places of those.
    """

    columns: Indices
    diagonal: Indices
    below: Indices
    of: Indices
    row: Indices
    left: Indices
    right: Indices
    first: Indices
    target: Indices


class SparseLeastSquares:
    """Least squares A x = b at many poses for one pattern of A (m, n), by the normal equations and one step of refinement.

    rows, columns (nnz,): the pattern; work: products of an elimination.
    """

    def __init__(self, rows: Indices, columns: Indices, count: int) -> None:
        self.n = count
        order = np.argsort(rows, kind="stable")
        self._rows, self._columns = rows, columns
        ends = np.flatnonzero(np.diff(rows[order], prepend=-1, append=rows.max(initial=0) + 1))
        in_rows = [order[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)]
        meets: list[set[int]] = [set() for _ in range(count)]
        for entries in in_rows:
            own = columns[entries].tolist()
            for c in own:
                meets[c].update(own)
        rounds, self.work, places = _plan(meets)
        self._rounds, self._size = rounds, len(places)
        pairs = [(e, f) for entries in in_rows for e in entries.tolist() for f in entries.tolist()]
        wanted = np.array([places.get((int(columns[e]), int(columns[f])), -1) for e, f in pairs], dtype=np.intp)
        self._left, self._right, self._first, self._target = _by_target(
            np.array([e for e, _ in pairs], dtype=np.intp), np.array([f for _, f in pairs], dtype=np.intp), wanted
        )
        self._by_column = _by_target(np.arange(len(columns)), rows, columns)
        self._by_row = _by_target(np.arange(len(rows)), columns, rows)

    @property
    def pays(self) -> bool:
        """Whether it is cheaper than dense normal equations."""
        return self.n > LARGE and FEWER * self.work < self.n**3

    def solve(self, values: Array, sides: Array) -> tuple[Array, float]:
        """(n, k, P) solutions for entries (nnz, P) and sides (m, k, P), and the largest change by the step of refinement.

        Raises LinAlgError where a column is zero or repeats others to rounding.
        """
        factor = self._factor(values)
        found = self._substitute(factor, self._across(values, sides))
        change = self._substitute(factor, self._across(values, sides - self._times(values, found, len(sides))))
        return found + change, max(change.max(), -change.min())

    def smallest(self, values: Array) -> Array:
        """(P,) smallest singular value of A, by Lanczos steps with the inverse of A^T A from a random start: a little too large, by
        more than a half with a probability below 1e-10 (Kuczynski & Wozniakowski 1992). Raises as `solve`."""
        factor, poses = self._factor(values), values.shape[1]
        steps = min(LANCZOS, self.n)
        x = np.random.default_rng(11).standard_normal((self.n, 1, poses))
        x /= np.linalg.norm(x, axis=0)
        basis = np.empty((self.n, steps, poses))
        found = np.zeros((poses, steps, steps))
        for k in range(steps):
            basis[:, k] = x[:, 0]
            x = self._substitute(factor, x.copy())
            for _ in range(2):  # twice is enough against rounding
                along = np.einsum("nkp,np->kp", basis[:, : k + 1], x[:, 0])
                x[:, 0] -= np.einsum("nkp,kp->np", basis[:, : k + 1], along)
                found[:, : k + 1, k] += along.T
            size = np.linalg.norm(x, axis=0)
            x /= np.where(size > 0.0, size, 1.0)
            if k + 1 < steps:
                found[:, k + 1, k] = size[0]
        found = np.tril(found) + np.swapaxes(np.tril(found, -1), 1, 2)
        return np.asarray(1.0 / np.sqrt(np.linalg.eigvalsh(found)[:, -1]))

    def _factor(self, values: Array) -> Array:
        """L and D of A^T A = L D L^T in the places of the plan."""
        x = np.zeros((self._size, values.shape[1]))
        x[self._target] = np.add.reduceat(values[self._left] * values[self._right], self._first, axis=0)
        for r in self._rounds:
            pivots = x[r.diagonal]
            if not pivots.min() > 0.0:
                raise np.linalg.LinAlgError("singular matrix")
            if not len(r.below):
                continue
            whole = x[r.below]
            x[r.below] = scaled = whole / pivots[r.of]
            x[r.target] -= np.add.reduceat(scaled[r.left] * whole[r.right], r.first, axis=0)
        return x

    def _substitute(self, factor: Array, y: Array) -> Array:
        """The solution (n, k, P) of L D L^T x = y; y is used up."""
        for r in self._rounds:
            if len(r.below):
                np.subtract.at(y, r.row, factor[r.below][:, None] * y[r.columns[r.of]])
        for r in reversed(self._rounds):
            y[r.columns] /= factor[r.diagonal][:, None]
            if len(r.below):
                np.subtract.at(y, r.columns[r.of], factor[r.below][:, None] * y[r.row])
        return y

    def _across(self, values: Array, sides: Array) -> Array:
        """A^T sides: (n, k, P)."""
        out = np.zeros((self.n, *sides.shape[1:]))
        entries, rows, first, target = self._by_column
        out[target] = np.add.reduceat(values[entries][:, None] * sides[rows], first, axis=0)
        return out

    def _times(self, values: Array, x: Array, count: int) -> Array:
        """A x: (m, k, P)."""
        out = np.zeros((count, *x.shape[1:]))
        entries, columns, first, target = self._by_row
        out[target] = np.add.reduceat(values[entries][:, None] * x[columns], first, axis=0)
        return out


def _plan(meets: list[set[int]]) -> tuple[list[_Round], int, dict[tuple[int, int], int]]:
    """Rounds of elimination of a symmetric matrix whose columns meet others (and themselves), the number of products, and the
    places of its entries (row, column), the later eliminated one first, by either order for those that a round asks for.

    Each round takes columns of few others that do not meet each other (a multiple minimum degree).
    """
    around = [set(x) - {k} for k, x in enumerate(meets)]
    left = set(range(len(meets)))
    places: dict[tuple[int, int], int] = {}

    def place(i: int, j: int) -> int:
        return places.setdefault((i, j), len(places))

    done: list[tuple[list[int], list[list[int]]]] = []
    work = 0
    while left:
        least = min(len(around[k]) for k in left)
        chosen: list[int] = []
        blocked: set[int] = set()
        for k in sorted((k for k in left if len(around[k]) <= least + 1), key=lambda k: (len(around[k]), k)):
            if k not in blocked:
                chosen.append(k)
                blocked |= around[k]
        belows = [sorted(around[k]) for k in chosen]
        for k, others in zip(chosen, belows, strict=True):
            work += len(others) ** 2 + len(others) + 1
            for i in others:
                around[i].discard(k)
                around[i].update(x for x in others if x != i)
        left.difference_update(chosen)
        done.append((chosen, belows))
    turn = {k: t for t, (chosen, _) in enumerate(done) for k in chosen}
    rounds = []
    for chosen, belows in done:
        below, of, row, left_, right, target = (list[int]() for _ in range(6))
        for c, (k, others) in enumerate(zip(chosen, belows, strict=True)):
            start = len(below)
            for i in others:
                below.append(place(i, k))
                of.append(c)
                row.append(i)
            for a, i in enumerate(others):
                for b, j in enumerate(others):
                    # each pair once: the entry stands below the diagonal of the one that is eliminated first
                    if (turn[i], i) >= (turn[j], j):
                        left_.append(start + a)
                        right.append(start + b)
                        target.append(place(i, j))
        diagonal = [place(k, k) for k in chosen]
        own = [np.array(x, dtype=np.intp) for x in (chosen, diagonal, below, of, row)]
        pairs = _by_target(*(np.array(x, dtype=np.intp) for x in (left_, right, target)))
        rounds.append(_Round(own[0], own[1], own[2], own[3], own[4], *pairs))
    return rounds, work, places


def _by_target(left: Indices, right: Indices, target: Indices) -> tuple[Indices, Indices, Indices, Indices]:
    """Pairs sorted by their target, those without one (-1) left out; where each new target begins, and the targets."""
    kept = np.flatnonzero(target >= 0)
    order = kept[np.argsort(target[kept], kind="stable")]
    found, first = np.unique(target[order], return_index=True)
    return left[order], right[order], first.astype(np.intp), found.astype(np.intp)
