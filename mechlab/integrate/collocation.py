"""Integration by collocation at Radau points: stiff or smooth problems to 1e-12 in a tenth of the steps of lower orders.

A step of size h from (t, y) takes the polynomial whose slope is that of the equation at the s points c_i:

    Y_i = y + h sum_j A_ij f(t + c_j h, Y_j),    A_ij = integral of the j-th Lagrange polynomial from 0 to c_i

with c_s = 1. Its order is 2 s - 1 and it damps fast modes completely (Hairer & Wanner, Solving Ordinary Differential Equations II,
section IV.5). The right-hand side is asked for all points at once. The step size keeps the last Legendre coefficient of the slope,
which bounds the error of the polynomial between the points, at the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.integrate.adaptive import IntegrationStatus, Trajectory
from mechlab.integrate.work import ADAPTIVE_STAGE, count_work
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
Slopes = Callable[[Array, Array], Array]
"""f(t (k,), y (k, m)) -> dy/dt (k, m)."""

POINTS = 9
MOST_ITERATIONS, SOLVED = 14, 1e-2
"""Newton's steps at most, and the share of the tolerance at which they end."""
SHRINK, GROW, SAFETY = 0.2, 4.0, 0.8
"""Limits of the change of the step size, and the share of the size that the estimate allows."""
SHORTEST = 1e-14
"""Shortest step, as a share of the span."""


@dataclass(frozen=True, eq=False)
class RadauPoints:
    """The points c (s,), the matrix A (s, s), and the map (s, s) from Y - y to the Legendre coefficients of the slope times h."""

    nodes: Array
    integrals: Array
    coefficients: Array


@cache
def radau_points(count: int) -> RadauPoints:
    """Radau points on (0, 1], the last one 1: roots of P_s - P_(s-1), with P_k the Legendre polynomials on [0, 1]."""
    roots = legendre.legroots([0.0] * (count - 1) + [-1.0, 1.0])
    nodes = 0.5 * (np.sort(roots.real) + 1.0)
    nodes[-1] = 1.0
    of_coefficients = _integrals(nodes, count)
    to_coefficients = np.linalg.inv(legendre.legvander(2.0 * nodes - 1.0, count - 1))
    return RadauPoints(nodes, of_coefficients @ to_coefficients, np.asarray(np.linalg.inv(of_coefficients)))


def _integrals(share: Array, count: int) -> Array:
    """(n, count) integrals of P_0 .. P_(count-1) on [0, 1] from 0 to each share (n,) of a step."""
    p = legendre.legvander(2.0 * share - 1.0, count)
    out = np.empty((len(share), count))
    out[:, 0] = share
    k = np.arange(1, count)
    out[:, 1:] = (p[:, 2:] - p[:, :-2]) / (2.0 * (2.0 * k + 1.0))
    return out


