"""Coupler curves of four-bars and geared five-bars in batches, with their exact derivatives.

    A = O + W e^(i t),    C = D + V e^(i n t),    |A + b u - C| = c,    |u| = 1,    P = A + p u

O and D are the pivots, W and V the cranks at t = 0, b the coupler A-B, c the link C-B, u the direction of the coupler, p the coupler point
in its axes, n the ratio of the gears. V = 0 is the four-bar, whose rocker has the pivot D = C. A linkage is a row of twelve numbers,
(O, W, D, V, b, c, p) with complex ones as x, y, and its mode: +1 where B lies left of the way from A to C.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
SIZES = 12
FOURBAR = np.array([0, 1, 2, 3, 4, 5, 8, 9, 10, 11])
"""Numbers of a row that a four-bar has: all but V."""
PIVOTS = (0, 4)
"""Where O and D stand in a row."""
COUPLER, LINK = 8, 9
"""Where b and c stand in a row."""


@dataclass(frozen=True)
class CurvePoints:
    """Points (..., n) of coupler curves. margin: sine of the angle at B between coupler and link, signed by the side; NaN where it does
    not assemble."""

    point: Complex
    joint: Complex
    pin: Complex
    other: Complex
    turn: Complex
    margin: Array


def complex_at(x: Array, k: int) -> Complex:
    """The complex number at place k of rows (..., 12), with an axis for the angles."""
    return np.asarray(x[..., k, None] + 1j * x[..., k + 1, None])


def points(x: Array, mode: Array, ratio: float, t: Array) -> CurvePoints:
    """Rows (..., 12), modes (...), crank angles (..., n) -> the points; NaN where a linkage does not assemble."""
    pin = complex_at(x, 0) + complex_at(x, 2) * np.exp(1j * t)
    other = complex_at(x, 4) + complex_at(x, 6) * np.exp(1j * ratio * t)
    b, c = x[..., COUPLER, None], x[..., LINK, None]
    way = other - pin
    square = way.real**2 + way.imag**2
    # law of cosines at A: cosine and sine of the angle from the way to the coupler, times the length of the way
    along = (b * b + square - c * c) / (2.0 * b)
    with np.errstate(invalid="ignore", divide="ignore"):
        across = np.asarray(mode)[..., None] * np.sqrt(square - along * along)
        turn = way * (along + 1j * across) / square
        joint = pin + b * turn
        margin = across / c
    return CurvePoints(pin + complex_at(x, 10) * turn, joint, pin, other, turn, margin)


def slopes(x: Array, found: CurvePoints, ratio: float, t: Array) -> tuple[Complex, Complex]:
    """Derivatives of P by the twelve numbers, (..., n, 12), and by the crank angle, (..., n)."""
    of_pin, spin, pin_rate, spin_rate = spins(x, found, ratio, t)
    p, u = complex_at(x, 10), found.turn
    out = of_pin + (1j * p * u)[..., None] * spin
    out[..., 10] += u
    out[..., 11] += 1j * u
    return out, pin_rate + 1j * p * u * spin_rate


def spins(x: Array, found: CurvePoints, ratio: float, t: Array) -> Spins:
    """Derivatives of A (..., n, 12) and of the coupler's angle (..., n, 12) by the twelve numbers, of both by the crank angle (..., n)."""
    e, f, u = np.exp(1j * t), np.exp(1j * ratio * t), found.turn
    b, c = x[..., COUPLER, None], x[..., LINK, None]
    rod = found.joint - found.other
    lever = np.real(np.conj(rod) * 1j * b * u)
    one = np.ones_like(e)
    none = np.zeros_like(e)
    of_pin = np.stack([one, 1j * one, e, 1j * e, *(none,) * 8], axis=-1)
    of_other = np.stack([*(none,) * 4, one, 1j * one, f, 1j * f, *(none,) * 4], axis=-1)
    stretch = np.zeros((*u.shape, SIZES), dtype=complex)
    stretch[..., COUPLER] = u
    grown = np.zeros((*u.shape, SIZES))
    grown[..., LINK] = c
    with np.errstate(invalid="ignore", divide="ignore"):
        spin = (grown - np.real(np.conj(rod)[..., None] * (of_pin - of_other + stretch))) / lever[..., None]
        pin_rate, other_rate = 1j * complex_at(x, 2) * e, 1j * ratio * complex_at(x, 6) * f
        spin_rate = -np.real(np.conj(rod) * (pin_rate - other_rate)) / lever
    return of_pin, spin, pin_rate, spin_rate


