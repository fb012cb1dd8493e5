"""A McPherson suspension in the plane of the axle: lower arm and a strut that slides in its top mount."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Lower arm O-A; the strut goes from A to its top mount Q and slides there."""

    lower: float = parameter(0.36, "m", "lower arm", low=0, strict=True)
    top_x: float = parameter(0.28, "m", "top mount, x")
    top_y: float = parameter(0.6, "m", "top mount above the arm's pivot", low=0, strict=True)
    bump: float = parameter(0.25, "rad", "travel of the arm, up and down", low=0, high=0.5, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and RPR: the strut turns about its mount."""
    return (
        Linkage("mcpherson").pivot("O", 0.0, 0.0).pivot("Q", p.top_x, p.top_y)
        .crank("lower", "O", "A", p.lower).rpr("strut", "Q", "A").point("T", "strut", p.top_y)
    )  # fmt: skip


def strut(p: Parameters, t: float) -> complex:
    """From the mount to the ball joint, arm at t."""
    return complex(p.lower * math.cos(t) - p.top_x, p.lower * math.sin(t) - p.top_y)


def turned(p: Parameters) -> float:
    """Turn of the strut from droop to bump."""
    ratio = strut(p, p.bump) / strut(p, -p.bump)
    return math.atan2(ratio.imag, ratio.real)


ENTRY = planar_entry(
    "mcpherson", "McPherson strut", "suspension", summary="A lower arm and a sliding strut: one part guides, springs and steers.",
    use="Front suspensions of most small cars.", origin="Earle MacPherson, 1949", parameters=Parameters, linkage=linkage,
    path=lambda p: {"lower_angle": (-p.bump, p.bump)}, width=lambda p: 0.07 * p.lower, links=("strut",), slides=("strut",), points=("A",),
    sliders=("lower", "top_x"), plots=(PlotRecipe("camber", ("strut_angle",)),),
    outside=(
        Outside("length of the strut at bump", "m", lambda p: abs(strut(p, p.bump)), lambda p, m: abs(float(m["strut_slide"][-1])), 1e-9,
                "distance of mount and ball joint"),
        Outside("turn of the strut from droop to bump", "rad", turned, lambda p, m: float(m["strut_angle"][-1] - m["strut_angle"][0]),
                1e-9, "direction from mount to ball joint"),
    ),
    chain="R + RPR", formulas="Dyad RPR.", sources=("Milliken, Race Car Vehicle Dynamics, 17",),
)  # fmt: skip
