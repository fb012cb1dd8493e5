"""What the output of the three-gear four-bar does in a turn of the crank: regimes (monotone, momentary dwell, reversing) and
dwell angles, and the crank that gives a wanted one; the reduced inertia of the crank and its acceleration.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.blocks import FloatArray
from mechlab.analytic.gear_linkage.linkage import GearLinkage, LinkageMotion, angles, longest_crank, motion, transfer
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.lazy_dataclass import dataclass

NEAREST = 1.0 - 1e-6
"""Longest crank that is tried, as a share of the longest that turns: beyond it no usable transmission angle is left."""
TARGETS = ("reverse_angle", "dwell_angle", "dwell_angle_one_sided")


@dataclass(frozen=True)
class LinkageMasses:
    """Masses: uniform slender bars [kg/m] and uniform discs [kg/m2] for the three gears (gear a belongs to the crank); moment of
    inertia [kg m2] of what the output gear drives."""

    per_length: float
    per_area: float
    load: float = 0.0

    def disc(self, radius: float) -> tuple[float, float]:
        """Mass [kg] and moment about the axis [kg m2] of a gear of that pitch radius."""
        mass = self.per_area * np.pi * radius**2
        return float(mass), float(0.5 * mass * radius**2)


def reduced_inertia(g: GearLinkage, masses: LinkageMasses, crank_angle: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """J [kg m2] and dJ/d(crank angle): kinetic energy = J crank_rate^2 / 2. (...) -> (...), (...).

    J = J_crank + J_a + m_a crank^2 + (coupler and idler: m |v_G|^2 + J w^2) + J_rocker w_rocker^2 + (J_d + load) w_out^2, rates for
    a crank rate of 1.
    """
    phi = np.asarray(crank_angle, dtype=float)
    return _reduced(g, masses, phi, motion(g, phi))


def _reduced(g: GearLinkage, masses: LinkageMasses, phi: FloatArray, x: LinkageMotion) -> tuple[FloatArray, FloatArray]:
    ra, rc, rd = g.radii
    (ma, ja), (mc, jc), (_, jd) = masses.disc(ra), masses.disc(rc), masses.disc(rd)
    m1, m2, m3 = (masses.per_length * length for length in (g.crank, g.coupler, g.rocker))
    inertia = np.full(phi.shape, m1 * g.crank**2 / 3.0 + ja + ma * g.crank**2)
    slope = np.zeros(phi.shape)
    turned, turned_rate = g.crank * _across(phi), g.crank * -_along(phi)
    for mass, moment, arm, w, e in (
        (m2, m2 * g.coupler**2 / 12.0, 0.5 * g.coupler, x.coupler_rate, x.coupler_accel),
        (mc, 0.0, g.coupler, x.coupler_rate, x.coupler_accel),
    ):
        v = turned + (arm * w)[..., None] * _across(x.coupler_angle)
        a = (
            turned_rate
            + (arm * e)[..., None] * _across(x.coupler_angle)
            - (arm * w**2)[..., None] * _along(x.coupler_angle)
        )
        inertia = inertia + mass * np.sum(v * v, axis=-1) + moment * w**2
        slope = slope + 2.0 * (mass * np.sum(v * a, axis=-1) + moment * w * e)
    for moment, w, e in (
        (jc, x.idler_rate, x.idler_accel),
        (m3 * g.rocker**2 / 3.0, x.rocker_rate, x.rocker_accel),
        (jd + masses.load, x.output_rate, x.output_accel),
    ):
        inertia = inertia + moment * w**2
        slope = slope + 2.0 * moment * w * e
    return inertia, slope


def acceleration(
    g: GearLinkage, masses: LinkageMasses, crank_angle: ArrayLike, crank_rate: ArrayLike, torque: ArrayLike = 0.0, drag: float = 0.0
) -> FloatArray:
    """Crank acceleration [rad/s2] under a torque on the crank [N m] and a drag on the output [N m s/rad]:
    J a + dJ/dphi w^2 / 2 = torque - drag w_out^2 w, w_out for a crank rate of 1 (Eksergian 1930)."""
    phi, w = np.asarray(crank_angle, dtype=float), np.asarray(crank_rate, dtype=float)
    x = motion(g, phi)
    inertia, slope = _reduced(g, masses, phi, x)
    braked = np.asarray(torque, dtype=float) - drag * w * x.output_rate**2
    return np.asarray((braked - 0.5 * slope * w**2) / inertia)


def _along(angle: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _across(angle: FloatArray) -> FloatArray:
    return np.stack([-np.sin(angle), np.cos(angle)], axis=-1)


TURN = 2.0 * math.pi
DWELL_TOLERANCE = 1e-9


class OutputRegime(Enum):
    """How the output moves while the crank turns uniformly; the value is a sentence."""

    MONOTONE = "monotone: the output never stops"
    MOMENTARY_DWELL = "momentary dwell: the output stops for an instant and goes on"
    REVERSING = "reversing: the output runs back for a part of each turn"


@dataclass(frozen=True)
class RegimeReport:
    """Motion of the output in one turn of the crank.

    slowest_rate, fastest_rate: smallest and largest output rate for a crank rate of 1; slowest_angle, fastest_angle:
    at which crank angle. reverse_angle: how far the output runs back [rad] (0 unless reversing), while the crank turns
    by dwell_angle from stop_angle to turn_angle; dwell_angle_one_sided: crank angle from stop_angle until the output is
    back where it stopped: over it an output with enough play stands still, if friction holds it.
    least_transmission_angle: smallest angle between coupler and rocker, taken acute [rad].
    """

    regime: OutputRegime
    slowest_rate: float
    slowest_angle: float
    fastest_rate: float
    fastest_angle: float
    stop_angle: float
    turn_angle: float
    reverse_angle: float
    dwell_angle: float
    dwell_angle_one_sided: float
    least_transmission_angle: float


def rate(g: GearLinkage, phi: ArrayLike) -> FloatArray:
    """Output rate for a crank rate of 1."""
    return motion(g, phi).output_rate


def grid(g: GearLinkage) -> FloatArray:
    """Crank angles of one turn, closer around 0 and pi: near a change point rates peak there, in a width
    sqrt(1 - crank / longest crank)."""
    close = np.geomspace(1e-7, 0.1, 80)
    parts = [np.linspace(0.0, TURN, 721)[:-1], close, TURN - close, math.pi - close, math.pi + close]
    return np.unique(np.concatenate(parts))


def slowest(g: GearLinkage, sign: float = 1.0) -> tuple[float, float]:
    """Crank angle [rad, in 0 .. 2 pi] and smallest output rate for a crank rate of 1 (sign -1: the largest)."""
    phi = grid(g)
    w = sign * rate(g, phi)
    k = int(np.nanargmin(w))
    low = phi[k - 1] - (TURN if k == 0 else 0.0)
    high = phi[(k + 1) % len(phi)] + (TURN if k == len(phi) - 1 else 0.0)

    def slope(x: float) -> float:
        return sign * float(motion(g, x).output_accel)

    at = float(phi[k])
    if slope(low) < 0.0 < slope(high):
        at = float(brentq(slope, low, high, xtol=1e-15, rtol=1e-15))
    return at % TURN, float(rate(g, at))


@lru_cache(maxsize=64)
def regime(g: GearLinkage) -> RegimeReport:
    """Regime of the output and its numbers, see `RegimeReport`."""
    at, least = slowest(g)
    fastest_at, greatest = slowest(g, -1.0)
    mu = motion(g, [0.0, math.pi]).transmission_angle
    acute = float(np.min(np.minimum(mu, math.pi - mu)))
    scale = max(abs(greatest), g.ratio)
    kind = OutputRegime.MONOTONE
    stop = turn = at
    back = dwell = one_sided = 0.0
    if abs(least) <= DWELL_TOLERANCE * scale:
        kind = OutputRegime.MOMENTARY_DWELL
    elif least < 0.0:
        kind = OutputRegime.REVERSING
        stop, turn = _edge(g, at, -1.0), _edge(g, at, 1.0)
        back = float(_angle(g, stop) - _angle(g, turn))
        dwell = turn - stop
        stopped = _angle(g, stop)
        regained = brentq(lambda x: float(_angle(g, x) - stopped), turn, stop + TURN, xtol=1e-15, rtol=1e-15)
        one_sided = float(regained) - stop
    return RegimeReport(kind, least, at, greatest, fastest_at, stop, turn, back, dwell, one_sided, acute)


def _angle(g: GearLinkage, phi: ArrayLike) -> FloatArray:
    """The output angle, as in `motion`, without the rates of all parts."""
    of_crank, of_coupler, of_rocker = transfer(g)[1]
    (psi, chi, _), (psi0, chi0, _) = angles(g, phi), angles(g, 0.0)
    return np.asarray(of_crank * np.asarray(phi) + of_coupler * (psi - psi0) + of_rocker * (chi - chi0))


def _edge(g: GearLinkage, at: float, side: float) -> float:
    """Crank angle of the zero of the output rate nearest to its minimum `at`; side +1: after it, -1: before."""
    ways = side * (grid(g) - at) % TURN
    ways = np.sort(ways[ways > 0.0])
    w = rate(g, at + side * ways)
    k = int(np.argmax(w > 0.0))
    low = 0.0 if k == 0 else float(ways[k - 1])
    found = brentq(lambda x: float(rate(g, at + side * x)), low, float(ways[k]), xtol=1e-15, rtol=1e-15)
    return at + side * float(found)


def with_play(angle: ArrayLike, backlash: float, start: float | None = None) -> FloatArray:
    """Angle of an output that the gears only push, with play `backlash` [rad]; friction holds it where nothing pushes.

    angle (n,) [rad]: that of the output without play, along the motion; start: the first value of the answer (default:
    angle[0]). y_k = min(max(y_(k-1), x_k), x_k + backlash). (n,) -> (n,).
    """
    x = np.asarray(angle, dtype=float)
    out = np.empty_like(x)
    y = float(x[0]) if start is None else start
    for k, here in enumerate(x.tolist()):
        y = min(max(y, here), here + backlash)
        out[k] = y
    return out


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


@lru_cache(maxsize=64)
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
