"""Curves of six-bars in batches, with their exact derivatives: a four-bar and a dyad on its coupler, whose link carries the point.

    |P + l v - S| = r,    |v| = 1,    Q = P + q v

P is the coupler point of the four-bar (`curves`), l the link P-F, r the arm S-F, v the direction of the link, q the point in its axes. S
is a pivot of the ground (Stephenson's third chain), or a point of the rocker (Watt's first): S = D + s (B - D) / c. A row has eighteen
numbers, those of the four-bar and S (or s), l, r, q; both modes are one number, m + 2 n with m of the four-bar and n = +1 where F lies
left of the way from P to S.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.path_synthesis.curves import (
    COUPLER,
    FOURBAR,
    LINK,
    PIVOTS,
    SIZES,
    Array,
    Complex,
    CurvePoints,
    Spins,
    complex_at,
    points,
    spins,
    widest,
)  # fmt: skip
from mechlab.lazy_dataclass import dataclass

PIVOT, ROD, ARM, TIP = 12, 14, 15, 16
"""Where S (or s), l, r and q stand in a row."""
NUMBERS = 18


def both_modes(mode: Array) -> tuple[Array, Array]:
    """Modes of the four-bar and of the dyad."""
    side = np.sign(mode)
    return np.asarray(mode - 2 * side), np.asarray(side)


@dataclass(frozen=True)
class SixbarPoints:
    """Points (..., n) of six-bars: those of the four-bar, S, the direction of the link, Q. margin: the smaller of the sines at B and F."""

    base: CurvePoints
    pivot: Complex
    turn: Complex
    point: Complex
    margin: Array


@dataclass(frozen=True)
class Sixbar:
    """Six-bars as a `LinkCurve`. on_rocker: S is a point of the rocker."""

    on_rocker: bool = False
    lengths: tuple[int, ...] = (COUPLER, LINK, ROD, ARM)
    ratio: float = 0.0

    @property
    def pivots(self) -> tuple[int, ...]:
        """Those of the four-bar, and S where it is a point of the ground."""
        return PIVOTS if self.on_rocker else (*PIVOTS, PIVOT)

    def scaled(self, scale: float) -> Sixbar:
        """The same, as it has no length of its own."""
        return self

    @cached_property
    def free(self) -> NDArray[np.int_]:
        """All numbers of a row but the second crank."""
        return np.concatenate([FOURBAR, np.arange(SIZES, NUMBERS)])

    def points(self, x: Array, mode: Array, t: Array) -> SixbarPoints:
        """Rows (..., 18), modes (...), crank angles (..., n) -> the points; NaN where a linkage does not assemble."""
        first, side = both_modes(mode)
        base = points(x, first, 0.0, t)
        pivot = complex_at(x, PIVOT)
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.on_rocker:
                pivot = base.other + pivot * (base.joint - base.other) / x[..., LINK, None]
            turn, sine = link_turn(pivot - base.point, x[..., ROD, None], x[..., ARM, None], side[..., None])
            point = base.point + complex_at(x, TIP) * turn
            margin = np.minimum(np.abs(base.margin), np.abs(sine))
        return SixbarPoints(base, np.broadcast_to(pivot, turn.shape), turn, point, margin)

    def slopes(self, x: Array, found: SixbarPoints, t: Array) -> tuple[Complex, Complex]:
        """Derivatives of Q by the eighteen numbers, (..., n, 18), and by the crank angle, (..., n)."""
        of_p, turned, p_rate, turn_rate = self.spins(x, found, t)
        v, q = found.turn, complex_at(x, TIP)
        out = of_p + (1j * q * v)[..., None] * turned
        out[..., TIP] += v
        out[..., TIP + 1] += 1j * v
        return out, p_rate + 1j * q * v * turn_rate

    def spins(self, x: Array, found: SixbarPoints, t: Array) -> Spins:
        """Derivatives of P and of the angle of the link by the eighteen numbers, (..., n, 18), and by the crank angle, (..., n)."""
        base = found.base
        of_pin, spin, pin_rate, spin_rate = spins(x[..., :SIZES], base, 0.0, t)
        u, p, b, c = base.turn, complex_at(x, 10), x[..., COUPLER, None], x[..., LINK, None]
        of_pin, spin = (np.concatenate([v, np.zeros((*v.shape[:-1], NUMBERS - SIZES), dtype=v.dtype)], axis=-1) for v in (of_pin, spin))
        of_p = of_pin + (1j * p * u)[..., None] * spin
        of_p[..., 10] += u
        of_p[..., 11] += 1j * u
        p_rate = pin_rate + 1j * p * u * spin_rate
        of_s, s_rate = np.zeros_like(of_p), np.zeros_like(p_rate)
        if self.on_rocker:
            s, arm = complex_at(x, PIVOT), (base.joint - base.other) / c
            of_arm = of_pin + (1j * b * u)[..., None] * spin
            of_arm[..., COUPLER] += u
            of_arm[..., 4] -= 1.0
            of_arm[..., 5] -= 1j
            of_s = s[..., None] * of_arm / c[..., None]
            of_s[..., 4] += 1.0
            of_s[..., 5] += 1j
            of_s[..., LINK] -= s * arm / c
            of_s[..., PIVOT] += arm
            of_s[..., PIVOT + 1] += 1j * arm
            s_rate = s * (pin_rate + 1j * b * u * spin_rate) / c
        else:
            of_s[..., PIVOT], of_s[..., PIVOT + 1] = 1.0, 1j
        v, rod = found.turn, x[..., ROD, None]
        arm = base.point + rod * v - found.pivot
        lever = np.real(np.conj(arm) * 1j * rod * v)
        moved = of_p - of_s
        moved[..., ROD] += v
        stretch = -np.real(np.conj(arm)[..., None] * moved)
        stretch[..., ARM] += x[..., ARM, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            turned = stretch / lever[..., None]
            turn_rate = -np.real(np.conj(arm) * (p_rate - s_rate)) / lever
        return of_p, turned, p_rate, turn_rate

    def widest(self, x: Array) -> Array:
        """The longest bar of each linkage (...), with their points, and the distances of the pivots."""
        s, q, p = (complex_at(x, k)[..., 0] for k in (PIVOT, TIP, 10))
        o, d = (complex_at(x, k)[..., 0] for k in (0, 4))
        far = [np.abs(s), np.abs(s - x[..., LINK])] if self.on_rocker else [np.abs(s - o), np.abs(s - d)]
        sizes = [widest(x), x[..., ROD], x[..., ARM], np.abs(q), np.abs(q - x[..., ROD]), np.abs(p), *far]
        return np.asarray(np.max(np.stack(sizes), axis=0))


def link_turn(way: Complex, rod: Array, arm: Array, side: Array) -> tuple[Complex, Array]:
    """Direction of the link of a dyad from the way between its ends, and the sine of the angle at its joint, signed by the side."""
    square = way.real**2 + way.imag**2
    along = (rod * rod + square - arm * arm) / (2.0 * rod)
    with np.errstate(invalid="ignore", divide="ignore"):
        across = side * np.sqrt(square - along * along)
        return np.asarray(way * (along + 1j * across) / square), np.asarray(across / arm)
