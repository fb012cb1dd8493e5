"""Positions, rates and accelerations of the planar four-bar; which links turn fully, and where the crank can move.

A = (0, 0) crank pivot, D = (ground, 0) rocker pivot, B crank pin, C coupler-rocker joint. Angles run from the ground
line A -> D, counter-clockwise: crank A -> B, coupler B -> C, rocker D -> C. mode +1: C lies left of the line B -> D.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.blocks import FloatArray, flattened, piece, pieces
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class FourbarPositions:
    """Answer of `positions`; all arrays in the broadcast shape of the inputs.

    coupler_angle, rocker_angle: radians in (-pi, pi], NaN exactly where `assembles` is False; np.unwrap along a path
    makes them continuous. transmission_angle: angle BCD in [0, pi], NaN where it does not assemble. gap [m]: how far the
    lengths are from closing (0 where they close). assembles: the loop closes in one point C. regular: it closes and
    coupler and rocker are not in line, so that rates exist. Where B falls on D, C is undetermined: assembles is False
    and gap is |coupler - rocker|.
    """

    coupler_angle: FloatArray
    rocker_angle: FloatArray
    transmission_angle: FloatArray
    gap: FloatArray
    assembles: BoolArray
    regular: BoolArray

    def require(self) -> Self:
        """The answer itself; raises NoSolution where the loop does not close or rates do not exist."""
        if not self.assembles.all():
            raise NoSolution(
                f"the four-bar does not assemble at {np.count_nonzero(~self.assembles)} of "
                f"{self.assembles.size} crank angles, largest gap {self.gap.max():.6g} m. "
                "Keep the crank angle inside crank_limits(...)"
            )
        if not self.regular.all():
            raise NoSolution(
                f"coupler and rocker are in line at {np.count_nonzero(~self.regular)} of "
                f"{self.regular.size} crank angles: the crank cannot set "
                "their rates there. Keep away from the limit angles"
            )
        return self


@dataclass(frozen=True)
class FourbarMotion(FourbarPositions):
    """Answer of `solve`: the positions, and rates [rad/s] and accelerations [rad/s2], NaN exactly where `regular` is False."""

    coupler_rate: FloatArray
    rocker_rate: FloatArray
    coupler_accel: FloatArray
    rocker_accel: FloatArray


def positions(
    crank: ArrayLike,
    coupler: ArrayLike,
    rocker: ArrayLike,
    ground: ArrayLike,
    crank_angle: ArrayLike,
    mode: ArrayLike = 1,
) -> FourbarPositions:
    """Coupler and rocker angles for given crank angles; every argument broadcasts. A third cheaper than `solve`.

    With d = D - B and f = |d|: C = B + x d + mode y J d, x = (f^2 + coupler^2 - rocker^2) / (2 f^2),
    y^2 = coupler^2/f^2 - x^2, J d = (-d_y, d_x). Lengths in metres, > 0; mode +1 or -1. Raises MechlabError for bad
    lengths, modes or values that are not finite; poses that do not close are marked, not raised.
    """
    lengths = _lengths(crank, coupler, rocker, ground)
    shape, inputs = flattened(*lengths, _finite("crank_angle", crank_angle), _signs(mode))
    found = _empty(shape, _POSITIONS)
    for part in pieces(math.prod(shape)):
        _triangle([piece(x, part) for x in inputs], part, found)
    return FourbarPositions(**{name: array.reshape(shape) for name, array in found.items()})


def solve(
    crank: ArrayLike,
    coupler: ArrayLike,
    rocker: ArrayLike,
    ground: ArrayLike,
    crank_angle: ArrayLike,
    crank_rate: ArrayLike = 0.0,
    crank_accel: ArrayLike = 0.0,
    mode: ArrayLike = 1,
) -> FourbarMotion:
    """Coupler and rocker motion for a given crank motion; every argument broadcasts.

    The positions are those of `positions`; rates and accelerations follow from the derivatives of
    crank e(phi) + coupler e(theta) - rocker e(psi) = (ground, 0), see `loop_rates`.
    Rates rad/s, accelerations rad/s^2. Raises what `positions` raises.
    """
    lengths = _lengths(crank, coupler, rocker, ground)
    w, eps = _finite("crank_rate", crank_rate), _finite("crank_accel", crank_accel)
    shape, inputs = flattened(*lengths, _finite("crank_angle", crank_angle), _signs(mode), w, eps)
    found = _empty(shape, _POSITIONS + _RATES)
    for part in pieces(math.prod(shape)):
        *given, rate, accel = (piece(x, part) for x in inputs)
        pin, bar, lever, det = _triangle(given, part, found)
        rates = loop_rates(pin, bar, lever, det, given[1], given[2], rate, accel)
        for name, values in zip(_RATES, rates, strict=True):
            found[name][part] = values
    return FourbarMotion(**{name: array.reshape(shape) for name, array in found.items()})


_POSITIONS = ("coupler_angle", "rocker_angle", "transmission_angle", "gap", "assembles", "regular")
_RATES = ("coupler_rate", "rocker_rate", "coupler_accel", "rocker_accel")
Vector = tuple[FloatArray, FloatArray]


def _empty(shape: tuple[int, ...], names: tuple[str, ...]) -> dict[str, Any]:
    """Arrays (n,) to be filled; what is nearly always the same is filled already: no gap, assembles, regular."""
    count = math.prod(shape)
    out: dict[str, Any] = {name: np.empty(count) for name in names}
    out["gap"] = np.zeros(count)
    out["assembles"], out["regular"] = np.ones(count, dtype=bool), np.ones(count, dtype=bool)
    return out


def _triangle(
    given: Sequence[FloatArray], part: slice, found: dict[str, Any]
) -> tuple[Vector, Vector, Vector, FloatArray]:
    """Fills the positions of `part`; returns the vectors A -> B, B -> C, D -> C, and (B -> C) x (D -> C), NaN unless regular."""
    a, b, c, g, phi, sign = given
    pin = a * np.cos(phi), a * np.sin(phi)
    dx, dy = g - pin[0], -pin[1]
    f = np.hypot(dx, dy)  # less rounding than the root of the squares: it counts where coupler and rocker are in line
    f2 = f * f
    longest, least = b + c, b - c
    # Heron's product keeps its digits where coupler and rocker are nearly in line.
    room, first, second = longest - f, f - least, f + least
    product = room * first * second * (longest + f)
    closes: Any = True
    if not (np.min(room, initial=1.0) >= 0.0 and min(np.min(first, initial=1.0), np.min(second, initial=1.0)) > 0.0):
        # Some positions do not close, or B falls on D.
        gap = np.maximum(-np.minimum(room, np.minimum(first, second)), 0.0)
        closes = (gap == 0.0) & (f > 0.0)
        found["gap"][part], found["assembles"][part] = gap, closes
        f2 = np.where(f > 0.0, f2, 1.0)
        product = np.where(closes, np.maximum(product, 0.0), np.nan)
    root = sign * np.sqrt(product)
    half = 0.5 / f2
    x, y = (f2 + least * longest) * half, root * half
    bar = x * dx - y * dy, x * dy + y * dx
    lever = bar[0] - dx, bar[1] - dy
    np.arctan2(bar[1], bar[0], out=found["coupler_angle"][part])
    np.arctan2(lever[1], lever[0], out=found["rocker_angle"][part])
    np.arctan2(np.abs(root), least * least + 2.0 * b * c - f2, out=found["transmission_angle"][part])
    if np.min(product, initial=1.0) > 0.0:  # NaN does not pass
        return pin, bar, lever, 0.5 * root
    regular = product > 0.0
    found["regular"][part] = regular
    return pin, bar, lever, np.where(regular, 0.5 * root, np.nan)


def loop_rates(
    pin: Vector,
    bar: Vector,
    lever: Vector,
    det: FloatArray,
    coupler: float | FloatArray,
    rocker: float | FloatArray,
    rate: FloatArray,
    accel: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Rates of coupler and rocker, then accelerations, of a closed four-bar, for the rate and acceleration of its crank.

    With p = A -> B (pin), r = B -> C (bar), s = D -> C (lever), det = r x s:
    theta' = phi' (s x p) / det, psi' = phi' (r x p) / det,
    theta'' = (phi'' s x p + phi'^2 s . p + theta'^2 r . s - psi'^2 rocker^2) / det,
    psi'' = (phi'' r x p + phi'^2 r . p + theta'^2 coupler^2 - psi'^2 r . s) / det.
    No sine of a small angle is taken, so that the digits near a limit position are those of det.
    """
    (px, py), (rx, ry), (sx, sy) = pin, bar, lever
    inverse = 1.0 / det
    across_s, across_r = (sx * py - sy * px) * inverse, (rx * py - ry * px) * inverse
    theta, psi = rate * across_s, rate * across_r
    theta2, psi2, rate2 = theta * theta, psi * psi, np.square(rate)
    both = rx * sx + ry * sy
    coupler_accel = (
        accel * across_s + (rate2 * (sx * px + sy * py) + theta2 * both - psi2 * np.square(rocker)) * inverse
    )
    rocker_accel = (
        accel * across_r + (rate2 * (rx * px + ry * py) + theta2 * np.square(coupler) - psi2 * both) * inverse
    )
    return theta, psi, coupler_accel, rocker_accel


