"""Strider: ten bars in two mirrored legs on one crank pin, each foot held from the other side's rod."""

from __future__ import annotations

import cmath
import math

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, PlotRecipe, parameter, planar_entry, value_at
from mechlab.lazy_dataclass import dataclass

CRANK, FRAME, ROCKER, ROD, BACK, THIGH, SHIN = 4.0, complex(11, 8), 5.0, 14.0, complex(-6, 1), 13.0, 10.0
"""Crank; frame pivots left and right; rockers; rods from crank pin to knee and their ends behind the pin; thighs from the knees and shins
from the ends of the rods to the feet."""


@dataclass(frozen=True)
class Parameters(Bars):
    """The legs in the proportions above."""

    unit: float = parameter(0.01, "m", "one unit of the proportions", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR at both knees, the bent ends of the rods, RRR at both feet across."""
    u, x, y, (far, turn) = p.unit, FRAME.real * p.unit, FRAME.imag * p.unit, cmath.polar(BACK)
    return (
        Linkage("strider").pivot("O", 0.0, 0.0).pivot("L", -x, y).pivot("R", x, y)
        .crank("crank", "O", "X", CRANK * u)
        .rrr("knee_l", ("rod_l", "rocker_l"), ("X", "L"), (ROD * u, ROCKER * u), 1).point("end_l", "rod_l", far * u, -turn)
        .rrr("knee_r", ("rod_r", "rocker_r"), ("X", "R"), (ROD * u, ROCKER * u), -1).point("end_r", "rod_r", far * u, turn)
        .rrr("foot_l", ("thigh_l", "shin_l"), ("knee_l", "end_r"), (THIGH * u, SHIN * u), -1)
        .rrr("foot_r", ("thigh_r", "shin_r"), ("knee_r", "end_l"), (THIGH * u, SHIN * u), 1)
    )  # fmt: skip


def foot(p: Parameters, t: float, side: int = 1) -> complex:
    """Foot on the left (+1) or right with the crank at t, by compasses."""
    pin = at(CRANK, t)
    left, right = meet(pin, ROD, complex(-11, 8), ROCKER, 1), meet(pin, ROD, complex(11, 8), ROCKER, -1)
    ends = pin + BACK.conjugate() * (left - pin) / ROD, pin + BACK * (right - pin) / ROD
    return p.unit * (meet(left, THIGH, ends[1], SHIN, -1) if side > 0 else meet(right, THIGH, ends[0], SHIN, 1))


ENTRY = planar_entry(
    "strider", "Strider", "walking", summary="Ten bars, two feet on one crank pin: each foot hangs on the other side's rod, a high step.",
    use="Walking toys and robots for rough ground; twelve legs walk smoothly.", origin="Wade Wagle and Team Trotbot, about 2015",
    parameters=Parameters, linkage=linkage, path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.6 * p.unit,
    links=("thigh_l", "shin_l"), points=("foot_l", "foot_r"), sliders=("unit",),
    plots=(PlotRecipe("feet", ("foot_l_x", "foot_l_z", "foot_r_x", "foot_r_z")),),
    outside=(
        value_at("foot_l_x", lambda p: foot(p, 0.0).real, "ruler and compasses", 0),
        value_at("foot_l_z", lambda p: foot(p, 0.5 * math.pi).imag, "ruler and compasses", 6),
        # half a turn of the mirrored crank: the feet are mirror images at t and pi - t
        value_at("foot_r_x", lambda p: -foot(p, math.pi).real, "mirror symmetry of the plan", 0),
    ),
    chain="R + 4 RRR", formulas="Four dyads RRR.", sources=("diywalkers.com: plans of Strider, version 3",),
)  # fmt: skip
