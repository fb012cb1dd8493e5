"""The Peaucellier-Lipkin linkage: an exact straight line by inversion in a circle."""

from __future__ import annotations

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Arms O-B and O-C, rhombus A-B-P-C, crank Q-A with Q-A = Q-O: A goes on a circle through O, P on a straight line."""

    arm: float = parameter(0.25, "m", "arms O-B, O-C", low=0, strict=True)
    side: float = parameter(0.1, "m", "sides of the rhombus", low=0, strict=True)
    crank: float = parameter(0.1, "m", "crank Q-A and ground Q-O", low=0, strict=True)
    swing: float = parameter(0.5, "rad", "half of the swing of the crank", low=0, high=1.5, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and three RRR."""
    return (
        Linkage("peaucellier").pivot("O", 0.0, 0.0).pivot("Q", p.crank, 0.0)
        .crank("crank", "Q", "A", p.crank)
        .rrr("B", ("arm_up", "side_1"), ("O", "A"), (p.arm, p.side), 1)
        .rrr("C", ("arm_down", "side_2"), ("O", "A"), (p.arm, p.side), -1)
        .rrr("P", ("side_3", "side_4"), ("B", "C"), (p.side, p.side), 1)
    )  # fmt: skip


ENTRY = planar_entry(
    "peaucellier", "Peaucellier-Lipkin linkage", "straight-line",
    summary="Eight bars that invert a circle through the pivot: P goes exactly straight.",
    use="The first exact straight line without slides; ventilated the Houses of Parliament.",
    origin="Charles-Nicolas Peaucellier, 1864; Lippman Lipkin, 1871", parameters=Parameters, linkage=linkage, released=0.1,
    width=lambda p: 0.05 * p.arm, path=lambda p: {"crank_angle": (-p.swing, p.swing)}, links=("arm_up", "arm_down"), points=("A", "P"),
    sliders=("arm", "side"), plots=(PlotRecipe("point P", ("P_x", "P_z")),),
    outside=(
        # |OA| |OP| = arm^2 - side^2 (power of the point O); A on the circle of diameter 2 crank through O maps to a line
        Outside("distance of the line from O", "m", lambda p: (p.arm**2 - p.side**2) / (2 * p.crank),
                lambda p, m: farthest(m["P_x"], (p.arm**2 - p.side**2) / (2 * p.crank)), 1e-9, "inversion with the power arm^2 - side^2"),
        Outside("power of the inversion", "m2", lambda p: p.arm**2 - p.side**2,
                lambda p, m: float(np.hypot(m["A_x"], m["A_z"])[0] * np.hypot(m["P_x"], m["P_z"])[0]), 1e-9, "power of the point O"),
    ),
    chain="R + 3 RRR", formulas="Three dyads RRR; O, A, P in line.", sources=("Kempe, How to Draw a Straight Line, 1877",),
)  # fmt: skip
