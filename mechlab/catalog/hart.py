"""Hart's inversor: an exact straight line from an antiparallelogram, with two bars less than Peaucellier's."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Antiparallelogram A-B-C-D, long A-B = C-D, short A-D = B-C; O on A-B, P on A-D, R on C-B divide their bars alike."""

    long: float = parameter(0.3, "m", "bars A-B and C-D", low=0, strict=True)
    short: float = parameter(0.12, "m", "bars A-D and B-C", low=0, strict=True)
    part: float = parameter(0.5, "", "A-O : A-B = A-P : A-D = C-R : C-B", low=0, high=1, strict=True)
    crank: float = parameter(0.06, "m", "crank Q-P and ground Q-O", low=0, strict=True)
    swing: float = parameter(0.5, "rad", "half of the swing of the crank", low=0, high=1.5, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, the corner A, the far ends B and D of its two bars, the corner C across."""
    u, w = p.part, 1.0 - p.part
    return (
        Linkage("hart").pivot("O", 0.0, 0.0).pivot("Q", p.crank, 0.0)
        .crank("crank", "Q", "P", p.crank)
        .rrr("A", ("ab", "ad"), ("O", "P"), (u * p.long, u * p.short), 1)
        .point("B", "ab", w * p.long, math.pi).point("D", "ad", w * p.short, math.pi)
        .rrr("C", ("bc", "cd"), ("B", "D"), (p.short, p.long), 1)
        .point("R", "bc", w * p.short)
    )  # fmt: skip


def line(p: Parameters) -> float:
    """x of the line: O-P x O-R = u (1 - u) A-C x B-D, A-C x B-D = long^2 - short^2; P on a circle through O, R beyond it."""
    return -p.part * (1.0 - p.part) * (p.long**2 - p.short**2) / (2.0 * p.crank)


ENTRY = planar_entry(
    "hart", "Hart's inversor", "straight-line", summary="An antiparallelogram that inverts a circle: six bars, an exact straight line.",
    use="Exact straight guide with the fewest bars that invert.", origin="Harry Hart, 1874", parameters=Parameters,
    linkage=linkage, released=0.25,
    path=lambda p: {"crank_angle": (-p.swing, p.swing)}, width=lambda p: 0.04 * p.long, links=("ab", "cd"), points=("P", "R"),
    sliders=("long", "short"), plots=(PlotRecipe("point R", ("R_x", "R_z")),),
    outside=(Outside("x of the line", "m", line, lambda p, m: farthest(m["R_x"], line(p)), 1e-9, "diagonals of the antiparallelogram"),),
    chain="R + RRR + RRR", formulas="Two dyads RRR.",
    sources=("Hart, On certain conversions of motion, Messenger of Mathematics 4, 1874",),
)  # fmt: skip
