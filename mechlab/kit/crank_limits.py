"""The range of the crank of a four-bar: a start angle, a remark, and checks of the limits and of the gap beyond
them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mechlab.analytic import fourbar as closed_form
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.checks import range_ends

Lengths = tuple[float, float, float, float]
ROCKS: tuple[Lengths, ...] = ((1.0, 0.8, 0.5, 1.1), (0.9, 0.6, 1.2, 1.0))
"""Crank, coupler, rocker, ground [m] of two four-bars whose crank rocks without a full turn."""


def start_angle(lengths: Lengths) -> float:
    """Crank angle [rad] in the middle of the range in which the four-bar assembles; 1 rad when the crank turns
    fully."""
    limits = closed_form.crank_limits(*lengths)
    low, high = limits.ranges[0] if limits.ranges else (1.0, 1.0)
    return 1.0 if limits.full_turn else 0.5 * (low + high)


def remark(lengths: Lengths) -> str:
    """A sentence: Grashof's class and, unless the crank turns fully, the crank angles at which the four-bar
    assembles."""
    limits = closed_form.crank_limits(*lengths)
    arcs = ", ".join(f"{math.degrees(a):.6g} to {math.degrees(b):.6g} deg" for a, b in limits.ranges)
    swing = "" if limits.full_turn else f"; it assembles at crank angles {arcs}" if arcs else "; it assembles nowhere"
    return f"Grashof: {closed_form.grashof_class(*lengths).value}{swing}."


def limits_check(id: str, lengths: Callable[[Any], Lengths]) -> Check:
    """A check of the crank limits of this four-bar and of ROCKS: the closed form against a search for the limits."""

    def run(p: Any) -> CheckResult:
        expected, found = [], list[float]()
        for crank, coupler, rocker, ground in (lengths(p), *ROCKS):

            def closes(x: float, a: float = crank, b: float = coupler, c: float = rocker, g: float = ground) -> bool:
                return abs(b - c) <= math.hypot(g - a * math.cos(x), a * math.sin(x)) <= b + c

            for low, high in closed_form.crank_limits(crank, coupler, rocker, ground).ranges:
                expected += [low, high]
                found += range_ends(closes, 0.5 * (low + high), math.pi)
        # Where the bars are in line the limit is only known to the root of the closure error: sqrt(1e-12).
        return CheckResult({"tried": found}, 1e-6, expected, "ends of the ranges of the crank [rad]")

    return Check(id, "range of the crank", run, "by trying")


def gap_check(id: str, lengths: Callable[[Any], Lengths], mode: Callable[[Any], int]) -> Check:
    """A check of the transmission angle, and of the gap where no assembly exists, by the law of cosines in triangle
    BCD; for this four-bar and one that rocks."""

    def run(p: Any) -> CheckResult:
        values, expected, phi = list[Any](), list[Any](), np.linspace(-3.0, 3.0, 13)
        for crank, coupler, rocker, ground in (lengths(p), ROCKS[0]):
            found = closed_form.solve(crank, coupler, rocker, ground, phi, mode=mode(p))
            far = np.abs(ground - crank * np.exp(1j * phi))
            missing = np.maximum(np.maximum(far - coupler - rocker, abs(coupler - rocker) - far), 0.0)
            cosine = (coupler**2 + rocker**2 - far**2) / (2.0 * coupler * rocker)
            values += [np.where(found.assembles, found.transmission_angle, 0.0), found.gap]
            expected += [np.where(missing > 0.0, 0.0, np.arccos(np.clip(cosine, -1.0, 1.0))), missing]
        # Where the bars are in line rounding of the cosine changes the angle by its root: sqrt(1e-16).
        return CheckResult({"analytic": values}, 1e-7, expected, "transmission angle [rad], gap [m] at 13 crank angles")

    return Check(id, "transmission angle and gap", run, "law of cosines")
