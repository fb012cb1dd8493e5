"""The geared five-bar: two cranks joined by gears; one drive, coupler curves of many shapes."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Cranks O-A and D-B turn against each other; the equal rods meet in P."""

    ground: float = parameter(0.2, "m", "pivots O-D", low=0, strict=True)
    crank: float = parameter(0.06, "m", "both cranks", low=0, strict=True)
    rod: float = parameter(0.25, "m", "both rods", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, a crank geared to it 1 : -1 as its mirror image, RRR."""
    return (
        Linkage("geared_fivebar").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0)
        .crank("left", "O", "A", p.crank).geared("right", "D", "B", p.crank, "left", -1, math.pi)
        .rrr("P", ("rod_left", "rod_right"), ("A", "B"), (p.rod, p.rod), 1)
    )  # fmt: skip


def height(p: Parameters) -> float:
    """P with the cranks upright: crank + sqrt(rod^2 - (ground / 2)^2)."""
    return p.crank + math.sqrt(p.rod**2 - 0.25 * p.ground**2)


ENTRY = planar_entry(
    "geared_fivebar", "Geared five-bar", "dwell",
    summary="Five bars and a pair of gears: one freedom; as mirror images the cranks guide P straight.",
    use="Coupler curves beyond those of a four-bar; straight guides without side load.",
    origin="studied by Artobolevsky and by Freudenstein and Primrose, 1963", parameters=Parameters, linkage=linkage, released=0.5,
    path=lambda p: {"left_angle": (0.5 * math.pi, 2.5 * math.pi)}, width=lambda p: 0.2 * p.crank, links=("rod_left", "rod_right"),
    points=("P",), sliders=("crank", "rod"), plots=(PlotRecipe("point P", ("P_z",)),),
    outside=(
        Outside("P stays in the plane of symmetry", "m", lambda p: 0.5 * p.ground, lambda p, m: farthest(m["P_x"], 0.5 * p.ground), 1e-9,
                "symmetry"),
        Outside("height of P with the cranks upright", "m", height, lambda p, m: float(m["P_z"][0]), 1e-9, "Pythagoras"),
        Outside("turn of the right crank in one of the left", "rad", lambda p: -2 * np.pi,
                lambda p, m: float(m["right_angle"][-1] - m["right_angle"][0]), 1e-9, "external gears 1 : 1"),
    ),
    chain="R, gears, RRR", formulas="Dyad RRR between two cranks of opposite turn.",
    sources=("Artobolevsky, Mechanisms in Modern Engineering Design III",),
)  # fmt: skip
