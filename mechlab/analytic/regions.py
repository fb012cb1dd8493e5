"""Implicit regions {f >= 0} with Boolean algebra: exact margins by min and max, smooth ones by R-functions.

A function says by its sign whether a point is inside (f >= 0) or outside (f < 0). `EXACT` is the lattice min, max:
every law holds in value, and the meet of signed distances is the exact distance inside. An R-function has the sign of
min and max but is smooth except where both arguments vanish; its value is no margin any more (ten margins of 1 meet
in 0.16), so margins are for `EXACT` and gradients for `SMOOTH`.

The complement is -f in both. The sets {f >= 0} are closed, so -f >= 0 is the complement only off the border f = 0,
where a set and its "complement" both say inside (V. L. Rvachev, Theory of R-functions, 1982).

A Region is built from named clauses, each a margin in metres. It is evaluated on grids and says which clause binds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass

FloatArray = NDArray[np.float64]
Operation = Callable[[ArrayLike, ArrayLike], FloatArray]


@dataclass(frozen=True)
class Algebra:
    """How two functions are joined: `meet` for and, `join` for or; arrays that broadcast in, an array out."""

    name: str
    meet: Operation
    join: Operation


def indicator(values: ArrayLike) -> NDArray[np.int64]:
    """1 where f >= 0, else 0: chi = (1 + sgn f) / 2 with sgn 0 = +1. Any shape, same shape."""
    return (np.asarray(values, dtype=np.float64) >= 0.0).astype(np.int64)


def _lower(x: ArrayLike, y: ArrayLike) -> FloatArray:
    return np.minimum(x, y, dtype=np.float64)


def _upper(x: ArrayLike, y: ArrayLike) -> FloatArray:
    return np.maximum(x, y, dtype=np.float64)


def r_functions(alpha: float = 0.0) -> Algebra:
    """The R-functions R_alpha: meet (x + y - s) / (1 + alpha), join (x + y + s) / (1 + alpha), with
    s = sqrt(x^2 + y^2 - 2 alpha x y); alpha = 0 is R0, alpha -> 1 tends to min and max.

    The difference x + y - s cancels when one argument is tiny, and loses its sign; where x + y > 0 the meet is computed as
    2 min(x, y) (max(x, y) / (x + y + s)), which keeps the sign down to the smallest double. The join is -meet(-x, -y).
    Raises MechlabError for alpha outside [0, 1).
    """
    if not 0.0 <= alpha < 1.0:
        raise MechlabError(f"r_functions: alpha = {alpha!r}; expected 0 <= alpha < 1 (for alpha = 1 use EXACT).")
    square = float(np.sqrt(1.0 - alpha * alpha))

    def meet(x: ArrayLike, y: ArrayLike) -> FloatArray:
        low, high = _lower(x, y), _upper(x, y)
        total = low + high
        s = np.hypot(low - alpha * high, square * high)  # x^2 + y^2 - 2 alpha x y as a sum of squares
        positive = total > 0.0
        share = np.divide(high, total + s, out=np.zeros(np.shape(total)), where=positive)
        return np.asarray(np.where(positive, 2.0 * low * share, (total - s) / (1.0 + alpha)))

    def join(x: ArrayLike, y: ArrayLike) -> FloatArray:
        return -meet(np.negative(x), np.negative(y))

    return Algebra(f"R_{alpha:g}", meet, join)


EXACT = Algebra("min and max", _lower, _upper)
"""The lattice: exact margins."""
SMOOTH = r_functions(0.0)
"""R0: smooth except at corners."""

Coordinates = Mapping[str, FloatArray]
"""Coordinates by axis name; the arrays broadcast against each other."""


@dataclass(frozen=True)
class Verdicts:
    """Margins and deciding clauses of points. margin: value of the region [m], >= 0 inside. clause: index into `names`
    of the clause that decides it: the most violated one outside, the tightest one inside. Both have the broadcast shape
    of the points."""

    names: tuple[str, ...]
    margin: FloatArray
    clause: NDArray[np.int16]

    @property
    def inside(self) -> NDArray[np.bool_]:
        """True where the point belongs to the region."""
        return np.asarray(self.margin >= 0.0)

    def binding(self) -> NDArray[np.str_]:
        """The name of the deciding clause, point by point."""
        return np.asarray(self.names)[self.clause]


class Region(ABC):
    """A set of points {margin >= 0}; `a & b`, `a | b` and `~a` build larger ones."""

    @property
    @abstractmethod
    def clauses(self) -> tuple[Clause, ...]:
        """Every clause that the region is built from, in order."""

    @abstractmethod
    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """Margin [m] of the points, of the shape they broadcast to or one that broadcasts to it."""

    @abstractmethod
    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        """Exact margin and deciding clause."""

    def decide(self, points: Coordinates) -> Verdicts:
        """Exact margins and the clause that decides each point."""
        names = tuple(c.name for c in self.clauses)
        repeated = sorted({n for n in names if names.count(n) > 1})
        if repeated:
            raise MechlabError(f"region: clause names must be unique, but these repeat: {', '.join(repeated)}.")
        margin, clause = self._decide(points, names)
        shape = np.broadcast_shapes(*(np.shape(v) for v in points.values()))
        return Verdicts(names, np.broadcast_to(margin, shape), np.broadcast_to(clause, shape))

    def __and__(self, other: Region) -> Region:
        return Both(self, other)

    def __or__(self, other: Region) -> Region:
        return Either(self, other)

    def __invert__(self) -> Region:
        return Outside(self)


@dataclass(frozen=True)
class Clause(Region):
    """One named condition. function(points) is its value in its own unit; `lever` [m per that unit] makes it a length, so
    that margins of angles, ratios and lengths may be compared. axes: the coordinates that it looks at."""

    name: str
    function: Callable[[Coordinates], FloatArray]
    axes: tuple[str, ...] = ("x", "y", "z")
    lever: float = 1.0
    text: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.lever < np.inf:
            raise MechlabError(f"clause {self.name!r}: lever = {self.lever!r}; expected a positive length per unit.")

    @property
    def clauses(self) -> tuple[Clause, ...]:
        """The clause itself."""
        return (self,)

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """lever x function [m]."""
        missing = [a for a in self.axes if a not in points]
        if missing:
            raise unknown(f"clause {self.name!r}: coordinate", missing[0], points)
        value = np.asarray(self.function({a: points[a] for a in self.axes}), dtype=np.float64)
        return value if self.lever == 1.0 else self.lever * value

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        value = self.margin(points)
        return value, np.full(np.shape(value), names.index(self.name), dtype=np.int16)


@dataclass(frozen=True)
class _Combined(Region):
    first: Region
    second: Region

    @property
    def clauses(self) -> tuple[Clause, ...]:
        """Clauses of both regions; a clause that stands in both is listed once."""
        return _merged(self.first, self.second)


@dataclass(frozen=True)
class Both(_Combined):
    """Points of both regions."""

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """The algebra's meet of the two margins [m]."""
        return algebra.meet(self.first.margin(points, algebra), self.second.margin(points, algebra))

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        (a, i), (b, j) = self.first._decide(points, names), self.second._decide(points, names)
        return np.minimum(a, b), np.where(b < a, j, i)


