"""Chebyshev's straight-line linkage: crossed rockers 5 : 4 : 2."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Pivots O and D, crossed rockers O-A and D-B, coupler A-B with its middle P."""

    ground: float = parameter(0.2, "m", "pivots O-D; the rockers are 5/4 and the coupler 1/2 of it", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and RRR, crossed. The path goes from near the right end, where coupler and right rocker are in line, to the left end."""
    u = 0.25 * p.ground
    return (
        Linkage("chebyshev").pivot("O", 0.0, 0.0).pivot("D", 4 * u, 0.0)
        .crank("left", "O", "A", 5 * u)
        .rrr("B", ("coupler", "right"), ("A", "D"), (2 * u, 5 * u), -1)
        .point("P", "coupler", u)
    )  # fmt: skip


ENTRY = planar_entry(
    "chebyshev", "Chebyshev's straight-line linkage", "straight-line",
    summary="Crossed rockers 5, ground 4, coupler 2: the middle of the coupler goes nearly straight over the ground line.",
    use="A straight guide without a slide; the problem from which Chebyshev's approximation theory grew.",
    origin="Pafnuty Chebyshev, 1853", parameters=Parameters, linkage=linkage, timestep=5e-4, width=lambda p: 0.06 * p.ground,
    path=lambda p: {"left_angle": (math.atan2(3, 4) + 0.02, math.pi / 2)}, links=("coupler", "right"), points=("P",), sliders=("ground",),
    plots=(PlotRecipe("middle of the coupler", ("P_x", "P_z")),),
    outside=(
        # left end: A stands 5 above O; B at (0, 3), since 3-4-5 is right-angled; so P at (0, 4), as high as in the middle position
        Outside("height of P at the left end", "m", lambda p: p.ground, lambda p, m: float(m["P_z"][-1]), 1e-9, "right triangle 3-4-5"),
        Outside("P over O at the left end", "m", lambda p: 0.0, lambda p, m: float(m["P_x"][-1]), 1e-9, "right triangle 3-4-5"),
    ),
    chain="R + RRR", formulas="Dyad RRR; P is the middle of A-B.",
    sources=("Chebyshev, Theorie des mecanismes connus sous le nom de parallelogrammes, 1854",),
)  # fmt: skip
