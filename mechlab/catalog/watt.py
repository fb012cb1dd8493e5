"""Watt's linkage: two levers and a coupler whose middle goes nearly straight."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Levers O-A and Q-B, coupler A-B with its middle P; in the middle position the levers stand at right angles to the coupler."""

    lever: float = parameter(0.2, "m", "levers O-A and Q-B", low=0, strict=True)
    coupler: float = parameter(0.1, "m", "coupler A-B", low=0, strict=True)
    swing: float = parameter(0.35, "rad", "half of the swing of the left lever", low=0, high=0.5, strict=True)


def half(p: Parameters) -> float:
    """Half the distance of the pivots [m]: hypotenuse of lever and half coupler."""
    return math.hypot(p.lever, 0.5 * p.coupler)


def linkage(p: Parameters) -> Linkage:
    """Driver and RRR."""
    return (
        Linkage("watt").pivot("O", -half(p), 0.0).pivot("Q", half(p), 0.0)
        .crank("left", "O", "A", p.lever)
        .rrr("B", ("coupler", "right"), ("A", "Q"), (p.coupler, p.lever), -1)
        .point("P", "coupler", 0.5 * p.coupler)
    )  # fmt: skip


def sextic(p: Parameters, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Watt's curve, relative to the sixth power of half the pivot distance: zero on the path of P."""
    a, r2 = half(p), x**2 + y**2
    return (r2 * (r2 - a**2 - p.lever**2 + 0.25 * p.coupler**2) ** 2 + 4 * a**2 * y**2 * (r2 - p.lever**2)) / a**6


ENTRY = planar_entry(
    "watt", "Watt's linkage", "straight-line", summary="Two levers and a coupler whose middle goes nearly straight.",
    use="Guides the piston rod of a steam engine, today the axle of a car, without a sliding guide.", origin="James Watt, 1784",
    parameters=Parameters, linkage=linkage, width=lambda p: 0.08 * p.lever,
    path=lambda p: {"left_angle": tuple(math.atan2(0.5 * p.coupler, p.lever) + s * p.swing for s in (-1, 1))}, links=("coupler", "right"),
    points=("P",), sliders=("lever", "coupler"), plots=(PlotRecipe("middle of the coupler", ("P_x", "P_z")),),
    outside=(
        Outside("P lies on Watt's sextic: largest residual", "", lambda p: 0.0,
                lambda p, m: farthest(sextic(p, m["P_x"], m["P_z"]), 0.0), 1e-12,
                "(x2+y2)(x2+y2-a2-b2+c2)2 + 4a2y2(x2+y2-b2) = 0: Lockwood, A Book of Curves, 1961"),
    ),
    chain="R + RRR", formulas="Dyad RRR; P is the middle of A-B.", sources=("Artobolevsky, Mechanisms in Modern Engineering Design I",),
)  # fmt: skip
