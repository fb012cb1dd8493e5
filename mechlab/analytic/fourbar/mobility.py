"""Which links of a four-bar turn fully, and between which angles the crank can move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from mechlab.analytic.fourbar.kinematics import _lengths
from mechlab.errors import NoSolution


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