class _Integration:
    """One integration: the state, the steps done, and the matrix of Newton's method with the step it was made for."""

    def __init__(self, f: Slopes, t: float, y: Array, end: float, rtol: float, atol: float, points: int) -> None:
        self.f, self.t, self.y, self.end, self.rtol, self.atol = f, t, y, end, rtol, atol
        self.scheme, self.evaluations = radau_points(points), 0
        self.shortest = SHORTEST * (end - t)
        self.starts, self.sizes, self.states = [t], list[float](), [y]
        self.slopes: list[Array] = []
        self.matrix: Array | None = None
        self.made_for = 0.0

    def slope(self, t: Array, y: Array) -> Array:
        self.evaluations += len(t)
        count_work(ADAPTIVE_STAGE)
        return np.asarray(self.f(t, y), dtype=float)

    def first_step(self) -> float:
        """A step over which the state changes by a hundredth of its size and scale of slope."""
        slope = self.slope(np.array([self.t]), self.y[None])[0]
        scale = self.atol + self.rtol * np.abs(self.y)
        pace = float(np.max(np.abs(slope) / scale, initial=0.0))
        span = self.end - self.t
        return min(span, max(1e3 * self.shortest, 1e6 / pace)) if 0.0 < pace < np.inf else 1e-3 * span

    def newton_matrix(self, h: float) -> Array:
        """Inverse of 1 - h A x J (s m, s m), J (m, m) by differences at the present state."""
        m, s = len(self.y), len(self.scheme.nodes)
        step = 1e-8 * np.maximum(np.abs(self.y), 1e-3)
        found = self.slope(np.full(m + 1, self.t), np.vstack([self.y, self.y + np.diag(step)]))
        jacobian = ((found[1:] - found[0]) / step[:, None]).T
        self.made_for = h
        return np.asarray(np.linalg.inv(np.eye(s * m) - h * np.kron(self.scheme.integrals, jacobian)))

    def solve(self, h: float, guess: Array) -> Array | None:
        """(s, m) Y - y at the points of a step of size h, from a guess; None where Newton's method does not converge."""
        nodes, a = self.scheme.nodes, self.scheme.integrals
        scale = self.atol + self.rtol * np.abs(self.y)
        moved, before, times = guess, np.inf, self.t + h * nodes
        assert self.matrix is not None
        for k in range(MOST_ITERATIONS):
            slopes = self.slope(times, self.y + moved)
            change = (self.matrix @ (h * (a @ slopes) - moved).ravel()).reshape(moved.shape)
            size = float(np.max(np.abs(change) / scale, initial=0.0))
            if not np.isfinite(size) or (k > 1 and size > 2.0 * before and size > 1.0):
                return None
            moved = moved + change
            rate = min(size / before, 1.0) if before < np.inf else 1.0
            if size <= SOLVED or (rate < 0.5 and size * rate <= SOLVED) or (size < 0.3 and rate > 0.5 and k > 2):
                if k > 7:
                    self.matrix = None  # the next step makes a better one
                return moved
            before = size
        return None

    def step(self, h: float) -> tuple[float, bool]:
        """Try a step; the size of the next one, and whether this one was taken."""
        if self.matrix is None or abs(h - self.made_for) > 1e-12 * h:
            self.matrix = self.newton_matrix(h)
        found = self.solve(h, self.guess(h))
        if found is None or not np.all(np.isfinite(found)):
            self.matrix = None
            return 0.4 * h, False
        # slopes from the states: those of the equation carry their rounding times its fastest rate
        terms = self.scheme.coefficients @ found / h
        scale = self.atol + self.rtol * np.maximum(np.abs(self.y), np.abs(self.y + h * terms[0]))
        s = len(self.scheme.nodes)
        before, last, end = (float(np.max(h * np.abs(terms[-k]) / scale, initial=0.0)) for k in (4, 2, 1))
        # where a symmetric motion has every other coefficient zero, the one before the last says how they fall
        error = max(end, last * min(1.0, (last / before) ** 0.5 if before > 0.0 else 1.0)) / (2.0 * s)
        factor = SAFETY * error ** (-1.0 / s) if error > 0.0 else GROW
        if error > 1.0:
            return h * max(SHRINK, min(factor, 0.9)), False
        self.slopes.append(terms)
        self.sizes.append(h)
        self.t = self.end if self.t + h >= self.end - self.shortest else self.t + h
        self.y = self.y + found[-1]
        self.starts.append(self.t)
        self.states.append(self.y)
        return (h if 1.0 <= factor < 1.3 else h * min(factor, GROW)), True

    def guess(self, h: float) -> Array:
        """(s, m) Y - y of the next step: the polynomial of the last one, carried on."""
        if not self.slopes:
            return np.zeros((len(self.scheme.nodes), len(self.y)))
        last = self.sizes[-1]
        ahead = 1.0 + self.scheme.nodes * (h / last)
        s = len(self.scheme.nodes)
        return np.asarray(last * ((_integrals(ahead, s) - _integrals(np.ones(1), s)) @ self.slopes[-1]))

    def dense(self) -> Callable[[ArrayLike], Array]:
        """The polynomials of all steps as one function: times (...) -> (m, ...)."""
        starts, states = np.array(self.starts), np.array(self.states)
        if not self.slopes:
            return lambda t: np.multiply.outer(states[0], np.ones(np.shape(t)))
        sizes, slopes = np.array(self.sizes), np.array(self.slopes)

        def at(t: ArrayLike) -> Array:
            times = np.asarray(t, dtype=float)
            flat = times.ravel()
            k = np.clip(np.searchsorted(starts, flat, side="right") - 1, 0, len(sizes) - 1)
            weights = _integrals((flat - starts[k]) / sizes[k], slopes.shape[1])
            found = states[k] + sizes[k, None] * np.einsum("ns,nsm->nm", weights, slopes[k])
            return np.asarray(np.moveaxis(found, -1, 0).reshape(-1, *times.shape))

        return at


def integrate_collocated(
    f: Slopes,
    t0: float,
    y0: ArrayLike,
    t1: float,
    *,
    rtol: float = 1e-10,
    atol: float = 1e-12,
    points: int = POINTS,
    most_evaluations: int = 10_000_000,
) -> Trajectory:
    """dy/dt = f(t, y) from y0 (m,) at t0 to t1 > t0; f takes many states at once, t (k,) and y (k, m).

    An integration that cannot go on ends with an `outcome` and the steps done so far. Raises MechlabError for times that are not
    finite, or an end that does not come after the start.
    """
    if not (np.isfinite(t0) and np.isfinite(t1) and t1 > t0):
        raise MechlabError(f"times: expected a finite start and a finite end after it, got {t0!r} and {t1!r}.")
    run = _Integration(f, float(t0), np.array(y0, dtype=float), float(t1), rtol, atol, points)
    outcome = IntegrationStatus.COMPLETE
    with np.errstate(over="ignore", invalid="ignore"):
        h = run.first_step()
        while run.t < run.end:
            left = run.end - run.t
            # the last steps share what is left, so that none is tiny
            h, taken = run.step(left if h >= 0.999 * left else min(h, 0.5 * left) if h > 0.5 * left else h)
            if run.evaluations > most_evaluations:
                outcome = IntegrationStatus.TOO_MANY
                break
            if not taken and h < run.shortest:
                finite = np.all(np.isfinite(run.slope(np.array([run.t]), run.y[None])))
                outcome = IntegrationStatus.STEP_TOO_SMALL if finite else IntegrationStatus.NOT_FINITE
                break
    return Trajectory(np.array(run.starts), np.array(run.states), run.evaluations, outcome, run.dense())
