"""Many poses closed at once: along straight paths of the given values from a closed pose, in its assembly mode.

Every pose is led from its start to its target by predictor and corrector (Allgower, Georg, Numerical Continuation Methods, 1990,
chapter 2), with a step length of its own: a step counts where the correction after it is a small share of it, which is the test
that Newton's method contracts there and that the path has not been left. A pose that stops on the way, that is not closed to
rounding in all rows, or whose determinant has another sign than that of the start, is handed back as not closed: the robust search
of one pose (`mechlab.mechanism.assembly`, the engines) says why.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import moved
from mechlab.mechanism.many_rows import ManyRows, Placed, between
from mechlab.mechanism.structure import step_size

CLOSED, ROUNDING = 1e-13, 1e-12
"""A pose is closed where no residual [m or rad] is larger; at rounding level, where they no longer fall, below the second number."""
CONTRACTS = 0.25
"""Largest correction after a step, as a share of the step."""
EASY = 0.06
"""Correction, as a share of the step, below which the next step is twice as long."""
FIRST, LONGEST = 0.3, 0.5
"""First step and longest step of a coordinate [rad, or the size of the mechanism]; `follow` has the same limit."""
SHORTEST = 1e-3
"""Share of the way below which a path has ended."""
ROUNDS = 200
POLISH = 6
"""Newton steps at the target."""
CHAIN, APART = 32, 12
"""From so many poses on along one given value, every so-many-th is led there first, and the others start from these."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class ManyClosed:
    """Poses q (n, nq), the Newton inverses there (n, nv, k), which are closed (n,), the largest residual (n,), and of which the
    assembly mode changed on the way (n,), told where rows repeat others only."""

    q: Array
    placed: Placed
    inverse: Array
    closed: Mask
    residual: Array
    turned: Mask

    def at(self, which: Any) -> ManyClosed:
        """The same at some of the poses."""
        more = self.closed[which], self.residual[which], self.turned[which]
        return ManyClosed(self.q[which], self.placed.at(which), self.inverse[which], *more)


def close_many(rows: ManyRows, start: Array, targets: Sequence[Array], count: int = 1) -> ManyClosed:
    """Poses that close all rows and have the targets, from the pose `start` (nq,), or from one (n, nq) for each, in whose modes they are.

    targets: for each name of `rows` values (n,), or rotations (n, 3, 3); without any, `count` poses are closed.
    """
    count = len(targets[0]) if len(targets) else count
    if start.ndim == 2:
        return _kept_modes(rows, start, _follow(rows, start, targets))
    along_one = len(targets) == 1 and targets[0].ndim == 1 and count >= CHAIN
    first = np.tile(start, (count, 1))
    if not along_one:
        return _kept_modes(rows, start, _follow(rows, first, targets))
    order = np.argsort(targets[0], kind="stable")
    knots = order[::APART]
    led = _follow(rows, np.tile(start, (len(knots), 1)), (targets[0][knots],))
    solved = _kept_modes(rows, start, led).closed
    if solved.any():
        values = targets[0][knots[solved]]
        right = np.clip(np.searchsorted(values, targets[0]), 0, len(values) - 1)
        left = np.maximum(right - 1, 0)
        nearest = np.where(np.abs(values[left] - targets[0]) <= np.abs(values[right] - targets[0]), left, right)
        near = led.q[solved][nearest]
        home = float(rows.at(start[None]).values[0][0])
        closer = np.abs(values[nearest] - targets[0]) < np.abs(home - targets[0])
        first = np.where(closer[:, None], near, first)
    return _kept_modes(rows, start, _follow(rows, first, targets))


def _kept_modes(rows: ManyRows, start: Array, found: ManyClosed) -> ManyClosed:
    """The poses, without those whose determinant has another sign than at the start."""
    here = rows.steps.modes(rows.at(np.atleast_2d(start)).rows)
    there = rows.steps.modes(found.placed.rows)
    same = ((here == 0.0) | (there == 0.0) | (here == there)) & ~found.turned
    return ManyClosed(found.q, found.placed, found.inverse, found.closed & same, found.residual, found.turned)


def _follow(rows: ManyRows, start: Array, targets: Sequence[Array]) -> ManyClosed:
    """Each pose of `start` (n, nq), closed, led to its target."""
    m, steps = rows.mechanism, rows.steps
    q = start.copy()
    now = rows.at(q)
    inverse = steps.inverse(now.rows)
    begin = tuple(x.copy() for x in now.values)
    unit = step_size(m)
    with np.errstate(all="ignore"):
        size = _largest(steps.step(inverse, rows.missing(now, targets)))
        ds = np.clip(FIRST * unit / np.maximum(size, 1e-300), SHORTEST, 1.0)
        s, tries, residual = np.zeros(len(q)), np.zeros(len(q), dtype=int), np.full(len(q), np.inf)
        closed, active, other = np.zeros(len(q), dtype=bool), np.isfinite(size), np.zeros(len(q), dtype=bool)
        for _ in range(ROUNDS):
            i: slice | NDArray[np.int_] = np.flatnonzero(active)
            if not active.any():
                break
            if active.all():
                i = slice(None)  # the whole arrays, without copies
            goal = np.minimum(1.0, s[i] + ds[i])
            wanted = between([x[i] for x in begin], [x[i] for x in targets], goal)
            dv = steps.step(inverse[i], rows.missing(now.at(i), wanted))
            trial = moved(m, q[i], dv)
            there = rows.at(trial)
            turned = steps.inverse(there.rows)
            off = rows.missing(there, wanted)
            correction, far, left = _largest(steps.step(turned, off)), _largest(dv), _largest(off)
            good = (correction <= CONTRACTS * far + ROUNDING) & (far <= LONGEST * unit)
            at_goal = good & (goal == 1.0)
            done = at_goal & ((left < CLOSED) | ((left < ROUNDING) & (left > 0.5 * residual[i])))
            tries[i] += at_goal
            residual[i] = np.where(at_goal, left, residual[i])
            ended = ~good & ((s[i] == 1.0) | (0.5 * ds[i] < SHORTEST)) | (tries[i] > POLISH)
            ds[i] = np.where(good, np.where(correction < EASY * far, 2.0, 1.0), 0.5) * ds[i]
            s[i] = np.where(good, goal, s[i])
            if steps.repeats:
                other[i] ^= good & ~steps.same_mode(now.rows[i], there.rows)
            _take(i, good, q, trial, now, there, inverse, turned)
            closed[i] |= done
            active[i] &= ~(done | ended)
    with np.errstate(all="ignore"):  # one more step, without a look: what is left at 1e-13 falls to rounding
        q[closed] = moved(m, q, steps.step(inverse, rows.missing(now, targets)))[closed]
    return ManyClosed(q, now, inverse, closed, residual, other)


def _take(
    which: slice | NDArray[np.int_], good: Mask, q: Array, trial: Array, now: Placed, there: Placed, inverse: Array, turned: Array
) -> None:
    """Take over the accepted poses."""
    if isinstance(which, slice) and good.all():
        q[:], inverse[:] = trial, turned
        now.put(slice(None), there)
        return
    at = np.flatnonzero(good) if isinstance(which, slice) else which[good]
    q[at], inverse[at] = trial[good], turned[good]
    now.put(at, there.at(good))


def _largest(values: Array) -> Array:
    """(n,) largest size in each row of (n, k); NaN stays."""
    return np.max(np.abs(values), axis=1, initial=0.0)
