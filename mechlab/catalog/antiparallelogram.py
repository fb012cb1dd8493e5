"""The antiparallelogram: crossed equal cranks that turn as two ellipses roll on each other."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Ground O-D and coupler A-B long and equal, cranks O-A and D-B short and equal, crossed."""

    long: float = parameter(0.3, "m", "ground O-D and coupler A-B", low=0, strict=True)
    crank: float = parameter(0.1, "m", "cranks O-A and D-B", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and RRR in the crossed mode of the upper half turn."""
    return (
        Linkage("antiparallelogram").pivot("O", 0.0, 0.0).pivot("D", p.long, 0.0)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "follower"), ("A", "D"), (p.long, p.crank), -1)
    )  # fmt: skip


def halves(m: Mapping[str, np.ndarray]) -> np.ndarray:
    """tan(f / 2) / tan(t / 2) of both crank angles from the ground line."""
    return np.tan(0.5 * m["follower_angle"]) / np.tan(0.5 * m["crank_angle"])


ENTRY = planar_entry(
    "antiparallelogram", "Antiparallelogram", "linkage",
    summary="Crossed bars: the cranks turn in opposite senses as rolling ellipses do.",
    use="Elliptical gearing, Hart's inversor, Reuleaux' coupling; a building block of straight-line linkages.",
    origin="used by Hart, 1874, and Kempe, 1877", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.2, math.pi - 0.2)}, width=lambda p: 0.1 * p.crank, links=("coupler", "follower"), points=("A", "B"),
    sliders=("long", "crank"), plots=(PlotRecipe("speed of the follower", ("follower_angle_rate",)),),
    outside=(
        # mirror symmetry about the line through the crossing point: t, f are the crank angles from the ground line
        Outside("tan(f / 2) / tan(t / 2)", "", lambda p: -(p.long + p.crank) / (p.long - p.crank),
                lambda p, m: farthest(halves(m), -(p.long + p.crank) / (p.long - p.crank)), 1e-8,
                "rolling ellipses with foci in the pivots"),
    ),
    chain="R + RRR", formulas="Dyad RRR, crossed.", sources=("Kempe, How to Draw a Straight Line, 1877",),
)  # fmt: skip
