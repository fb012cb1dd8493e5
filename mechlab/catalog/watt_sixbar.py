"""A Watt II six-bar: two four-bars in series on a ternary rocker."""

from __future__ import annotations

import cmath
import math
from functools import partial

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, PlotRecipe, parameter, planar_entry, value_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A, coupler A-B, ternary rocker D-B-C, link C-E, output G-E."""

    crank: float = parameter(0.08, "m", "crank O-A", low=0, strict=True)
    coupler: float = parameter(0.25, "m", "coupler A-B", low=0, strict=True)
    rocker: float = parameter(0.15, "m", "rocker D-B", low=0, strict=True)
    ground: float = parameter(0.25, "m", "ground O-D", low=0, strict=True)
    arm: float = parameter(0.15, "m", "second arm of the rocker, D-C", low=0, strict=True)
    corner: float = parameter(-1.2, "rad", "angle from D-B to D-C")
    link: float = parameter(0.2, "m", "link C-E", low=0, strict=True)
    output: float = parameter(0.12, "m", "output G-E", low=0, strict=True)
    pivot: float = parameter(0.5, "m", "pivot G, x")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, a point of the rocker, RRR."""
    return (
        Linkage("watt_sixbar").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0).pivot("G", p.pivot, 0.0)
        .crank("crank", "O", "A", p.crank).rrr("B", ("coupler", "rocker"), ("A", "D"), (p.coupler, p.rocker), 1)
        .point("C", "rocker", p.arm, p.corner).rrr("E", ("link", "output"), ("C", "G"), (p.link, p.output), 1)
    )  # fmt: skip


def output(p: Parameters, t: float) -> float:
    """Output angle by compasses, crank at t."""
    b = meet(at(p.crank, t), p.coupler, p.ground, p.rocker, 1) - p.ground
    c = p.ground + b / p.rocker * at(p.arm, p.corner)
    return cmath.phase(meet(c, p.link, p.pivot, p.output, 1) - p.pivot)


ENTRY = planar_entry(
    "watt_sixbar", "Watt six-bar", "press",
    summary="Two four-bars in series: larger swings and better force transmission than one can give.",
    use="Presses, folding machines, wing flaps.", origin="chains named after Watt and Stephenson: Burmester, 1888", parameters=Parameters,
    linkage=linkage, path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.12 * p.rocker, links=("rocker", "output"),
    points=("C", "E"), sliders=("link", "arm"), plots=(PlotRecipe("output", ("output_angle",)),),
    outside=tuple(value_at("output_angle", partial(output, t=0.5 * math.pi * k), "ruler and compasses", 6 * k, unit="rad") for k in (0,
            1)),
    chain="R + RRR + RRR", formulas="Two dyads RRR in series.", sources=("Norton, Design of Machinery, 2.14",),
)  # fmt: skip
