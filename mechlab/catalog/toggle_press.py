"""The toggle press: a crank straightens two links, and the force on the ram grows without bound near the end."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Knee K between the upper link Q-K and the lower link K-F; crank O-A and rod A-K push the knee; the ram F goes along -y."""

    link: float = parameter(0.2, "m", "both links of the toggle, Q-K and K-F", low=0, strict=True)
    crank: float = parameter(0.05, "m", "crank O-A", low=0, strict=True)
    rod: float = parameter(0.25, "m", "rod A-K", low=0, strict=True)
    pivot_x: float = parameter(-0.28, "m", "crank pivot O, x; Q stands at 0")
    pivot_y: float = parameter(-0.2, "m", "crank pivot O, y")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR at the knee, RRP at the ram."""
    return (
        Linkage("toggle_press").pivot("O", p.pivot_x, p.pivot_y).pivot("Q", 0.0, 0.0).guide("column", 0.0, 0.0, -math.pi / 2)
        .crank("crank", "O", "A", p.crank)
        .rrr("K", ("rod", "upper"), ("A", "Q"), (p.rod, p.link), -1)
        .rrp("F", "lower", "K", "column", p.link, 1)
    )  # fmt: skip


ENTRY = planar_entry(
    "toggle_press", "Toggle press", "press",
    summary="Crank, rod and knee: near the straight knee a small force moves the ram with a large one.",
    use="Presses, crushers, clamps, injection moulding machines.", origin="the knee lever is old; printing presses from about 1800",
    parameters=Parameters, linkage=linkage, path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.1 * p.link,
    servo=(20.0, 0.2), links=("rod", "upper", "lower"), points=("K",), slides=("F",), sliders=("crank", "rod"),
    plots=(PlotRecipe("ram", ("F_slide",)),),
    outside=(
        # isosceles triangle Q-K-F: F = 2 link cos(angle of the upper link to the column), F' = -2 link sin(...) times its rate
        Outside("ram against the knee angle, largest misfit", "m", lambda p: 0.0,
                lambda p, m: float(np.max(np.abs(m["F_slide"] - 2 * p.link * np.cos(m["upper_angle"] + np.pi / 2)))), 1e-9,
                "isosceles triangle Q-K-F"),
        Outside("speed of the ram over that of the knee angle, at the start", "m", lambda p: 1.0,
                lambda p, m: float(m["F_slide_rate"][3] / (-2 * p.link * np.cos(m["upper_angle"][3]) * m["upper_angle_rate"][3])),
                1e-9, "derivative of the same"),
    ),
    chain="R + RRR + RRP", formulas="Dyads RRR and RRP.", sources=("Artobolevsky, Mechanisms in Modern Engineering Design II",),
)  # fmt: skip
