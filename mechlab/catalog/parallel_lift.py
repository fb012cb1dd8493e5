"""A parallelogram lift: two equal arms keep the platform level, a cylinder raises them."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, PlotRecipe, always, parameter, planar_entry, value_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Arms O-A and D-B, platform A-B with its edge P; the cylinder from C, below D, to M on the lower arm."""

    arm: float = parameter(0.9, "m", "both arms", low=0, strict=True)
    post: float = parameter(0.3, "m", "distance of their pivots, one above the other", low=0, strict=True)
    platform: float = parameter(1.2, "m", "depth of the platform", low=0, strict=True)
    foot: float = parameter(0.45, "m", "foot of the cylinder below the pivot O", low=0, strict=True)
    along: float = parameter(0.5, "m", "its head along the lower arm", low=0, strict=True)
    low: float = parameter(-0.8, "rad", "arms lowered", low=-1.2, high=1.2)
    high: float = parameter(0.8, "rad", "arms raised", low=-1.2, high=1.2)


def length(p: Parameters, t: float) -> float:
    """Cylinder, arms at t, by the law of cosines."""
    return math.sqrt(p.foot**2 + p.along**2 + 2.0 * p.foot * p.along * math.sin(t))


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR as a parallelogram, the edge of the platform, RPR of the cylinder."""
    return (
        Linkage("parallel_lift").pivot("O", 0.0, 0.0).pivot("D", 0.0, p.post).pivot("C", 0.0, -p.foot)
        .crank("arm", "O", "A", p.arm)
        .rrr("B", ("back", "upper"), ("A", "D"), (p.post, p.arm), -1).point("P", "back", p.platform, -0.5 * math.pi)
        .point("M", "arm", p.along).rpr("cylinder", "C", "M").point("N", "cylinder", 0.9 * length(p, p.low))
    )  # fmt: skip


ENTRY = planar_entry(
    "parallel_lift", "Parallelogram lift", "lift", summary="Two equal arms and a cylinder: the platform rises level on an arc.",
    use="Tail lifts of lorries, lifts for beds and wheelchairs, front loaders.", origin="tail lifts: Novum, about 1930",
    parameters=Parameters, linkage=linkage, path=lambda p: {"arm_angle": (p.low, p.high)}, width=lambda p: 0.06 * p.arm,
    links=("back",), points=("P", "A"), slides=("cylinder",), sliders=("along", "foot"), servo=(2000.0, 20.0),
    released=0.4, plots=(PlotRecipe("edge", ("P_x", "P_z")), PlotRecipe("cylinder", ("cylinder_slide",))),
    outside=(
        always("the platform stays level", "rad", lambda p, m: m["back_angle"], lambda p: 0.5 * math.pi, "parallelogram"),
        value_at("P_z", lambda p: p.arm * math.sin(p.high), "arc of the arms"),
        value_at("cylinder_slide", lambda p: length(p, p.high), "law of cosines"),
    ),
    chain="R + RRR + RPR", formulas="cylinder^2 = foot^2 + along^2 + 2 foot along sin(arm).",
    sources=("Artobolevsky, Mechanisms in Modern Engineering Design I",),
)  # fmt: skip