def _signs(mode: ArrayLike) -> FloatArray:
    sign = _finite("mode", mode)
    if np.any(np.abs(sign) != 1.0):
        raise MechlabError(f"mode = {mode!r}; expected +1 (C left of the way from crank pin to rocker pivot) or -1")
    return sign


def _lengths(crank: ArrayLike, coupler: ArrayLike, rocker: ArrayLike, ground: ArrayLike) -> list[FloatArray]:
    lengths = []
    for name, value in (("crank", crank), ("coupler", coupler), ("rocker", rocker), ("ground", ground)):
        array = _finite(name, value)
        if np.any(array <= 0.0):
            raise MechlabError(f"{name} = {value!r}; expected a length greater than zero")
        lengths.append(array)
    return lengths


def _finite(name: str, value: ArrayLike) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if not np.all(np.isfinite(array)):
        raise MechlabError(f"{name} holds values that are not finite; expected finite numbers")
    return array


class GrashofClass(Enum):
    """Kind of four-bar by Grashof's condition; the value is a sentence."""

    CRANK_ROCKER = "crank-rocker: the crank turns fully, the rocker swings"
    DOUBLE_CRANK = "double crank: crank and rocker both turn fully"
    ROCKER_CRANK = "rocker-crank: the crank swings, the rocker turns fully"
    DOUBLE_ROCKER = "double rocker: crank and rocker swing, the coupler turns fully"
    TRIPLE_ROCKER = "triple rocker: no link turns fully against another"
    CHANGE_POINT = "change point: all links can lie on one line, where the modes meet"


