"""Regions of space built from named clauses, each a margin in metres: evaluated on grids, and asked which clause binds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.regions.algebra import EXACT, Algebra, FloatArray
from mechlab.errors import MechlabError, unknown

Coordinates = Mapping[str, FloatArray]
"""Coordinates by axis name; the arrays broadcast against each other."""


@dataclass(frozen=True)
class Verdicts:
    """What a region says of points. margin: its value [m], >= 0 inside. clause: index into `names` of the clause that
    decides it: the most violated one outside, the tightest one inside. Both have the broadcast shape of the points."""

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
        """Itself."""
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
class _Pair(Region):
    first: Region
    second: Region

    @property
    def clauses(self) -> tuple[Clause, ...]:
        """Those of the two, without repeating one that stands in both."""
        return _merged(self.first, self.second)


@dataclass(frozen=True)
class Both(_Pair):
    """Points of both regions."""

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """The algebra's meet."""
        return algebra.meet(self.first.margin(points, algebra), self.second.margin(points, algebra))

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        (a, i), (b, j) = self.first._decide(points, names), self.second._decide(points, names)
        return np.minimum(a, b), np.where(b < a, j, i)


@dataclass(frozen=True)
class Either(_Pair):
    """Points of at least one of the regions."""

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """The algebra's join."""
        return algebra.join(self.first.margin(points, algebra), self.second.margin(points, algebra))

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        (a, i), (b, j) = self.first._decide(points, names), self.second._decide(points, names)
        return np.maximum(a, b), np.where(b > a, j, i)


@dataclass(frozen=True)
class Outside(Region):
    """The complement, up to the border, which belongs to both."""

    of: Region

    @property
    def clauses(self) -> tuple[Clause, ...]:
        """Those of the region."""
        return self.of.clauses

    def margin(self, points: Coordinates, algebra: Algebra = EXACT) -> FloatArray:
        """Minus the margin."""
        return -self.of.margin(points, algebra)

    def _decide(self, points: Coordinates, names: tuple[str, ...]) -> tuple[FloatArray, NDArray[np.int16]]:
        value, clause = self.of._decide(points, names)
        return -value, clause


def all_of(regions: Sequence[Region]) -> Region:
    """The region where all hold. Raises MechlabError for none."""
    return reduce(Both, _some(regions, "all_of"))


def any_of(regions: Sequence[Region]) -> Region:
    """The region where at least one holds. Raises MechlabError for none."""
    return reduce(Either, _some(regions, "any_of"))


def _some(regions: Sequence[Region], what: str) -> Sequence[Region]:
    if not regions:
        raise MechlabError(f"{what}: expected at least one region, got none.")
    return regions


def _merged(first: Region, second: Region) -> tuple[Clause, ...]:
    return first.clauses + tuple(c for c in second.clauses if not any(c is d for d in first.clauses))
