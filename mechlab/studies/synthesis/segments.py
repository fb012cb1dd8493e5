"""Synthesis of straight lines: a search for coupler curves with a straight part; what dwells share with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.path_synthesis.straight import StraightFourbar, coupler_turn, straight_fourbars
from mechlab.mechanism.newton import Status
from mechlab.progress import counted, part
from mechlab.studies.synthesis.built import Built, led, rounded
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.result import SynthesisResult

PLACES = 61
"""Crank angles of the straight part, or of the dwell, at which an engine measures it."""
CLOSE = 1e-7
"""Largest difference between the engine's deviation and that of the closed form, relative to the stroke, or [rad]."""


def straight_line(given: Given) -> SynthesisResult:
    """Crank-rockers whose coupler point goes straight along the x axis, from 0: see `mechlab.analytic.path_synthesis.straight`."""
    length = given.number("length", "m")
    if not length > 0.0:
        raise given.refuse("length", "a length above 0 m")
    angle = given.within("angle", "rad", np.pi, np.radians(20.0), np.radians(300.0))
    size, least = given.within("size", "", 1.5 * max(1.0, np.pi / angle), 0.5, 50.0), least_of(given)
    limit = given.integer("limit", 3, 1, 9)
    found = straight_fourbars(angle, size, least, part(given.progress, 0, 60))
    built = [_line_of(f, angle, length) for f in found[:limit]]
    solutions = []
    for f, b in counted(list(zip(found, built, strict=False)), part(given.progress, 60, 100)):
        seen = led(given.find, b, ("P_x", "P_z"))
        if seen is None:
            continue
        witness, at = seen
        deviation = float(np.ptp(at["P_z"])) if witness else f.deviation * length
        if abs(deviation - f.deviation * length) > CLOSE * length + 0.02 * f.deviation * length:
            continue  # between the places of the engine the closed form may lie a little further out
        facts = {
            "deviation": f.deviation * length, "deviation_over_length": f.deviation, "measured_deviation": deviation,
            "measured_by": witness or "closed form", "least_transmission_angle": f.least_transmission_angle, "longest": f.longest * length,
        }  # fmt: skip
        # the whole turn, beginning with the line
        whole = rounded(dict(b.parameters) | {"turn": 2.0 * np.pi})
        solutions.append(replace(b, parameters=whole, facts=facts).to_dict())
    data = {"count": len(solutions), "solutions": solutions, "left_out": {"engine": len(built) - len(solutions)}, "angle": angle}
    if not solutions:
        text = nothing("crank-rocker guides a point straight", least, size, "lengths")
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    best = solutions[0]
    text = (
        f"a crank-rocker guides its coupler point along {length:g} m within a strip of {best['deviation']:.4g} m "
        f"({100 * best['deviation_over_length']:.3g} % of the length) while the crank turns through {np.degrees(angle):g} deg"
    )
    bars = ("crank", "coupler", "rocker", "ground", "point")
    return shown(given, text, data, bars, ("deviation", "least_transmission_angle", "longest"))


def least_of(given: Given) -> float:
    """The smallest transmission angle that is asked for [rad]."""
    return given.within("transmission_angle_min", "rad", np.radians(30.0), np.radians(1.0), np.radians(75.0))


def nothing(what: str, least: float, size: float, unit: str) -> str:
    """The sentence that nothing was found."""
    return (
        f"no {what} with a transmission angle of {np.degrees(least):.3g} deg and bars up to {size:g} {unit}; "
        "try a smaller angle, a smaller transmission_angle_min, or a larger size"
    )


def shown(given: Given, text: str, data: dict[str, Any], bars: Sequence[str], facts: Sequence[str]) -> SynthesisResult:
    """The result with a row of parameters and facts for each solution."""
    rows = tuple((*(s["parameters"][k] for k in bars), *(s[n] for n in facts)) for s in data["solutions"])
    return SynthesisResult(given.task, Status.SOLVED, text, data, (*bars, *facts), rows, tuple(s["command"] for s in data["solutions"]))


def _line_of(f: StraightFourbar, angle: float, length: float) -> Built:
    """The four-bar in its size, its line on the x axis from 0 to `length`, led along it."""
    turned = np.exp(-1j * f.direction)
    t = f.middle + np.linspace(-0.5, 0.5, PLACES) * angle
    bars = np.array([[f.coupler, f.rocker, f.ground]])
    line = (np.exp(1j * t) + f.point * coupler_turn(bars, t[None])[0]) * turned
    scale = length / f.stroke
    o = -scale * complex(line.real.min(), 0.5 * (line.imag.min() + line.imag.max()))
    crank = t - f.direction
    return Built("path_fourbar", rounded({
        "pivot_x": o.real, "pivot_y": o.imag, "tilt": float(np.angle(turned)), "crank": scale, "coupler": f.coupler * scale,
        "rocker": f.rocker * scale, "ground": f.ground * scale, "mode": 1, "point": abs(f.point) * scale,
        "point_angle": float(np.angle(f.point)), "first": float(crank[0]), "turn": angle,
    }), crank)  # fmt: skip
