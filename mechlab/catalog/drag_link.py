"""The drag link: a double-crank four-bar whose output turns unevenly, here with the ram of a quick return."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Ground O-D is the shortest bar, so that crank O-A and follower D-B both turn fully."""

    ground: float = parameter(0.05, "m", "ground O-D, the shortest bar", low=0, strict=True)
    crank: float = parameter(0.1, "m", "crank O-A", low=0, strict=True)
    coupler: float = parameter(0.09, "m", "coupler A-B", low=0, strict=True)
    follower: float = parameter(0.11, "m", "follower D-B", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and RRR."""
    return (
        Linkage("drag_link").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "follower"), ("A", "D"), (p.coupler, p.follower), 1)
    )  # fmt: skip


def angle(p: Parameters) -> float:
    """Follower angle with the crank at 0: triangle A-D-B, A at crank - ground from D, law of cosines."""
    side = p.crank - p.ground
    return math.acos((side**2 + p.follower**2 - p.coupler**2) / (2 * side * p.follower))


ENTRY = planar_entry(
    "drag_link", "Drag-link coupling", "quick-return",
    summary="Double crank: both shafts turn fully, the output fast and slow once a turn.",
    use="Uneven turn from an even one: quick returns, presses, paper machines.", origin="Franz Reuleaux described it, 1875",
    parameters=Parameters, linkage=linkage, path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.16 * p.crank,
    links=("coupler", "follower"), points=("B",), sliders=("ground", "coupler"),
    plots=(PlotRecipe("follower speed", ("follower_angle_rate",)),),
    outside=(
        Outside("follower angle with the crank at 0, as its cosine", "", lambda p: math.cos(angle(p)),
                lambda p, m: math.cos(m["follower_angle"][0]), 1e-9, "law of cosines"),
        # Grashof: shortest + longest < sum of the others, ground shortest; so the follower makes one turn with each of the crank
        Outside("turns of the follower in one of the crank", "", lambda p: 1.0,
                lambda p, m: float(m["follower_angle"][-1] - m["follower_angle"][0]) / (2 * math.pi), 1e-9, "Grashof 1883"),
    ),
    chain="R + RRR", formulas="Dyad RRR.", sources=("Norton, Design of Machinery, 3.7",),
)  # fmt: skip
