"""A mechanism as one freedom (Eksergian): J(phi) phi'' + J'(phi) phi'^2 / 2 = force, exact and without constraints.

Everything that depends on phi alone stands in a `PathTable`: pieces of polynomials through Chebyshev nodes, made where
the motion passes and halved until they meet the stated error.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
ORDER = 10  # of the polynomials
DEEPEST = 22  # halvings of a cell before the path counts as ended
PROBES = (-0.93, -0.41, 0.17, 0.79)
"""Places in a cell, away from its nodes, where the polynomial is compared with exact values."""


@dataclass(frozen=True)
class PolynomialPiece:
    """A polynomial on [low, high]: coefficients (order + 1, columns) of Chebyshev polynomials, and its error."""

    low: float
    high: float
    coefficients: Array
    error: float


class PathTable:
    """Columns as functions of one coordinate phi, from an exact `sample(phi) -> (columns,)`.

    The first cells have the given `width`; a cell is halved until its error, relative to the largest value of each
    column in it, is below `tolerance`; a column counts as at least `floor` large. `period`: the columns repeat
    after it, with `turn` (columns,) added each time. `error` is the largest error of the cells in use. Raises
    NoSolution where no smaller cell helps: the path ends there.
    """

    def __init__(
        self,
        sample: Callable[[float], Array],
        width: float,
        tolerance: float = 1e-10,
        floor: float = 1e-3,
        period: float | None = None,
        turn: Array | None = None,
        origin: float = 0.0,
    ) -> None:
        if not (np.isfinite(width) and width > 0 and tolerance > 0):
            raise MechlabError(f"path table: width {width!r} and tolerance {tolerance!r} must be numbers > 0.")
        self.sample, self.width, self.tolerance, self.floor = sample, width, tolerance, floor
        self.period, self.turn, self.origin = period, turn, origin
        if period is not None:
            self.width = period / max(1, round(period / width))
        x = np.cos(np.pi * np.arange(ORDER + 1) / ORDER)
        self._nodes = x
        self._fit = np.linalg.inv(np.polynomial.chebyshev.chebvander(x, ORDER))
        self._probe = np.polynomial.chebyshev.chebvander(np.array(PROBES), ORDER)
        self._powers = np.arange(ORDER + 1)
        self._lows: list[float] = []
        self._pieces: list[PolynomialPiece] = []
        self._last: PolynomialPiece | None = None
        self.samples = 0

    @property
    def pieces(self) -> int:
        """Number of pieces made so far."""
        return len(self._pieces)

    @property
    def error(self) -> float:
        """Largest error of the pieces made so far, relative to the size of each column."""
        return max((c.error for c in self._pieces), default=0.0)

    def __call__(self, phi: float) -> Array:
        """(columns,) at phi."""
        turns = 0.0
        if self.period is not None:
            turns = float(np.floor((phi - self.origin) / self.period))
            phi = phi - turns * self.period
        piece = self._last
        if piece is None or not piece.low <= phi <= piece.high:
            piece = self._last = self._find(phi)
        x = (2.0 * phi - piece.low - piece.high) / (piece.high - piece.low)
        basis = np.cos(self._powers * np.arccos(min(1.0, max(-1.0, x))))
        out = basis @ piece.coefficients
        return out + turns * self.turn if turns and self.turn is not None else out

    def _find(self, phi: float) -> PolynomialPiece:
        k = bisect_right(self._lows, phi) - 1
        if k >= 0 and phi <= self._pieces[k].high:
            return self._pieces[k]
        n = np.floor((phi - self.origin) / self.width)
        low, high = self.origin + n * self.width, self.origin + (n + 1) * self.width
        for _ in range(DEEPEST):
            piece = self._try(low, high)
            if piece is not None and piece.error <= self.tolerance:
                at = bisect_right(self._lows, low)
                self._lows.insert(at, low)
                self._pieces.insert(at, piece)
                return piece
            middle = 0.5 * (low + high)
            low, high = (low, middle) if phi < middle else (middle, high)
        raise NoSolution(f"the path of the one freedom ends at {phi:.9g}: a limit position or a place where modes meet")

    def _try(self, low: float, high: float) -> PolynomialPiece | None:
        half, middle = 0.5 * (high - low), 0.5 * (low + high)
        try:
            values = np.array([self.sample(middle + half * x) for x in self._nodes])
            exact = np.array([self.sample(middle + half * x) for x in PROBES])
        except NoSolution:
            return None
        self.samples += len(values) + len(exact)
        coefficients = self._fit @ values
        size = np.maximum(np.max(np.abs(values), axis=0), self.floor)
        error = float(np.max(np.abs(self._probe @ coefficients - exact) / size))
        return PolynomialPiece(low, high, coefficients, error)


@dataclass(frozen=True)
class Terms:
    """Terms of the equation of one freedom at an instant: inertia J, half_slope dJ/dphi / 2, force (everything but
    the velocity term), power of the non-conservative forces [W], and rates of further states (m,)."""

    inertia: float
    half_slope: float
    force: float
    power: float
    states: Array = field(default_factory=lambda: np.zeros(0))


def acceleration(terms: Terms, rate: float) -> float:
    """phi'' = (force - J'/2 phi'^2) / J. Raises MechlabError when nothing that moves has inertia."""
    if not terms.inertia > 0.0:
        raise MechlabError("the freedom has no inertia: give the parts that move in it a mass.")
    return (terms.force - terms.half_slope * rate * rate) / terms.inertia


def right_side(terms: Callable[[float, Array], Terms]) -> Callable[[float, Array], Array]:
    """f(t, y) for y = (phi, phi', work, further states): the equation in first-order form, from terms(t, y)."""

    def f(t: float, y: Array) -> Array:
        now = terms(t, y)
        return np.concatenate([[y[1], acceleration(now, float(y[1])), now.power], now.states])

    return f
