"""The Scott Russell linkage: an exact straight line at right angles to a slide."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A, rod B-A-P with B-A = A-P = O-A; B slides along x through O."""

    crank: float = parameter(0.15, "m", "crank O-A and both halves of the rod", low=0, strict=True)
    swing: float = parameter(1.2, "rad", "half of the swing of the crank", low=0, high=1.5, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRP, the end of the rod."""
    return (
        Linkage("scott_russell").pivot("O", 0.0, 0.0).guide("rail", 0.0, 0.0)
        .crank("crank", "O", "A", p.crank)
        .rrp("B", "rod", "A", "rail", p.crank, 1)
        .point("P", "rod", p.crank, math.pi)
    )  # fmt: skip


ENTRY = planar_entry(
    "scott_russell", "Scott Russell linkage", "straight-line",
    summary="Crank as long as half the rod: its free end goes exactly straight, at right angles to the slide.",
    use="Exact straight guide of a press or an instrument from one slide.",
    origin="William Freemantle, 1803; named after John Scott Russell", parameters=Parameters, linkage=linkage,
    width=lambda p: 0.08 * p.crank, path=lambda p: {"crank_angle": (-p.swing, p.swing)}, links=("rod",), points=("P",), slides=("B",),
    sliders=("crank",), plots=(PlotRecipe("free end", ("P_x", "P_z")),),
    outside=(
        # O, B, P lie on a circle about A, and B-P is its diameter: the angle B-O-P is right
        Outside("P stays on the line through O across the slide", "m", lambda p: 0.0, lambda p, m: farthest(m["P_x"], 0.0), 1e-9,
                "Thales' theorem"),
        Outside("height of P at the end", "m", lambda p: 2 * p.crank * math.sin(p.swing), lambda p, m: float(m["P_z"][-1]), 1e-9,
                "twice that of A"),
    ),
    chain="R + RRP", formulas="Dyad RRP; P on the line B-A beyond A.", sources=("Dunkerley, Mechanism, 1905",),
)  # fmt: skip
