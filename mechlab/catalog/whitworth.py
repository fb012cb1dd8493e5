"""Whitworth's quick return: a crank pin in a slotted lever that turns fully about an eccentric pivot."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A, slotted lever about Q inside its circle, arm Q-E of the lever, rod E-F, ram F along x."""

    crank: float = parameter(0.1, "m", "crank O-A; longer than the eccentricity", low=0, strict=True)
    eccentricity: float = parameter(0.05, "m", "pivots O-Q, Q below O", low=0, strict=True)
    arm: float = parameter(0.07, "m", "arm Q-E of the lever, opposite to the slot", low=0, strict=True)
    rod: float = parameter(0.3, "m", "rod E-F", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RPR, the arm, RRP."""
    return (
        Linkage("whitworth").pivot("O", 0.0, p.eccentricity).pivot("Q", 0.0, 0.0).guide("bed", 0.0, 0.0)
        .crank("crank", "O", "A", p.crank)
        .rpr("lever", "Q", "A").point("E", "lever", p.arm, math.pi).point("T", "lever", p.crank + p.eccentricity)
        .rrp("F", "rod", "E", "bed", p.rod, 1)
    )  # fmt: skip


def slow(p: Parameters) -> float:
    """Crank angle of the slow stroke, while A is above the level of Q: pi + 2 asin(eccentricity / crank). At both
    ends the lever lies along the bed and the ram stands still."""
    return math.pi + 2.0 * math.asin(p.eccentricity / p.crank)


ENTRY = planar_entry(
    "whitworth", "Whitworth quick return", "quick-return",
    summary="A crank drives a slotted lever about an eccentric pivot: slow stroke, quick return.",
    use="Shaping and slotting machines: cuts slowly, comes back fast, with an even crank.", origin="Joseph Whitworth, about 1840",
    parameters=Parameters, linkage=linkage, width=lambda p: 0.16 * p.crank,
    path=lambda p: {"crank_angle": (0.5 * (math.pi - slow(p)), 0.5 * (math.pi + slow(p)))}, links=("lever", "rod"), points=("E",),
    slides=("F",), sliders=("eccentricity", "arm"), plots=(PlotRecipe("ram", ("F_slide",)),),
    outside=(
        Outside("stroke of the ram", "m", lambda p: 2 * p.arm, lambda p, m: float(m["F_slide"][-1] - m["F_slide"][0]), 1e-9,
                "lever along the bed at both ends"),
        Outside("ram at rest after the slow stroke: its rate over that in the middle", "", lambda p: 0.0,
                lambda p, m: float(m["F_slide_rate"][-1] / m["F_slide_rate"][12]), 1e-9,
                "slow : quick = pi + 2 asin(e / r) : pi - 2 asin(e / r)"),
    ),
    chain="R + RPR + RRP", formulas="Dyads RPR and RRP.", sources=("Norton, Design of Machinery, 2.12",),
)  # fmt: skip