@dataclass(frozen=True)
class Either(_Combined):
    """Points of at least one of the regions."""

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """The algebra's join of the two margins [m]."""
        return algebra.join(self.first.margin(points, algebra), self.second.margin(points, algebra))

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        (a, i), (b, j) = self.first._decide(points, names), self.second._decide(points, names)
        return np.maximum(a, b), np.where(b > a, j, i)


@dataclass(frozen=True)
class Outside(Region):
    """The complement of a region; the border f = 0 belongs to both."""

    of: Region

    @property
    def clauses(self) -> tuple[Clause, ...]:
        """Clauses of the region inside."""
        return self.of.clauses

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """Minus the margin of the region [m]."""
        return -self.of.margin(points, algebra)

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        value, clause = self.of._decide(points, names)
        return -value, clause


def all_of(regions: Sequence[Region]) -> Region:
    """Intersection of the regions. Raises MechlabError when there are none."""
    return reduce(Both, _some(regions, "all_of"))


def any_of(regions: Sequence[Region]) -> Region:
    """Union of the regions. Raises MechlabError when there are none."""
    return reduce(Either, _some(regions, "any_of"))


def _some(regions: Sequence[Region], what: str) -> Sequence[Region]:
    if not regions:
        raise MechlabError(f"{what}: expected at least one region, got none.")
    return regions


def _merged(first: Region, second: Region) -> tuple[Clause, ...]:
    return first.clauses + tuple(c for c in second.clauses if not any(c is d for d in first.clauses))
