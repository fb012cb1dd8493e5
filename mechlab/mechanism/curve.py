"""A smooth function of one variable as data, and the relation of two joints that it makes: a cam, a Geneva wheel, oval gears.

    output = f(input)        value of the output joint, physical, for that of the input joint

f is a polynomial on every piece between two knots, in powers of the distance from the left one (coefficients as of scipy's PPoly,
lowest power first). It is continuous with its derivative; its second derivative may jump at knots (`Curve.jumps`: the acceleration of a
Geneva wheel does as the pin enters its slot). A periodic curve goes on with f(x + period) = f(x) + rise; of another one the first and
the last piece go on beyond its ends.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

MOST_PIECES, MOST_POWERS = 2000, 8
"""Most pieces of a curve, and most coefficients of one: files and pages carry them all."""
CONTINUOUS = 1e-9
"""Largest jump of the value at a knot, and of the slope times a piece, relative to the size of the curve."""
SMOOTH = 1e-6
"""Jump of the second derivative at a knot, relative to its largest value, above which it counts."""


@dataclass(frozen=True)
class Curve:
    """Rising knots (n + 1,) and pieces (n, powers): coefficients, lowest power first, of the distance from the left knot.

    rise: f gains it in every period, knots[-1] - knots[0]; None: not periodic. Units: radians or metres.
    Raises MechlabError for data that are no such function: not finite, not rising, a jump of the value or of the slope.
    """

    knots: tuple[float, ...]
    pieces: tuple[tuple[float, ...], ...]
    rise: float | None = None

    def __post_init__(self) -> None:
        count = len(self.pieces)
        if not 1 <= count <= MOST_PIECES or len(self.knots) != count + 1:
            raise MechlabError(
                f"curve: expected 1 to {MOST_PIECES} pieces and one knot more, got {count} pieces, {len(self.knots)} knots."
            )
        powers = {len(c) for c in self.pieces}
        if len(powers) != 1 or not 1 <= max(powers) <= MOST_POWERS:
            raise MechlabError(f"curve: expected the same 1 to {MOST_POWERS} coefficients for every piece, got {sorted(powers)}.")
        if not all(map(math.isfinite, (*self.knots, *(x for c in self.pieces for x in c), self.rise or 0.0))):
            raise MechlabError("curve: its knots, coefficients and rise must be finite numbers.")
        if any(b <= a for a, b in zip(self.knots, self.knots[1:], strict=False)):
            raise MechlabError("curve: its knots must rise.")
        gaps = self._gaps()
        size = max(float(np.max(np.abs(self._table[:, 0]))), abs(self.rise or 0.0), 1e-300)
        width = np.append(np.diff(self.knots)[1:], self.knots[1] - self.knots[0])
        for k, what, scale in ((0, "value", np.ones(count)), (1, "slope", width)):
            worst = int(np.argmax(np.abs(gaps[:, k] * scale)))
            if abs(gaps[worst, k] * scale[worst]) > CONTINUOUS * size:
                raise MechlabError(
                    f"curve: its {what} jumps by {gaps[worst, k]:.3g} at {self.knots[worst + 1]:.6g}; value and slope must be continuous. "
                    "Correct the data there, or make the curve with mechlab.mechanism.curve.hermite from values and derivatives."
                )

    @cached_property
    def _table(self) -> Array:
        return np.array(self.pieces, dtype=float)

    @property
    def period(self) -> float:
        """Length from the first to the last knot."""
        return self.knots[-1] - self.knots[0]

    def _gaps(self) -> Array:
        """(pieces, 3) jumps of f, f', f'' at the right end of every piece; zeros at the last one unless periodic."""
        width, table = np.diff(self.knots), self._table
        ends = np.stack(_derivatives(table, width), axis=1)
        starts = np.stack(_derivatives(table, np.zeros(len(width))), axis=1)
        following = np.roll(starts, -1, axis=0)
        following[-1, 0] += self.rise or 0.0
        out = following - ends
        if self.rise is None:
            out[-1] = 0.0
        return out

    @cached_property
    def jumps(self) -> tuple[float, ...]:
        """Knots at which the second derivative jumps, by more than rounding or sampling."""
        powers, width = np.arange(self._table.shape[1]), np.diff(self.knots)
        parts = np.abs(self._table) * powers * (powers - 1) * width[:, None] ** np.maximum(powers - 2, 0)
        rounding = 1e-11 * float(np.max(np.abs(self._table[:, 0]))) / float(np.min(width)) ** 2
        limit = max(SMOOTH * float(np.max(parts.sum(axis=1))), rounding)
        return tuple(self.knots[k + 1] for k in np.flatnonzero(np.abs(self._gaps()[:, 2]) > limit))

    def folded(self, x: float) -> float:
        """The place itself, or that of the first period which stands for it."""
        return x if self.rise is None else x - math.floor((x - self.knots[0]) / self.period) * self.period

    def piece(self, x: float) -> int:
        """Index of the piece that holds at a place."""
        return min(max(bisect_right(self.knots, self.folded(x)) - 1, 0), len(self.pieces) - 1)

    def at(self, x: float) -> tuple[float, float, float]:
        """f, f' and f'' at one place."""
        turns = 0.0
        if self.rise is not None:
            turns = math.floor((x - self.knots[0]) / self.period)
            x -= turns * self.period
        k = min(max(bisect_right(self.knots, x) - 1, 0), len(self.pieces) - 1)
        d, f, g, h = x - self.knots[k], 0.0, 0.0, 0.0
        for c in reversed(self.pieces[k]):
            h, g, f = h * d + g, g * d + f, f * d + c
        return f + turns * (self.rise or 0.0), g, 2.0 * h

    def many(self, x: ArrayLike) -> tuple[Array, Array, Array]:
        """f, f' and f'' at places of any shape."""
        x = np.asarray(x, dtype=float)
        turns = np.zeros(x.shape)
        if self.rise is not None:
            turns = np.floor((x - self.knots[0]) / self.period)
            x = x - turns * self.period
        k = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.pieces) - 1)
        f, g, h = _derivatives(self._table[k], x - np.asarray(self.knots)[k])
        return f + turns * (self.rise or 0.0), g, h

    def scaled(self, x: float, y: float) -> Curve:
        """The curve of y f(input / x): the same law in other units."""
        return Curve(
            tuple(x * k for k in self.knots),
            tuple(tuple(y * c / x**i for i, c in enumerate(piece)) for piece in self.pieces),
            None if self.rise is None else y * self.rise,
        )


