"""A parallel-jaw gripper: two parallelograms geared together, the jaws stay parallel."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Left and right finger as mirror images; each is carried by a driven and a following bar of equal length."""

    base: float = parameter(0.04, "m", "distance of the driven pivots", low=0, strict=True)
    bar: float = parameter(0.06, "m", "bars of the parallelograms", low=0, strict=True)
    spread: float = parameter(0.02, "m", "distance of the two bars of a finger", low=0, strict=True)
    finger: float = parameter(0.05, "m", "finger beyond its upper pin", low=0, strict=True)
    gravity: float = parameter(0.0, "m/s2", "the plane lies flat")


def linkage(p: Parameters) -> Linkage:
    """Driver, parallelogram, geared partner, parallelogram; the finger tips."""
    x, s = 0.5 * p.base, p.spread
    return (
        Linkage("parallel_gripper").pivot("L", -x, 0.0).pivot("L2", -x - s, 0.0).pivot("R", x, 0.0).pivot("R2", x + s, 0.0)
        .crank("left", "L", "A", p.bar).geared("right", "R", "B", p.bar, "left", -1, math.pi)
        .rrr("A2", ("finger_left", "back_left"), ("A", "L2"), (s, p.bar), -1).point("tip_left", "finger_left", p.finger, -0.5 * math.pi)
        .rrr("B2", ("finger_right", "back_right"), ("B", "R2"), (s, p.bar), 1).point("tip_right", "finger_right", p.finger, 0.5 * math.pi)
    )  # fmt: skip


ENTRY = planar_entry(
    "parallel_gripper", "Parallel gripper", "gripper", summary="Two geared parallelograms: one drive closes two jaws that stay parallel.",
    use="Robot hands for parts of many widths.", origin="common since the 1970s", parameters=Parameters, linkage=linkage,
    path=lambda p: {"left_angle": (2.6, 1.7)}, width=lambda p: 0.3 * p.spread, links=("finger_left", "finger_right"),
    points=("tip_left", "tip_right"), sliders=("bar", "base"), plots=(PlotRecipe("jaws", ("tip_left_x", "tip_right_x")),),
    outside=(
        Outside("opening at the end", "m", lambda p: p.base - 2 * p.bar * math.cos(1.7),
                lambda p, m: float(m["tip_right_x"][-1] - m["tip_left_x"][-1]), 1e-9, "base - 2 bar cos(angle)"),
        Outside("tilt of the left finger along the path", "rad", lambda p: 0.0,
                lambda p, m: farthest(m["finger_left_angle"] - m["finger_left_angle"][0], 0.0), 1e-9, "parallelogram"),
        Outside("the jaws stay mirror images", "m", lambda p: 0.0, lambda p, m: farthest(m["tip_right_x"] + m["tip_left_x"], 0.0), 1e-9,
                "gears 1 : 1"),
    ),
    chain="R, gears, 2 RRR", formulas="opening = base - 2 bar cos(angle).",
    sources=("Artobolevsky, Mechanisms in Modern Engineering Design I",),
)  # fmt: skip