@dataclass(frozen=True)
class CrankLimits:
    """Range of the crank angle, radians, the same for both modes.

    full_turn: every angle assembles. ranges: intervals (low, high) that assemble, low in [-pi, pi], high > low; the
    crank cannot pass from one to another. limit_angles: where the crank stops because coupler and rocker are in line,
    in (-pi, pi]. change_points: angles where all links lie on one line and the modes meet.
    """

    full_turn: bool
    ranges: tuple[tuple[float, float], ...]
    limit_angles: tuple[float, ...]
    change_points: tuple[float, ...]


def grashof_class(crank: float, coupler: float, rocker: float, ground: float, tolerance: float = 1e-12) -> GrashofClass:
    """Class from shortest + longest against the other two (Grashof 1883). tolerance is relative to the sum of lengths.

    Raises NoSolution if one link is longer than the other three together.
    """
    _scalar_lengths(crank, coupler, rocker, ground)
    lengths = {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground}
    shortest = min(lengths, key=lambda name: lengths[name])
    total = sum(lengths.values())
    excess = 2.0 * (lengths[shortest] + max(lengths.values())) - total
    if abs(excess) <= tolerance * total:
        return GrashofClass.CHANGE_POINT
    if excess > 0.0:
        return GrashofClass.TRIPLE_ROCKER
    return {
        "crank": GrashofClass.CRANK_ROCKER,
        "ground": GrashofClass.DOUBLE_CRANK,
        "rocker": GrashofClass.ROCKER_CRANK,
        "coupler": GrashofClass.DOUBLE_ROCKER,
    }[shortest]


def crank_limits(crank: float, coupler: float, rocker: float, ground: float, tolerance: float = 1e-12) -> CrankLimits:
    """Crank angles at which the loop closes: |coupler - rocker| <= f <= coupler + rocker.

    f^2 = crank^2 + ground^2 - 2 crank ground cos(phi). A cosine within `tolerance` of +-1 counts as a change point.
    Raises NoSolution if no crank angle closes the loop.
    """
    _scalar_lengths(crank, coupler, rocker, ground)
    scale = 2.0 * crank * ground
    square = crank**2 + ground**2
    highest = (square - (coupler - rocker) ** 2) / scale
    lowest = (square - (coupler + rocker) ** 2) / scale
    change = [
        angle for angle, cosine in ((0.0, highest), (math.pi, lowest)) if abs(cosine - math.cos(angle)) <= tolerance
    ]
    inner = math.acos(max(highest, -1.0)) if highest < 1.0 - tolerance else 0.0
    outer = math.acos(min(lowest, 1.0)) if lowest > -1.0 + tolerance else math.pi
    limits = [angle for angle in (inner, outer) if 0.0 < angle < math.pi]
    both = tuple(sorted({sign * angle for angle in limits for sign in (-1.0, 1.0)}))
    if inner == 0.0 and outer == math.pi:
        ranges: tuple[tuple[float, float], ...] = ((-math.pi, math.pi),)
    elif inner == 0.0:
        ranges = ((-outer, outer),)
    elif outer == math.pi:
        ranges = ((inner, 2.0 * math.pi - inner),)
    else:
        ranges = ((-outer, -inner), (inner, outer))
    return CrankLimits(inner == 0.0 and outer == math.pi, ranges, both, tuple(change))


def _scalar_lengths(crank: float, coupler: float, rocker: float, ground: float) -> None:
    _lengths(crank, coupler, rocker, ground)
    longest = max(crank, coupler, rocker, ground)
    rest = crank + coupler + rocker + ground - longest
    if longest > rest:
        raise NoSolution(
            f"one link of {longest:g} m is longer than the other three together ({rest:g} m): "
            f"the four-bar never closes, short by {longest - rest:.6g} m"
        )
