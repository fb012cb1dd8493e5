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
FEWEST, MOST = 4, 8
"""Poses that a polynomial is led through: a cubic at least; beyond 8, rounding grows more than the polynomial gains."""
EVEN = 0.1
"""Share of the step by which extrapolated given values may miss the targets."""
CHORD = 1e-5
"""Largest correction after which the inverse of the pose before it still serves: it is off by as much, and so is the last step, which
is below 1e-12."""
FAR, PARTS = 100.0, 2.0
"""Longest way that is led in parts, as a multiple of the longest step, and the parts to each such step."""


def length(values: Array) -> float:
    """Euclidean length of all numbers, no less than the largest of them, in the fewest calls; NaN stays."""
    flat = values if values.ndim == 1 else values.ravel()
    return math.sqrt(flat.dot(flat))


def _extrapolations() -> Array:
    """[count, last] (MOST,) weights of kept poses, the last one in place `last` and older ones in the places before it, around the end:
    their sum is one even step further on the polynomial through the last `count` of them."""
    out = np.zeros((MOST + 1, MOST, MOST))
    for count in range(1, MOST + 1):
        for last in range(MOST):
            for back in range(count):
                out[count, last, last - back] = (-1) ** back * math.comb(count, back + 1)
    return out


EVENLY = _extrapolations()


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
        self._kept: tuple[Array, Any, Array] | None = None
        self._rows: Array | None = None
        self._past, self._known, self._last = np.zeros((MOST, 0)), 0, 0
        self._plain, self._mode = False, 0.0

    def put(self, q: Array, values: Sequence[Any]) -> None:
        """Keep the closed pose q (nq,), whose named quantities have the values."""
        x = self.equations.start(np.asarray(q, dtype=float))
        rows = self.equations.evaluate(x, values)[1]
        # the last poses and their given values are kept where all are numbers
        self._plain = len(x) == rows.shape[1] and not any(np.ndim(t) for t in values)
        self._kept = (x, np.array(values) if self._plain else tuple(values), self._steps.inverse_of_one(rows))
        self._past, self._known = np.zeros((MOST, len(x) + len(values) if self._plain else 0)), 0
        self._rows = rows
        self._mode = float(self._steps.modes(rows))

    def lead(self, targets: Sequence[Any]) -> Assembly | None:
        """The pose that has the targets, which is then kept; None where anything is unusual. A long way is led in parts, along straight
        lines of the given values."""
        if self._kept is None:
            return None
        wanted = np.array(targets) if self._plain else targets
        ahead, far = self._predicted(wanted)
        way = far / self._longest
        if way <= 1.0:
            return self._closed(wanted, ahead, far)
        if not (way <= FAR and self._plain):
            return None
        kept, rows, count = self._kept, self._rows, math.ceil(PARTS * way)
        between = kept[1] + np.linspace(0.0, 1.0, count + 1)[1:-1, None] * (wanted - kept[1])
        for part in (*between, wanted):
            ahead, far = self._predicted(part)
            found = self._closed(part, ahead, far) if far <= self._longest else None
            if found is None:
                self._kept, self._rows, self._known = kept, rows, 0
                return None
        return found

    def _closed(self, targets: Any, x: Array, before: float) -> Assembly | None:
        """Newton's method for the targets from x, which is so far from the kept pose."""
        assert self._kept is not None
        inverse = self._kept[2]
        equations, steps, size, rows = self.equations, self._steps, np.inf, None
        for k in range(1, POLISH):
            near = rows is not None and before <= CHORD
            residual = equations.residual(x, targets) if near else None
            if residual is None or not length(residual) < ROUNDING:
                residual, rows = equations.evaluate(x, targets)
                inverse = steps.inverse_of_one(rows) if len(residual) == steps.count else inverse
            if rows is None or len(residual) != steps.count:
                return None
            last, size = size, length(residual)
            if size < EXACT:
                return self._taken(x, targets, rows, inverse, size, k)
            dv = -inverse.dot(residual)
            correction = length(dv)
            if not correction <= CONTRACTS * before + ROUNDING:
                return None
            x, before = equations.step(x, dv), correction
            if size < CLOSED or (size < ROUNDING and size > 0.5 * last):
                return self._taken(x, targets, rows, inverse, size, k)
        return None

    def _taken(self, x: Array, targets: Any, rows: Array, inverse: Array, size: float, k: int) -> Assembly | None:
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
        if self._plain:
            self._known, self._last = min(self._known + 1, MOST), (self._last + 1) % MOST
            past = self._past[self._last]
            past[: len(x)], past[len(x) :] = x, targets
        return Assembly(self.equations.coordinates(x), size, k, Status.SOLVED)

    def _predicted(self, targets: Any) -> tuple[Array, float]:
        """A place near the pose that has the targets, and how far it is from the kept pose: where the path goes on evenly, on the
        polynomial through the last poses, with what the given values lack there put right along the tangent; else on the tangent."""
        assert self._kept is not None
        x, values, inverse = self._kept
        if not self._plain:
            dv = -inverse.dot(self.equations.evaluate(x, targets)[0])
            return self.equations.step(x, dv), length(dv)
        tangent, off = inverse[:, inverse.shape[1] - len(targets) :], targets - values
        if self._known >= FEWEST:
            there = EVENLY[self._known, self._last].dot(self._past)
            missing = targets - there[len(x) :]
            if length(missing) <= EVEN * length(off):
                ahead = there[: len(x)] + tangent.dot(missing)
                return ahead, length(ahead - x)
            self._known = FEWEST - 1  # the path bends: the polynomial begins anew
        dv = tangent.dot(off)
        return self.equations.step(x, dv), length(dv)
