"""One pose after the other, each closed from the last one: what depends only on the structure is kept, and nothing is searched.

The pose is led by the tangent at the last pose, then by Newton's method with the exact Jacobian. It is taken only where every
correction is a small share of the step before it, all rows close to rounding, no mode was left (sign of the determinant) and no
singular position is near. Everything else is refused, and left to the robust search, which says what is the matter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from mechlab.mechanism.closing import CLOSED, CONTRACTS, LONGEST, POLISH, ROUNDING
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import moved
from mechlab.mechanism.many_rows import ManyRows, NewtonSteps
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, Status
from mechlab.mechanism.structure import step_size

REGULAR = 1e4
"""Largest entry of the inverse of the Newton equations that counts as far from a singular position."""


EXACT = 1e-15
"""Residual [m or rad] that no Newton step makes smaller."""
CUBIC = np.array([4.0, -6.0, 4.0, -1.0])
"""Extrapolation by one even step of the cubic through four values, the last one first."""
EVEN = 0.1
"""Share of the step by which extrapolated given values may miss the targets."""
CHORD = 1e-5
"""Largest correction after which the inverse of the pose before it still serves: it is off by as much, and so is the last step, which
is below 1e-12."""
FAR, PARTS = 100.0, 2.0
"""Longest way that is led in parts, as a multiple of the longest step, and the parts to each such step."""


def length(values: Array) -> float:
    """Euclidean length of all numbers, no less than the largest of them, in the fewest calls; NaN stays."""
    flat = values.reshape(-1)
    return math.sqrt(float(flat @ flat))


def largest(values: Array) -> float:
    """Largest size of the numbers; 0 without any; NaN stays."""
    return float(np.abs(values).max()) if values.size else 0.0


class PoseEquations(Protocol):
    """Closing equations with named quantities that an engine keeps, in coordinates x of its own."""

    mechanism: Mechanism
    names: tuple[str, ...]

    def start(self, q: Array) -> Array:
        """The engine's coordinates of a pose q (nq,)."""
        ...

    def coordinates(self, x: Array) -> Array:
        """(nq,) of the mechanism."""
        ...

    def evaluate(self, q: Array, targets: Sequence[Any]) -> tuple[Array, Array]:
        """(m,) residual of closure and targets, in the order of the names, and (m, n) Jacobian."""
        ...

    def residual(self, q: Array, targets: Sequence[Any]) -> Array:
        """(m,) the residual alone."""
        ...

    def step(self, q: Array, dv: Array) -> Array:
        """x moved by dv (n,)."""
        ...

    @property
    def newton_steps(self) -> NewtonSteps:
        """The steps for these rows; made once."""
        ...


class TreeEquations:
    """The equations by numpy alone."""

    def __init__(self, rows: ManyRows) -> None:
        self.rows, self.mechanism, self.names = rows, rows.mechanism, rows.names

    def start(self, q: Array) -> Array:
        """q itself."""
        return q

    coordinates = start

    def evaluate(self, q: Array, targets: Sequence[Any]) -> tuple[Array, Array]:
        """(m,) residual and (m, nv) Jacobian."""
        return self.rows.one(q, targets)

    def residual(self, q: Array, targets: Sequence[Any]) -> Array:
        """(m,) the residual alone: a third of the calls."""
        return self.rows.residual_of_one(q, targets)

    def step(self, q: Array, dv: Array) -> Array:
        """q moved by dv (nv,)."""
        return q + dv if self.mechanism.nq == self.mechanism.nv else moved(self.mechanism, q[None], dv[None])[0]

    @property
    def newton_steps(self) -> NewtonSteps:
        """The steps of the rows."""
        return self.rows.steps


