"""Roberts' straight-line linkage: the apex of an isosceles coupler passes through both pivots and the middle between them."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Pivots O and D, equal cranks O-A and D-B, coupler A-B half as long as O-D, its apex P with P-A = P-B = crank."""

    ground: float = parameter(0.2, "m", "pivots O-D; the coupler A-B is half of it", low=0, strict=True)
    crank: float = parameter(0.12, "m", "cranks O-A and D-B, sides P-A and P-B; longer than half the ground", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the apex below the coupler."""
    return (
        Linkage("roberts").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0)
        .crank("left", "O", "A", p.crank)
        .rrr("B", ("coupler", "right"), ("A", "D"), (0.5 * p.ground, p.crank), 1)
        .point("P", "coupler", p.crank, -math.acos(0.25 * p.ground / p.crank))
    )  # fmt: skip


def ends(p: Parameters) -> dict[str, tuple[float, float]]:
    """P in D: A is the apex over O-D. P in O, the mirror image: the right crank stands so, which is the apex angle of the coupler on."""
    first = math.acos(0.5 * p.ground / p.crank)
    return {"left_angle": (first, first + 2.0 * math.asin(0.25 * p.ground / p.crank))}


ENTRY = planar_entry(
    "roberts", "Roberts' linkage", "straight-line",
    summary="Four-bar whose coupler apex goes from pivot to pivot, nearly along the line between them.",
    use="A straight guide with a stroke as long as its base.", origin="Richard Roberts, before 1841", parameters=Parameters,
    linkage=linkage, path=ends, timestep=7e-5,
    width=lambda p: 0.06 * p.ground, links=("coupler", "right"), points=("P",), sliders=("ground", "crank"),
    plots=(PlotRecipe("apex of the coupler", ("P_x", "P_z")),),
    outside=(
        Outside("stroke of P between the ends", "m", lambda p: p.ground, lambda p, m: float(m["P_x"][0] - m["P_x"][-1]), 1e-9,
                "P stands in D, then in O"),
        Outside("height of P at the ends", "m", lambda p: 0.0, lambda p, m: float(max(m["P_z"][[0, -1]], key=abs)), 1e-9,
                "P stands in D, then in O"),
    ),
    chain="R + RRR", formulas="Dyad RRR; P below the middle of A-B.", sources=("Kempe, How to Draw a Straight Line, 1877",),
)  # fmt: skip
