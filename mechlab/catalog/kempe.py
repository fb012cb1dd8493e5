"""Kempe's straight line: two double kites, mirror images, whose second base moves exactly along the line of the first."""

from __future__ import annotations

import numpy as np

from mechlab.kit.short import Bars, Linkage, PlotRecipe, always, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Base V-D-A; large kite V-A-W-B, its sides 2 : 1; small kite W-A-D-E, half its size; the second half V2, A2, D2, W2 has B, E too."""

    bar: float = parameter(0.2, "m", "long sides of the large kites", low=0, strict=True)
    first: float = parameter(0.45, "rad", "crank V-B at the start", low=0.3, high=0.9)
    last: float = parameter(0.8, "rad", "and at the end", low=0.3, high=0.9)
    speed: float = parameter(3.0, "rad/s", "speed of the crank in the scenes")


def linkage(p: Parameters) -> Linkage:
    """Driver V-B, RRR at W and E, RRR at W2, and the second base on three legs: a group of class III."""
    a, b, c = p.bar, 0.5 * p.bar, 0.25 * p.bar
    return (
        Linkage("kempe").pivot("V", 0.0, 0.0).pivot("A", a, 0.0).pivot("D", a - c, 0.0)
        .crank("crank", "V", "B", a)
        .rrr("W", ("bw", "aw"), ("B", "A"), (b, b), -1)
        .rrr("E", ("we", "de"), ("W", "D"), (b, c), -1)
        .rrr("W2", ("bw2", "ew2"), ("B", "E"), (b, b), 1)
        .class_three("base", ("bv2", "aw2", "ed2", "base"), ("B", "W2", "E"), (a, b, c), (complex(-a), complex(c - a)), 2,
                     ("V2", "A2", "D2"))
    )  # fmt: skip


ENTRY = planar_entry(
    "kempe", "Kempe's straight line", "straight-line",
    summary="Double kites as mirror images: a whole bar, not just a point, goes exactly straight along its own line.",
    use="Shows a slide made of pins alone; every point of the second base draws the line.", origin="Alfred Kempe, 1875",
    parameters=Parameters, linkage=linkage, path=lambda p: {"crank_angle": (p.first, p.last)}, width=lambda p: 0.06 * p.bar, timestep=4e-4,
    released=0.15, links=("base",), points=("V2", "A2", "B", "E"), sliders=("bar",), plots=(PlotRecipe("second base", ("V2_x", "A2_x")),),
    outside=(
        # the corner angle at A belongs to both kites, so the angle of V in the large one is that of W in the small one; directions seen
        # from the base: W-B and W-E are inclined alike to both sides, hence B-E is at right angles to the base; its image in the line
        # B-E closes the second half: V2 = 2 B - V along the base, height 0
        always("height of V2", "m", lambda p, m: m["V2_z"], lambda p: 0.0, "mirror symmetry of the kites"),
        always("height of A2", "m", lambda p, m: m["A2_z"], lambda p: 0.0, "mirror symmetry of the kites"),
        always("V2 against its mirror image in the line B-E", "m", lambda p, m: m["V2_x"] - 2 * p.bar * np.cos(m["crank_angle"]),
               lambda p: 0.0, "V2 = 2 bar cos(crank)"),
    ),
    chain="R + 3 RRR + class III", formulas="V2 = 2 bar cos(crank).", sources=("Kempe, How to Draw a Straight Line, 1877",),
)  # fmt: skip
