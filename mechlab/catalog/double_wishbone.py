"""A double wishbone suspension in the plane of the axle: camber over the travel of the wheel."""

from __future__ import annotations

import cmath

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry, speeds
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Lower arm O-A, upper arm D-B shorter, upright A-B with the wheel centre W outside."""

    lower: float = parameter(0.38, "m", "lower arm", low=0, strict=True)
    upper: float = parameter(0.26, "m", "upper arm", low=0, strict=True)
    upright: float = parameter(0.3, "m", "upright A-B", low=0, strict=True)
    inward: float = parameter(0.08, "m", "upper pivot outside the lower one, x")
    above: float = parameter(0.28, "m", "upper pivot above the lower one", low=0, strict=True)
    bump: float = parameter(0.25, "rad", "travel of the lower arm, up and down", low=0, high=0.5, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the wheel centre."""
    return (
        Linkage("double_wishbone").pivot("O", 0.0, 0.0).pivot("D", p.inward, p.above)
        .crank("lower", "O", "A", p.lower)
        .rrr("B", ("upright", "upper"), ("A", "D"), (p.upright, p.upper), -1)
        .point("W", "upright", 0.16, -0.9)
    )  # fmt: skip


def upright(p: Parameters, t: float) -> complex:
    """From A to B with the lower arm at t, by compasses."""
    a = at(p.lower, t)
    return meet(a, p.upright, complex(p.inward, p.above), p.upper, -1) - a


def pole(p: Parameters) -> float:
    """The upright turns about the crossing of the arms: -lower / (distance of A from there), with the lower arm level."""
    arm = complex(p.lower, 0.0) + upright(p, 0.0) - complex(p.inward, p.above)
    return -p.lower / (p.inward - p.above * arm.real / arm.imag - p.lower)


ENTRY = planar_entry(
    "double_wishbone", "Double wishbone", "suspension",
    summary="Two unequal arms guide the upright: the wheel leans inwards as it rises.", use="Suspensions of cars.",
    origin="Packard, 1935", parameters=Parameters, linkage=linkage, path=lambda p: {"lower_angle": (-p.bump, p.bump)},
    width=lambda p: 0.06 * p.lower, links=("upright", "upper"), points=("W",), sliders=("upper", "above"),
    plots=(PlotRecipe("camber", ("upright_angle",)),),
    outside=(
        Outside("change of camber from droop to bump", "rad", lambda p: cmath.phase(upright(p, p.bump) / upright(p, -p.bump)),
                lambda p, m: float(m["upright_angle"][-1] - m["upright_angle"][0]), 1e-9, "ruler and compasses"),
        speeds("upright_angle", "lower_angle", pole, "Aronhold and Kennedy", 12,
               "instant centre: rate of the upright over the lower arm, in the middle"),
    ),
    chain="R + RRR", formulas="Dyad RRR.", sources=("Milliken, Race Car Vehicle Dynamics, 17",),
)  # fmt: skip
