"""Positions, rates and accelerations of the planar four-bar; which links turn fully, and where the crank can move.

A = (0, 0) crank pivot, D = (ground, 0) rocker pivot, B crank pin, C coupler-rocker joint. Angles run from the ground
line A -> D, counter-clockwise: crank A -> B, coupler B -> C, rocker D -> C. mode +1: C lies left of the line B -> D.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, NoSolution

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class FourbarMotion:
    """Answer of `solve`; all arrays in the broadcast shape of the inputs.

    coupler_angle, rocker_angle: radians in (-pi, pi], NaN exactly where `assembles` is False; np.unwrap along a path
    makes them continuous. coupler_rate, rocker_rate, coupler_accel, rocker_accel: NaN exactly where `regular` is False.
    transmission_angle: angle BCD in [0, pi], NaN where it does not assemble. gap [m]: how far the lengths are from
    closing (0 where they close). assembles: the loop closes in one point C. regular: it closes and coupler and
    rocker are not in line, so that rates exist. Where B falls on D, C is undetermined: assembles is False and gap is
    |coupler - rocker|.
    """

    coupler_angle: FloatArray
    rocker_angle: FloatArray
    coupler_rate: FloatArray
    rocker_rate: FloatArray
    coupler_accel: FloatArray
    rocker_accel: FloatArray
    transmission_angle: FloatArray
    gap: FloatArray
    assembles: BoolArray
    regular: BoolArray

    def require(self) -> FourbarMotion:
        """The motion itself; raises NoSolution where the loop does not close or rates do not exist."""
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

    With d = D - B and f = |d|: C = B + x d + mode y J d, x = (f^2 + coupler^2 - rocker^2) / (2 f^2),
    y^2 = coupler^2/f^2 - x^2, J d = (-d_y, d_x). Rates and accelerations follow from the derivatives of
    crank e(phi) + coupler e(theta) - rocker e(psi) = (ground, 0).
    Lengths in metres, > 0; mode +1 or -1; rates rad/s, accelerations rad/s^2. Raises MechlabError for bad lengths,
    modes or values that are not finite; poses that do not close are marked, not raised.
    """
    a, b, c, g = _lengths(crank, coupler, rocker, ground)
    phi, sign = _finite("crank_angle", crank_angle), _finite("mode", mode)
    w, eps = _finite("crank_rate", crank_rate), _finite("crank_accel", crank_accel)
    if np.any(np.abs(sign) != 1.0):
        raise MechlabError(f"mode = {mode!r}; expected +1 (C left of the way from crank pin to rocker pivot) or -1")
    a, b, c, g, phi, w, eps, sign = np.broadcast_arrays(a, b, c, g, phi, w, eps, sign)
    bx, by = a * np.cos(phi), a * np.sin(phi)
    dx, dy = g - bx, -by
    f = np.hypot(dx, dy)
    gap = np.maximum(np.maximum(f - (b + c), np.abs(b - c) - f), 0.0)
    assembles = (gap == 0.0) & (f > 0.0)
    f2 = np.where(f > 0.0, f * f, 1.0)
    x = (f2 + (b - c) * (b + c)) / (2.0 * f2)
    # Heron's product keeps its digits where coupler and rocker are nearly in line.
    product = np.maximum((b + c - f) * (f - b + c) * (f + b - c), 0.0) * (b + c + f)
    y = sign * np.sqrt(product) / (2.0 * f2)
    ux, uy = x * dx - y * dy, x * dy + y * dx
    theta = np.where(assembles, np.arctan2(uy, ux), np.nan)
    psi = np.where(assembles, np.arctan2(uy - dy, ux - dx), np.nan)
    transmission = np.where(assembles, np.arctan2(np.sqrt(product), (b - c) ** 2 + 2.0 * b * c - f2), np.nan)
    regular = assembles & (product > 0.0)
    det = np.where(regular, np.sin(psi - theta), 1.0)
    theta_rate = a * w * np.sin(phi - psi) / (b * det)
    psi_rate = a * w * np.sin(phi - theta) / (c * det)
    # Loop acceleration along e(psi) and e(theta) in turn.
    rest = a * (eps * np.sin(phi - psi) + w**2 * np.cos(phi - psi))
    theta_accel = (rest + b * theta_rate**2 * np.cos(theta - psi) - c * psi_rate**2) / (b * det)
    rest = a * (eps * np.sin(phi - theta) + w**2 * np.cos(phi - theta))
    psi_accel = (rest + b * theta_rate**2 - c * psi_rate**2 * np.cos(psi - theta)) / (c * det)
    return FourbarMotion(
        coupler_angle=theta,
        rocker_angle=psi,
        coupler_rate=np.where(regular, theta_rate, np.nan),
        rocker_rate=np.where(regular, psi_rate, np.nan),
        coupler_accel=np.where(regular, theta_accel, np.nan),
        rocker_accel=np.where(regular, psi_accel, np.nan),
        transmission_angle=transmission,
        gap=np.asarray(gap),
        assembles=np.asarray(assembles),
        regular=np.asarray(regular),
    )


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