class WarmStart:
    """Keeps a closed pose and leads it to given values."""

    def __init__(self, equations: PoseEquations) -> None:
        self.equations = equations
        self._steps = equations.newton_steps
        self._longest = LONGEST * step_size(equations.mechanism)
        self._flat = equations.mechanism.nq == equations.mechanism.nv
        self._kept: tuple[Array, tuple[Any, ...], Array] | None = None
        self._rows: Array | None = None
        self._past, self._known = np.empty((len(CUBIC), 0)), 0
        self._mode = 0.0

    def put(self, q: Array, values: Sequence[Any]) -> None:
        """Keep the closed pose q (nq,), whose named quantities have the values."""
        x = self.equations.start(np.asarray(q, dtype=float))
        rows = self.equations.evaluate(x, values)[1]
        self._kept = (x, tuple(values), self._steps.inverse(rows))
        # the last poses and their given values, where all are numbers
        plain = self._flat and not any(np.ndim(t) for t in values)
        self._past, self._known = np.empty((len(CUBIC), len(x) + len(values) if plain else 0)), 0
        self._rows = rows
        self._mode = float(self._steps.modes(rows))

    def lead(self, targets: Sequence[Any]) -> Assembly | None:
        """The pose that has the targets, which is then kept; None where anything is unusual. A long way is led in parts, along straight
        lines of the given values."""
        if self._kept is None:
            return None
        x, values, inverse = self._kept
        dv, ahead = self._predicted(x, values, inverse, targets)
        way = length(dv) / self._longest
        if way <= 1.0:
            return self._closed(targets, dv, ahead)
        if not (way <= FAR and self._past.size):
            return None
        begin, rows, count = np.array(values), self._rows, math.ceil(PARTS * way)
        between = begin + np.linspace(0.0, 1.0, count + 1)[1:-1, None] * (np.array(targets) - begin)
        for part in (*between.tolist(), targets):
            assert self._kept is not None
            dv, ahead = self._predicted(*self._kept, part)
            found = self._closed(part, dv, ahead) if length(dv) <= self._longest else None
            if found is None:
                self._kept, self._rows, self._known = (x, values, inverse), rows, 0
                return None
        return found

    def _closed(self, targets: Sequence[Any], dv: Array, ahead: Array | None) -> Assembly | None:
        """Newton's method for the targets, from the kept pose moved by dv, or from `ahead`."""
        assert self._kept is not None
        x, _, inverse = self._kept
        equations, steps, before = self.equations, self._steps, length(dv)
        x, size, rows = equations.step(x, dv) if ahead is None else ahead, np.inf, None
        for k in range(1, POLISH):
            near = rows is not None and before <= CHORD
            residual = equations.residual(x, targets) if near else None
            if residual is None or not length(residual) < ROUNDING:
                residual, rows = equations.evaluate(x, targets)
                inverse = steps.inverse(rows) if len(residual) == steps.count else inverse
            if rows is None or len(residual) != steps.count:
                return None
            last, size = size, length(residual)
            if size < EXACT:
                return self._taken(x, tuple(targets), rows, inverse, size, k)
            dv = steps.step(inverse, residual)
            correction = length(dv)
            if not correction <= CONTRACTS * before + ROUNDING:
                return None
            x, before = equations.step(x, dv), correction
            if size < CLOSED or (size < ROUNDING and size > 0.5 * last):
                return self._taken(x, tuple(targets), rows, inverse, size, k)
        return None

    def _taken(self, x: Array, targets: tuple[Any, ...], rows: Array, inverse: Array, size: float, k: int) -> Assembly | None:
        if not length(inverse) < REGULAR:
            return None
        assert self._kept is not None
        if self._mode and not self._steps.stays(self._kept[2], rows) and self._mode * float(self._steps.modes(rows)) <= 0.0:
            return None
        if self._steps.repeats:
            if self._rows is not None and not self._steps.same_mode(self._rows, rows):
                return None
            self._rows = rows
        self._kept = (x, targets, inverse)
        if self._past.size:
            self._past[1:] = self._past[:-1]
            self._past[0, : len(x)], self._past[0, len(x) :] = x, targets
            self._known += 1
        return Assembly(self.equations.coordinates(x), size, k, Status.SOLVED)

    def _predicted(
        self, x: Array, values: tuple[Any, ...], inverse: Array, targets: Sequence[Any]
    ) -> tuple[Array, Array | None]:
        """The step from the kept pose along its tangent; and where the path goes on evenly, the place that a cubic through the last
        poses predicts, with what the given values lack there put right along the tangent."""
        off = self._off(x, values, targets)
        if self._known >= len(CUBIC):
            there = CUBIC @ self._past
            missing = there[len(x) :] - targets
            if length(missing) <= EVEN * length(off):
                off[len(off) - len(missing) :] = missing
                ahead = there[: len(x)] + self._steps.step(inverse, off)
                return ahead - x, ahead
        return self._steps.step(inverse, off), None

    def _off(self, x: Array, values: tuple[Any, ...], targets: Sequence[Any]) -> Array:
        """(m,) residual at the kept pose with new targets; it needs no look at the pose where all of them are numbers."""
        if not self._past.size and any(np.ndim(t) for t in targets):
            return self.equations.evaluate(x, targets)[0]
        out = np.zeros(self._steps.count)
        out[len(out) - len(targets) :] = np.subtract(values, targets)
        return out
