"""Sylvester's plagiograph (skew pantograph): it copies a figure, enlarged and turned."""

from __future__ import annotations

import cmath
from collections.abc import Mapping

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Parallelogram O-A-B-C; P on the bar A-B, R on the bar C-B, so that R is P turned by -turn and divided by scale."""

    first: float = parameter(0.2, "m", "bars O-A and C-B", low=0, strict=True)
    second: float = parameter(0.15, "m", "bars O-C and A-B", low=0, strict=True)
    scale: float = parameter(2.0, "", "O-P : O-R", low=0, strict=True)
    turn: float = parameter(0.6, "rad", "angle from O-R to O-P")


def linkage(p: Parameters) -> Linkage:
    """Two drivers, RRR as a parallelogram, the two points."""
    return (
        Linkage("plagiograph").pivot("O", 0.0, 0.0)
        .crank("left", "O", "A", p.first).crank("right", "O", "C", p.second)
        .rrr("B", ("ab", "cb"), ("A", "C"), (p.second, p.first), 1)
        .point("P", "ab", p.scale * p.second, p.turn).point("R", "cb", p.first / p.scale, -p.turn)
    )  # fmt: skip


def copied(p: Parameters, m: Mapping[str, np.ndarray]) -> complex:
    """P over R as complex numbers, at the end of the path."""
    return complex(m["P_x"][-1], m["P_z"][-1]) / complex(m["R_x"][-1], m["R_z"][-1])


ENTRY = planar_entry(
    "plagiograph", "Sylvester's plagiograph", "pantograph",
    summary="A parallelogram with skew arms: one point copies another, enlarged and turned.",
    use="Copies drawings at another size and angle; a building block of robot legs.", origin="James Joseph Sylvester, 1875",
    parameters=Parameters, linkage=linkage, released=0.25, path=lambda p: {"left_angle": (1.9, 2.5), "right_angle": (0.6, 0.9)},
    width=lambda p: 0.06 * p.first, links=("ab", "cb"), points=("P", "R"), sliders=("first", "second"),
    plots=(PlotRecipe("original and copy", ("P_x", "P_z", "R_x", "R_z")),),
    outside=(
        # P = first e^(i t) + scale second e^(i turn) e^(i f); R = second e^(i f) + first / scale e^(i (t - turn)): P = scale e^(i turn) R
        Outside("enlargement", "", lambda p: p.scale, lambda p, m: abs(copied(p, m)), 1e-9, "Sylvester 1875, as derived"),
        Outside("turn", "rad", lambda p: p.turn, lambda p, m: cmath.phase(copied(p, m)), 1e-9, "Sylvester 1875, as derived"),
    ),
    chain="R, R + RRR", formulas="Parallelogram O-A-B-C.", sources=("Sylvester, On the plagiograph, Nature 12, 1875",),
)  # fmt: skip