def widest(x: Array) -> Array:
    """The longest bar of each linkage (...): cranks, coupler with its point, link, ground."""
    w, v, p = (np.abs(complex_at(x, k))[..., 0] for k in (2, 6, 10))
    ground = np.abs(complex_at(x, 4) - complex_at(x, 0))[..., 0]
    bar = np.abs(complex_at(x, 10)[..., 0] - x[..., COUPLER])
    return np.max(np.stack([w, v, p, bar, x[..., COUPLER], x[..., LINK], ground]), axis=0)


class Traced(Protocol):
    """Points (..., n) of curves, and the sine of the least transmission angle, signed by the side; NaN where one does not assemble."""

    @property
    def point(self) -> Complex:
        """Of the curve."""

    @property
    def turn(self) -> Complex:
        """Direction (..., n) of the link that carries the point."""

    @property
    def margin(self) -> Array:
        """The sine."""


Spins = tuple[Complex, Array, Complex, Array]
"""Derivatives of the beginning of the link that carries the point, and of its angle, by the numbers of a row (..., n, m) and by the crank
angle (..., n)."""


class Curve(Protocol):
    """A kind of linkage as the fit sees it."""

    @property
    def free(self) -> NDArray[np.int_]:
        """The numbers of a row that are free."""

    @property
    def lengths(self) -> tuple[int, ...]:
        """Those of them that must be above 0."""

    @property
    def pivots(self) -> tuple[int, ...]:
        """Those of a row with which a point of the ground begins."""

    @property
    def ratio(self) -> float:
        """Of its gears, 0 without."""

    def scaled(self, scale: float) -> Curve:
        """The kind of linkage whose rows are `scale` times as long."""

    def points(self, x: Array, mode: Array, t: Array) -> Traced:
        """See `points`."""

    def slopes(self, x: Array, found: Any, t: Array) -> tuple[Complex, Complex]:
        """See `slopes`."""

    def widest(self, x: Array) -> Array:
        """See `widest`."""


class LinkCurve(Curve, Protocol):
    """A kind of linkage whose point is one of a link."""

    def spins(self, x: Array, found: Any, t: Array) -> Spins:
        """See `Spins`."""


@dataclass(frozen=True)
class Geared:
    """Four-bars, ratio 0, and geared five-bars as a `LinkCurve`."""

    ratio: float = 0.0
    lengths: tuple[int, ...] = (COUPLER, LINK)
    pivots: tuple[int, ...] = PIVOTS

    def scaled(self, scale: float) -> Geared:
        """The same, as it has no length of its own."""
        return self

    @property
    def free(self) -> NDArray[np.int_]:
        """All numbers of a row, but those that a four-bar does not have."""
        return np.arange(SIZES) if self.ratio else FOURBAR

    def points(self, x: Array, mode: Array, t: Array) -> CurvePoints:
        """See `points`."""
        return points(x, mode, self.ratio, t)

    def slopes(self, x: Array, found: CurvePoints, t: Array) -> tuple[Complex, Complex]:
        """See `slopes`."""
        return slopes(x, found, self.ratio, t)

    def spins(self, x: Array, found: CurvePoints, t: Array) -> Spins:
        """See `spins`."""
        return spins(x, found, self.ratio, t)

    def widest(self, x: Array) -> Array:
        """See `widest`."""
        return widest(x)
