"""The knuckle-joint press: a connecting rod bends two links of unequal length; slow near the bottom."""

from __future__ import annotations

import math

from mechlab.kit.compass import meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A, rod A-K; knuckle K between the upper link Q-K and the lower link K-F; the ram F goes down from Q."""

    upper: float = parameter(0.2, "m", "upper link Q-K", low=0, strict=True)
    lower: float = parameter(0.26, "m", "lower link K-F", low=0, strict=True)
    crank: float = parameter(0.04, "m", "crank O-A", low=0, strict=True)
    rod: float = parameter(0.3, "m", "rod A-K", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR at the knuckle, RRP at the ram; O stands so that the links are in line when crank and rod are."""
    return (
        Linkage("knuckle_press").pivot("O", -p.rod - p.crank - 0.002, -p.upper).pivot("Q", 0.0, 0.0).guide("column", 0.0, 0.0,
                -0.5 * math.pi)
        .crank("crank", "O", "A", p.crank)
        .rrr("K", ("rod", "upper_link"), ("A", "Q"), (p.rod, p.upper), -1)
        .rrp("F", "lower_link", "K", "column", p.lower, 1)
    )  # fmt: skip


def ram(p: Parameters, t: float) -> float:
    """Depth of the ram below Q with the crank at t, by compasses: knuckle, then the ram below it."""
    a = complex(-p.rod - p.crank - 0.002, -p.upper) + p.crank * complex(math.cos(t), math.sin(t))
    k = meet(a, p.rod, 0j, p.upper, -1)
    return -k.imag + math.sqrt(p.lower**2 - k.real**2)


ENTRY = planar_entry(
    "knuckle_press", "Knuckle-joint press", "press", summary="Crank, rod and knuckle: long dwell and high force at the bottom.",
    use="Coining and embossing.", origin="Diedrich Uhlhorn's coining press, 1817", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.1 * p.upper, servo=(20.0, 0.2),
    links=("upper_link", "lower_link"), points=("K",), slides=("F",), sliders=("lower", "rod"), plots=(PlotRecipe("ram", ("F_slide",)),),
    outside=(
        Outside("ram with the crank at 0", "m", lambda p: ram(p, 0.0), lambda p, m: float(m["F_slide"][0]), 1e-9, "ruler and compasses"),
        Outside("ram with the crank at 90 degrees", "m", lambda p: ram(p, 0.5 * math.pi), lambda p, m: float(m["F_slide"][6]), 1e-9,
                "ruler and compasses"),
    ),
    chain="R + RRR + RRP", formulas="Dyads RRR and RRP.", sources=("Artobolevsky, Mechanisms in Modern Engineering Design II",),
)  # fmt: skip
