"""Klann's leg: six bars, the foot walks flat for half a turn of the crank."""

from __future__ import annotations

import math

from mechlab.kit.compass import corner, meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass

CRANK, LOW, HIGH = 17.5, complex(-38.8, -12.5), complex(-14.6, 41.9)
BH, CF, CH, DE, EF, EG, FG, FH = 23.7, 73.4, 38.8, 34.1, 57.7, 111.7, 59.0, 35.2
"""Crank A-C; pivots B and D; rocker B-H, rod C-H-F with its elbow H, rocker D-E, leg E-F-G with its knee F."""


@dataclass(frozen=True)
class Parameters(Bars):
    """The leg in the proportions above."""

    unit: float = parameter(0.005, "m", "one unit of the proportions", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR at the elbow, the end of the rod, RRR at the hip, the foot."""
    u = p.unit
    return (
        Linkage("klann").pivot("O", 0.0, 0.0).pivot("L", LOW.real * u, LOW.imag * u).pivot("D", HIGH.real * u, HIGH.imag * u)
        .crank("crank", "O", "C", CRANK * u)
        .rrr("H", ("rod", "lower"), ("C", "L"), (CH * u, BH * u), -1).point("F", "rod", CF * u, -corner(CH, CF, FH))
        .rrr("E", ("leg", "upper"), ("F", "D"), (EF * u, DE * u), 1).point("foot", "leg", FG * u, -corner(EF, FG, EG))
    )  # fmt: skip


def foot(p: Parameters) -> complex:
    """The foot with the crank at 0, by compasses: each corner of a triangle from its two sides."""
    c = complex(CRANK, 0.0)
    h = meet(c, CH, LOW, BH, -1)
    f = meet(c, CF, h, FH, -1)
    e = meet(f, EF, HIGH, DE, 1)
    return p.unit * meet(f, FG, e, EG, -1)


ENTRY = planar_entry(
    "klann", "Klann's leg", "walking", summary="Six bars with an elbow and a knee: the foot goes flat for half a turn, then steps high.",
    use="Walking vehicles that climb over obstacles.", origin="Joseph Klann, 1994", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 3.0 * p.unit, links=("rod", "leg"), points=("foot",),
    sliders=("unit",), plots=(PlotRecipe("foot", ("foot_x", "foot_z")),),
    outside=(
        Outside("x of the foot with the crank at 0", "m", lambda p: foot(p).real, lambda p, m: float(m["foot_x"][0]), 1e-9,
                "ruler and compasses"),
        Outside("height of the foot with the crank at 0", "m", lambda p: foot(p).imag, lambda p, m: float(m["foot_z"][0]), 1e-9,
                "ruler and compasses"),
    ),
    chain="R + RRR + RRR", formulas="Two dyads RRR.",
    sources=("Klann, US patent 6260862, 2001", "proportions: boim.com/Walkin8r, an optimized leg"),
)  # fmt: skip
