"""Hoeken's linkage: a crank-rocker whose coupler end walks a nearly straight line at nearly constant speed."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A turns; rocker D-B; the coupler A-B goes on to P, as long again."""

    crank: float = parameter(0.05, "m", "crank O-A", low=0, strict=True)
    ground: float = parameter(0.1, "m", "ground O-D, two cranks", low=0, strict=True)
    rocker: float = parameter(0.125, "m", "rocker D-B and coupler A-B, 2.5 cranks", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, and the end of the coupler."""
    return (
        Linkage("hoeken").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (p.rocker, p.rocker), 1)
        .point("P", "coupler", 2.0 * p.rocker)
    )  # fmt: skip


ENTRY = planar_entry(
    "hoeken", "Hoeken's linkage", "straight-line",
    summary="Four-bar 2 : 1 : 2.5 whose coupler end goes straight at nearly constant speed for half a turn.",
    use="Walking machines, feeders and wave simulators that need an even straight stroke from a turning crank.",
    origin="Karl Hoecken, 1926", parameters=Parameters, linkage=linkage, released=1.0, path=lambda p: {"crank_angle": (0.0, 2.0 * math.pi)},
    width=lambda p: 0.1 * p.rocker, links=("coupler", "rocker"), points=("P",), sliders=("crank", "ground"),
    plots=(PlotRecipe("end of the coupler", ("P_x", "P_z")),),
    outside=(
        # triangle A-B-D is isosceles and B the middle of A-P, so the angle A-D-P is right: |DP|^2 = |AP|^2 - |AD|^2 in every pose
        Outside("distance of P from D with the crank at 0", "m", lambda p: math.sqrt((2 * p.rocker) ** 2 - (p.ground - p.crank) ** 2),
                lambda p, m: float(np.hypot(m["P_x"] - p.ground, m["P_z"])[0]), 1e-9, "Thales' theorem: A, D, P on a circle about B"),
    ),
    chain="R + RRR", formulas="Dyad RRR; P on the line A-B beyond B, B the middle of A-P.",
    sources=("Norton, Design of Machinery, table 3-1: the optimum proportions of Hoeken's linkage",),
)  # fmt: skip
