"""Jansen's leg: eleven bars of the Strandbeest, one crank, a flat step."""

from __future__ import annotations

import math

from mechlab.kit.compass import corner, meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass

A, B, C, D, E, F, G, H, I, J, K, L, M = 38.0, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49.0, 50.0, 61.9, 7.8, 15.0
"""Jansen's numbers: places of the pivots A, L; lengths of the bars B to K; crank M."""


@dataclass(frozen=True)
class Parameters(Bars):
    """The leg in Jansen's proportions."""

    unit: float = parameter(0.01, "m", "one of Jansen's units", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, two RRR up and down from the pivot, the upper and the lower triangle between a parallel pair of bars."""
    u = p.unit
    return (
        Linkage("jansen").pivot("O", 0.0, 0.0).pivot("P", -A * u, -L * u)
        .crank("crank", "O", "X", M * u)
        .rrr("Y", ("j", "b"), ("X", "P"), (J * u, B * u), -1).point("Z", "b", D * u, corner(B, D, E))
        .rrr("W", ("k", "c"), ("X", "P"), (K * u, C * u), 1)
        .rrr("V", ("f", "g"), ("Z", "W"), (F * u, G * u), -1).point("foot", "g", I * u, corner(G, I, H))
    )  # fmt: skip


def lowest(p: Parameters) -> complex:
    """The foot with the crank at 0, by compasses."""
    x, pivot = complex(M, 0), complex(-A, -L)
    y, w = meet(x, J, pivot, B, -1), meet(x, K, pivot, C, 1)
    v = meet(meet(pivot, D, y, E, 1), F, w, G, -1)
    return meet(w, I, v, H, 1) * p.unit


ENTRY = planar_entry(
    "jansen", "Jansen's leg", "walking", summary="Eleven bars in Jansen's proportions: the foot steps along a nearly flat line.",
    use="Walking sculptures driven by the wind; legs without sensors.", origin="Theo Jansen, 1990", parameters=Parameters,
    linkage=linkage, path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, timestep=5e-4, width=lambda p: 3.0 * p.unit, links=("b", "c", "g"),
    points=("foot",), sliders=("unit",), plots=(PlotRecipe("foot", ("foot_x", "foot_z")),),
    outside=(
        Outside("x of the foot with the crank at 0", "m", lambda p: lowest(p).real, lambda p, m: float(m["foot_x"][0]), 1e-9,
                "ruler and compasses"),
        Outside("height of the foot with the crank at 0", "m", lambda p: lowest(p).imag, lambda p, m: float(m["foot_z"][0]), 1e-9,
                "ruler and compasses"),
    ),
    chain="R + 4 RRR", formulas="Three dyads RRR and two triangles.", sources=("Jansen, The Great Pretender, 2007: the eleven numbers",),
)  # fmt: skip
