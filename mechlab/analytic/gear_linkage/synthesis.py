"""The crank that gives a three-gear four-bar a wanted dwell: output rate zero, reverse angle, dwell angle."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scipy.optimize import brentq

from mechlab.analytic.gear_linkage.linkage import GearLinkage, longest_crank
from mechlab.analytic.gear_linkage.regime import regime, slowest
from mechlab.errors import MechlabError, NoSolution, unknown

NEAREST = 1.0 - 1e-6
"""Longest crank that is tried, as a share of the longest that turns: beyond it no usable transmission angle is left."""
TARGETS = ("reverse_angle", "dwell_angle", "dwell_angle_one_sided")


@dataclass(frozen=True)
class CrankForTarget:
    """A crank [m] for a target; `reachable`: smallest and largest value of the target with these gears [rad], from
    `momentary_crank` to `longest` [m]. crank is None when the target is out of reach."""

    target: str
    wanted: float
    crank: float | None
    reachable: tuple[float, float]
    momentary_crank: float
    longest: float


def momentary_crank(coupler: float, rocker: float, idler_radius: float, frame: float = 1.0, mode: int = 1) -> float:
    """Crank [m] at which the smallest output rate is zero: longer ones make the output run back.

    Raises NoSolution when no crank turns fully, or none that turns fully stops the output.
    """
    top = longest_crank(coupler, rocker, frame) * NEAREST
    # A crank of length 0 makes GearLinkage raise for every other fault, also when no crank can turn fully.
    g = GearLinkage(0.0, coupler, rocker, idler_radius, frame, mode)

    def least(crank: float) -> float:
        return slowest(replace(g, crank=crank))[1]

    if least(top) > 0.0:
        raise NoSolution(
            f"no crank up to {top:.6g} m stops the output: its smallest rate stays {least(top):.6g} of the crank's. "
            "Try a smaller idler_radius, or a shorter coupler against the rocker"
        )
    return float(brentq(least, 1e-9 * top, top, xtol=1e-15, rtol=1e-15))


def crank_for(
    target: str, wanted: float, coupler: float, rocker: float, idler_radius: float, frame: float = 1.0, mode: int = 1
) -> CrankForTarget:
    """The crank for a reverse_angle, dwell_angle or dwell_angle_one_sided [rad]: each grows with the crank from 0 at the
    momentary dwell to its value next to the change point.

    Raises MechlabError for an unknown target or a negative value, NoSolution when no crank stops the output.
    """
    if target not in TARGETS:
        raise unknown("target", target, TARGETS)
    if not 0.0 <= wanted < float("inf"):
        raise MechlabError(f"{target} = {wanted!r}; expected an angle of at least zero")
    low = momentary_crank(coupler, rocker, idler_radius, frame, mode)
    top = longest_crank(coupler, rocker, frame) * NEAREST
    g = GearLinkage(low, coupler, rocker, idler_radius, frame, mode)

    def value(crank: float) -> float:
        return float(getattr(regime(replace(g, crank=crank)), target))

    reach = value(top)
    if wanted > reach:
        return CrankForTarget(target, wanted, None, (0.0, reach), low, top)
    if wanted == 0.0:
        return CrankForTarget(target, wanted, low, (0.0, reach), low, top)
    crank = float(brentq(lambda x: value(x) - wanted, low, top, xtol=1e-15, rtol=1e-15))
    return CrankForTarget(target, wanted, crank, (0.0, reach), low, top)
