"""Checks L11 and L12 of the three-gear four-bar: its regime and its transmission angle from samples of rolling alone."""

from __future__ import annotations

import math
from dataclasses import astuple, replace

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.parameters import Parameters
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism.geometry import Array

SAMPLES = 40_001
BACK = math.radians(2.0)
"""The crank is the one whose output runs back so far [rad]."""


def _transmission(g: closed_form.GearLinkage, phi: Array) -> Array:
    """Angle BCD by the law of cosines."""
    square = g.crank**2 + g.frame**2 - 2.0 * g.crank * g.frame * np.cos(phi)
    return np.asarray(np.arccos((g.coupler**2 + g.rocker**2 - square) / (2.0 * g.coupler * g.rocker)))


def _sampled(g: closed_form.GearLinkage) -> list[float]:
    """The numbers of a RegimeReport of an output that runs back, from its rates by rolling over a turn."""
    phi = np.linspace(0.0, 2.0 * math.pi, SAMPLES)
    w = closed_form.rolling_rates(g, phi)[1]
    least, least_at = _extreme(phi, w)
    most, most_at = _extreme(phi, -w)
    turn = phi - math.pi + least_at  # one turn around the slowest place
    w = closed_form.rolling_rates(g, turn)[1]
    moved = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1]) * np.diff(turn))])
    signs = np.flatnonzero(np.diff(np.sign(w)))
    stop, back = (float(turn[k] - w[k] * (turn[k + 1] - turn[k]) / (w[k + 1] - w[k])) for k in signs[[0, -1]])
    place, low = (float(np.interp(x, turn, moved)) for x in (stop, back))
    late = turn > back
    regained = float(np.interp(place, moved[late], turn[late]))
    mu = _transmission(g, phi)
    acute = float(np.min(np.minimum(mu, math.pi - mu)))
    return [least, least_at, -most, most_at, stop, back, place - low, back - stop, regained - stop, acute]


def _extreme(phi: Array, w: Array) -> tuple[float, float]:
    """Smallest value and its place, by the parabola through the three lowest of a periodic table."""
    k = int(np.argmin(w[:-1]))
    before, here, after = w[k - 1 if k else -2], w[k], w[k + 1]
    bend = before - 2.0 * here + after
    step = 0.5 * (before - after) / bend
    return float(here - 0.5 * bend * step**2), float(phi[k] + step * (phi[1] - phi[0])) % (2.0 * math.pi)


def _regime(p: Parameters) -> CheckResult:
    g = p.linkage
    found = closed_form.crank_for("reverse_angle", BACK, g.coupler, g.rocker, g.idler_radius, g.frame, g.mode)
    if found.crank is None:
        raise MechlabError(f"gear_linkage: no crank lets the output of these gears run back by {BACK:.4g} rad.")
    reversing = replace(g, crank=found.crank)
    report = astuple(closed_form.regime(reversing))[1:]
    # Parabolas and chords over steps of 1.6e-4 rad: 1e-8 of second derivatives, which grow towards a change point.
    return CheckResult(
        {"closed form": report}, 1e-5, _sampled(reversing), "RegimeReport of a crank that runs back by 2 deg"
    )


def _reach(p: Parameters) -> CheckResult:
    """The transmission angle over a turn, and what `crank_for` tells besides the crank."""
    g, phi = p.linkage, np.linspace(0.0, 2.0 * math.pi, 101)
    found = closed_form.crank_for("reverse_angle", BACK, g.coupler, g.rocker, g.idler_radius, g.frame, g.mode)
    at_rest = replace(g, crank=found.momentary_crank)
    longest = min(g.coupler + g.rocker - g.frame, g.frame - abs(g.coupler - g.rocker)) * (1.0 - 1e-6)
    stops = float(np.min(closed_form.rolling_rates(at_rest, np.linspace(0.0, 2.0 * math.pi, SAMPLES))[1]))
    most = closed_form.regime(replace(g, crank=longest)).reverse_angle
    said = [found.wanted, found.longest, *found.reachable, stops, *closed_form.motion(g, phi).transmission_angle]
    expected = [BACK, longest, 0.0, most, 0.0, *_transmission(g, phi)]
    # The smallest of 40001 samples lies 1e-8 of a second derivative above the minimum; arccos keeps half the digits at 0.
    return CheckResult(
        {"closed form": said}, 1e-6, expected, "reach of the synthesis, rest of its shortest crank, angles BCD"
    )


REGIME_CHECKS = (
    Check("L11", "regime of a reversing crank against samples", _regime, "rolling at the pitch points, sampled"),
    Check("L12", "reach of the synthesis and transmission angle", _reach, "law of cosines; rolling, sampled"),
)