@dataclass(frozen=True)
class CurveRelation:
    """The value of the joint `output` is a function of that of the joint `input`, both revolute or prismatic: output = f(input).

    Its row is output - f(input) [rad or m]; its reaction is the torque or force on the output, f' times the opposite acts on the input.
    """

    name: str
    output: str
    input: str
    curve: Curve

    def in_unit_of_length(self, slides: frozenset[str] | set[str], unit: float) -> CurveRelation:
        """The same with the values of slides in `unit` [m]."""
        x, y = (1.0 / unit if n in slides else 1.0 for n in (self.input, self.output))
        return self if x == y == 1.0 else replace(self, curve=self.curve.scaled(x, y))


def polynomial(coefficients: Sequence[float], at: float = 0.0) -> Curve:
    """The curve of one polynomial, lowest power first, of the distance from `at`."""
    return Curve((at, at + 1.0), (tuple(float(c) for c in coefficients),))


def hermite(knots: ArrayLike, values: ArrayLike, slopes: ArrayLike, bends: ArrayLike, *, periodic: bool = False) -> Curve:
    """The quintic through values, slopes and second derivatives (n,) at rising knots (n,).

    Of a smooth law sampled at distances h the error is h^6 / 46080 times its largest sixth derivative, h^4 / 1920 of it in f''
    (Birkhoff & Priver 1967). periodic: the last value is the first plus the rise.
    """
    x, f, g, b = (np.asarray(a, dtype=float) for a in (knots, values, slopes, bends))
    if x.ndim != 1 or len(x) < 2 or not f.shape == g.shape == b.shape == x.shape:
        raise MechlabError(
            f"curve: expected as many values, slopes and second derivatives as knots (n,), got shapes {x.shape}, {f.shape}, {g.shape}, "
            f"{b.shape}."
        )
    h = np.diff(x)
    rise, end, bend = f[1:] - f[:-1] - h * (g[:-1] + 0.5 * h * b[:-1]), g[1:] - g[:-1] - h * b[:-1], b[1:] - b[:-1]
    table = np.stack([
        f[:-1], g[:-1], 0.5 * b[:-1],
        (10.0 * rise / h - 4.0 * end + 0.5 * h * bend) / h**2,
        (-15.0 * rise / h + 7.0 * end - h * bend) / h**3,
        (6.0 * rise / h - 3.0 * end + 0.5 * h * bend) / h**4,
    ], axis=1)  # fmt: skip
    pieces = tuple(tuple(row) for row in table.tolist())
    return Curve(tuple(x.tolist()), pieces, _gain(float(f[0]), float(f[-1]), f) if periodic else None)


def constant(start: float, end: float, value: float) -> Curve:
    """The curve of a dwell, for `joined` with quintics."""
    return hermite([start, end], [value, value], [0.0, 0.0], [0.0, 0.0])


def joined(curves: Sequence[Curve], *, periodic: bool = False) -> Curve:
    """Curves end to end: each begins where the one before ends, with its value and its slope; the second derivative may jump there."""
    knots, pieces = list(curves[0].knots), list(curves[0].pieces)
    for before, curve in zip(curves, curves[1:], strict=False):
        if curve.knots[0] != before.knots[-1]:
            raise MechlabError(f"curve: a part begins at {curve.knots[0]:.9g}, the part before it ends at {before.knots[-1]:.9g}.")
        knots += curve.knots[1:]
        pieces += curve.pieces
    ends = curves[0].at(knots[0])[0], curves[-1].at(knots[-1])[0]
    return Curve(tuple(knots), tuple(pieces), _gain(*ends, curves[0]._table) if periodic else None)


def _gain(first: float, last: float, values: Array) -> float:
    """Last value less the first, 0 where it is rounding."""
    gain = last - first
    return gain if abs(gain) > 1e-15 * float(np.max(np.abs(values))) else 0.0


def _derivatives(table: Array, d: Array) -> tuple[Array, Array, Array]:
    """f, f', f'' of polynomials (..., powers) at distances d (...) by Horner's rule."""
    f = g = h = np.zeros(d.shape)
    for c in np.moveaxis(table, -1, 0)[::-1]:
        h, g, f = h * d + g, g * d + f, f * d + c
    return f, g, 2.0 * h
