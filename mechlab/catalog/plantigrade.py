"""Chebyshev's plantigrade machine: two lambda linkages half a turn apart on one crank, their feet take turns on a straight line."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Lambda linkage 1 : 2 : 2.5: its end goes straight on the lower side of its path. A foot hangs from there on a frame that only
    translates, so the foot's path is the same, lower down."""

    crank: float = parameter(0.05, "m", "cranks; the ground is 2, rocker and coupler 2.5 of it", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and a second crank half a turn behind on the same shaft; an RRR and a foot each."""
    r, links = p.crank, (2.5 * p.crank, 2.5 * p.crank)
    return (
        Linkage("plantigrade").pivot("O", 0.0, 0.0).pivot("D", 2 * r, 0.0)
        .crank("crank", "O", "A", r).geared("second", "O", "C", r, "crank", 1, math.pi)
        .rrr("B", ("leg_1", "rocker_1"), ("A", "D"), links, 1).point("foot_1", "leg_1", 5 * r)
        .rrr("E", ("leg_2", "rocker_2"), ("C", "D"), links, 1).point("foot_2", "leg_2", 5 * r)
    )  # fmt: skip


ENTRY = planar_entry(
    "plantigrade", "Chebyshev's plantigrade machine", "walking",
    summary="Two lambda linkages on one shaft, half a turn apart: one foot is always on the ground.", use="The first walking machine.",
    origin="Pafnuty Chebyshev, shown in Paris 1878", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.5 * math.pi, 2.5 * math.pi)}, width=lambda p: 0.25 * p.crank, links=("leg_1", "leg_2"),
    points=("foot_1", "foot_2"), sliders=("crank",), plots=(PlotRecipe("feet", ("foot_1_z", "foot_2_z")),),
    outside=(
        # B is the middle of A-foot and as far from D: the angle A-D-foot is right; the foot is 4 cranks high at 90, 180 and 270 degrees,
        # and higher everywhere else: 24 ** .5 cranks at 0 degrees
        Outside("height of foot 1 at 90, 180, 270 degrees", "m", lambda p: 4 * p.crank,
                lambda p, m: farthest(m["foot_1_z"][[0, 6, 12]], 4 * p.crank), 1e-9, "Thales' theorem"),
        Outside("height of foot 2 half a turn later", "m", lambda p: 4 * p.crank,
                lambda p, m: farthest(m["foot_2_z"][[12, 18, 24]], 4 * p.crank), 1e-9, "Thales' theorem"),
    ),
    chain="R + 2 RRR", formulas="Two dyads RRR.",
    sources=("Chebyshev, Oeuvres II", "Artobolevsky, Levitsky, Mechanisms of P. L. Chebyshev, 1945"),
)  # fmt: skip
