"""A six-bar dwell: a slotted lever whose slot lies along the straight part of Hoeken's coupler curve."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Hoeken's four-bar 2 : 1 : 2.5 with coupler point P; slotted lever about Q, which lies on the straight part."""

    crank: float = parameter(0.05, "m", "crank O-A; ground 2, coupler and rocker 2.5 of it", low=0, strict=True)
    pivot_x: float = parameter(0.5, "m", "pivot Q of the slotted lever, x: beyond the stroke")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the coupler point, RPR."""
    r = p.crank
    return (
        Linkage("hoeken_dwell").pivot("O", 0.0, 0.0).pivot("D", 2 * r, 0.0).pivot("Q", p.pivot_x, 4 * r)
        .crank("crank", "O", "A", r)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (2.5 * r, 2.5 * r), 1).point("P", "coupler", 5 * r)
        .rpr("lever", "Q", "P").point("T", "lever", p.pivot_x)
    )  # fmt: skip


ENTRY = planar_entry(
    "hoeken_dwell", "Six-bar dwell", "dwell",
    summary="A slotted lever over Hoeken's straight line: it rests for half a turn of the crank.",
    use="Indexing, feeding and holding without a cam.", origin="dwells by coupler curves: Hain, 1961", parameters=Parameters,
    linkage=linkage, path=lambda p: {"crank_angle": (0.5 * math.pi, 2.5 * math.pi)}, width=lambda p: 0.25 * p.crank,
    links=("coupler", "lever"), points=("P",), sliders=("crank", "pivot_x"), plots=(PlotRecipe("lever", ("lever_angle",)),),
    outside=(
        # A-D-P is right-angled: with the crank at 90, 180, 270 degrees P stands exactly 4 cranks high, level with Q
        Outside("lever angle with the crank at 90, 180 and 270 degrees", "rad", lambda p: math.pi,
                lambda p, m: farthest(abs(m["lever_angle"][[0, 6, 12]]), math.pi), 1e-9, "Thales' theorem: A, D, P on a circle about B"),
    ),
    chain="R + RRR + RPR", formulas="Dyads RRR and RPR.", sources=("Norton, Design of Machinery, 3.9",),
)  # fmt: skip
