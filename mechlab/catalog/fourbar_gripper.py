"""A gripper whose fingers are couplers of four-bars, geared as mirror images: they close and turn inwards."""

from __future__ import annotations

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Each finger hangs on a driven bar and a shorter follower."""

    base: float = parameter(0.03, "m", "distance of the driven pivots", low=0, strict=True)
    driven: float = parameter(0.055, "m", "driven bars", low=0, strict=True)
    follower: float = parameter(0.05, "m", "followers", low=0, strict=True)
    knuckle: float = parameter(0.02, "m", "distance of the pins of a finger", low=0, strict=True)
    out: float = parameter(0.018, "m", "pivots of the followers, outside the driven ones", low=0, strict=True)
    finger: float = parameter(0.06, "m", "finger beyond its driven pin", low=0, strict=True)
    gravity: float = parameter(0.0, "m/s2", "the plane lies flat")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the tip; its geared mirror image."""
    x, links = 0.5 * p.base, (p.knuckle, p.follower)
    return (
        Linkage("fourbar_gripper").pivot("L", -x, 0.0).pivot("L2", -x - p.out, 0.0).pivot("R", x, 0.0).pivot("R2", x + p.out, 0.0)
        .crank("left", "L", "A", p.driven).geared("right", "R", "B", p.driven, "left", -1, 3.141592653589793)
        .rrr("A2", ("finger_left", "back_left"), ("A", "L2"), links, -1).point("tip_left", "finger_left", p.finger, -1.5708)
        .rrr("B2", ("finger_right", "back_right"), ("B", "R2"), links, 1).point("tip_right", "finger_right", p.finger, 1.5708)
    )  # fmt: skip


def tip(p: Parameters, t: float) -> complex:
    """Left finger tip by compasses, driven bar at t."""
    a = complex(-0.5 * p.base, 0) + at(p.driven, t)
    pin = meet(a, p.knuckle, complex(-0.5 * p.base - p.out, 0), p.follower, -1)
    return a + (pin - a) / p.knuckle * at(p.finger, -1.5708)


ENTRY = planar_entry(
    "fourbar_gripper", "Four-bar gripper", "gripper",
    summary="Geared four-bars: fingers that turn inwards as they close, with one drive.", use="Encompassing grips of robot hands.",
    origin="common since the 1980s", parameters=Parameters, linkage=linkage, path=lambda p: {"left_angle": (2.5, 1.8)},
    width=lambda p: 0.3 * p.knuckle, links=("finger_left",), points=("tip_left", "tip_right"), sliders=("follower", "out"),
    plots=(PlotRecipe("tips", ("tip_left_x", "tip_right_x")),),
    outside=(
        Outside("left tip at the end, x", "m", lambda p: tip(p, 1.8).real, lambda p, m: float(m["tip_left_x"][-1]), 1e-9,
                "ruler and compasses"),
        Outside("left tip at the end, height", "m", lambda p: tip(p, 1.8).imag, lambda p, m: float(m["tip_left_z"][-1]), 1e-9,
                "ruler and compasses"),
        Outside("the tips stay mirror images", "m", lambda p: 0.0, lambda p, m: farthest(m["tip_right_x"] + m["tip_left_x"], 0.0), 1e-9,
                "gears 1 : 1"),
    ),
    chain="R, gears, 2 RRR", formulas="Dyads RRR.", sources=("Artobolevsky, Mechanisms in Modern Engineering Design I",),
)  # fmt: skip
