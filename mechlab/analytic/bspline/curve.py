"""A B-spline curve as data, and as one polynomial for each span."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.values import short

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class BSpline:
    """A curve C(u) of degree p with m + p + 1 knots and m points (m, n) in n dimensions.

    Raises MechlabError, naming the culprit, for a degree that is no whole number from 1 to 20, points that are not
    (m, n) finite numbers with m > p, a wrong count of knots, knots that decrease, or an empty range [knots[p], knots[m]].
    """

    degree: int
    knots: tuple[float, ...]
    points: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        p = self.degree
        if isinstance(p, bool) or not isinstance(p, int) or not 1 <= p <= 20:
            raise MechlabError(f"degree: expected a whole number from 1 to 20, got {short(p)}.")
        points = _numbers("points", self.points, 2)
        knots = _numbers("knots", self.knots, 1)
        m = len(points)
        if m <= p or points.shape[1] < 1:
            raise MechlabError(f"points: a curve of degree {p} needs at least {p + 1} points, got {m}.")
        if len(knots) != m + p + 1:
            raise MechlabError(
                f"knots: {m} points of degree {p} need {m} + {p} + 1 = {m + p + 1} knots, got {len(knots)}."
            )
        falls = np.flatnonzero(np.diff(knots) < 0)
        if len(falls):
            k = int(falls[0])
            raise MechlabError(
                f"knots: they must not decrease, but knot {k + 1} = {knots[k + 1]:g} follows {knots[k]:g}."
            )
        if not knots[p] < knots[m]:
            raise MechlabError(f"knots: the curve runs from knot {p} to knot {m}, both {knots[p]:g}: it has no length.")
        object.__setattr__(self, "knots", tuple(knots.tolist()))
        object.__setattr__(self, "points", tuple(tuple(row) for row in points.tolist()))

    @property
    def start(self) -> float:
        """First parameter of the curve."""
        return self.knots[self.degree]

    @property
    def end(self) -> float:
        """Last parameter of the curve."""
        return self.knots[len(self.points)]

    @cached_property
    def breaks(self) -> FloatArray:
        """Parameters where spans meet, first and last included; spans of no length are skipped."""
        return np.unique(self.knots[self.degree : len(self.points) + 1])

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import BSpline as ScipySpline

        return ScipySpline(np.array(self.knots), np.array(self.points), self.degree)

    def at(self, u: ArrayLike, order: int = 0) -> FloatArray:
        """C(u), or its derivative of order `order`, (..., n). Raises MechlabError for u outside the curve."""
        v = np.asarray(u, dtype=np.float64)
        slack = 1e-12 * (self.end - self.start)
        if np.any(v < self.start - slack) or np.any(v > self.end + slack):
            raise MechlabError(
                f"u: expected {self.start:g} to {self.end:g}, got {float(np.min(v)):g} to {float(np.max(v)):g}."
            )
        return np.asarray(self._spline(np.clip(v, self.start, self.end), nu=order))

    def part(self, columns: slice) -> BSpline:
        """The curve of the coordinates in `columns`."""
        return BSpline(self.degree, self.knots, tuple(row[columns] for row in self.points))

    @cached_property
    def velocity(self) -> FloatArray:
        """(spans, n, degree) coefficients of C'(u) in (u - first parameter of the span), highest power first."""
        from scipy.interpolate import BSpline as ScipySpline
        from scipy.interpolate import PPoly

        inside = self.breaks
        out = np.empty((len(inside) - 1, len(self.points[0]), self.degree))
        for k, column in enumerate(np.array(self.points).T):  # PPoly takes one coordinate at a time
            power = PPoly.from_spline(ScipySpline(np.array(self.knots), column, self.degree)).derivative()
            spans = np.searchsorted(power.x, inside[:-1], side="right") - 1
            out[:, k] = power.c[:, spans].T
        return out

    def speed(self, u: ArrayLike) -> FloatArray:
        """|C'(u)|, any shape."""
        return np.asarray(np.linalg.norm(self.at(u, 1), axis=-1))


def _numbers(name: str, value: Any, dims: int) -> FloatArray:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.array(np.nan)
    if array.ndim != dims or not np.all(np.isfinite(array)):
        wanted = "a list of finite numbers" if dims == 1 else "a list of points, each a list of as many finite numbers"
        raise MechlabError(f"{name}: expected {wanted}, got {short(value)}.")
    return array
