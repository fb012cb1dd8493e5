"""Evans' grasshopper linkage: a beam on a short rocker, its far end on a slide, its head nearly on a straight line."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Rocker O-A, beam B-A-P; B slides along x, P goes nearly along z; rocker x head = rear^2."""

    rear: float = parameter(0.15, "m", "beam B-A", low=0, strict=True)
    head: float = parameter(0.225, "m", "beam A-P; the rocker is rear^2 / head", low=0, strict=True)
    swing: float = parameter(0.5, "rad", "half of the swing of the rocker", low=0, high=1.2, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRP, the head of the beam."""
    return (
        Linkage("evans").pivot("O", 0.0, 0.0).guide("rail", 0.0, 0.0)
        .crank("rocker", "O", "A", p.rear**2 / p.head)
        .rrp("B", "beam", "A", "rail", p.rear, -1)
        .point("P", "beam", p.head, math.pi)
    )  # fmt: skip


def head(p: Parameters) -> float:
    """x of P at the end of the swing: rocker cos(t) + head cos(f), rear sin(f) = rocker sin(t)."""
    rocker = p.rear**2 / p.head
    return rocker * math.cos(math.pi - p.swing) + p.head * math.sqrt(1.0 - (rocker / p.rear * math.sin(p.swing)) ** 2)


ENTRY = planar_entry(
    "evans", "Evans' grasshopper linkage", "straight-line",
    summary="A beam on a short rocker with its rear end on a slide: its head deviates in fourth order only.",
    use="Grasshopper beam engines: a long straight stroke of the piston rod beside a short rocker.", origin="Oliver Evans, 1805",
    parameters=Parameters, linkage=linkage, width=lambda p: 0.08 * p.rear,
    path=lambda p: {"rocker_angle": (math.pi - p.swing, math.pi + p.swing)}, links=("beam",), points=("P",), slides=("B",),
    sliders=("rear", "head"), plots=(PlotRecipe("head of the beam", ("P_x", "P_z")),),
    outside=(
        Outside("x of P at the end of the swing", "m", head, lambda p, m: float(m["P_x"][0]), 1e-9, "projections of rocker and beam"),
        # x = head - rocker + (rocker - head (rocker / rear)^2) t^2 / 2 + O(t^4): the second order vanishes for rocker head = rear^2
        Outside("x of P in the middle of the swing", "m", lambda p: p.head - p.rear**2 / p.head, lambda p, m: float(m["P_x"][12]), 1e-9,
                "rocker and beam in line"),
    ),
    chain="R + RRP", formulas="Dyad RRP; P on the line B-A beyond A.", sources=("Dunkerley, Mechanism, 1905",),
)  # fmt: skip
