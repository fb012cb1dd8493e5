"""A V-engine: two pistons on one crank pin."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Cylinders at +- half of the V angle from the upright."""

    crank: float = parameter(0.04, "m", "crank", low=0, strict=True)
    rod: float = parameter(0.14, "m", "connecting rods", low=0, strict=True)
    angle: float = parameter(1.0472, "rad", "V angle", low=0, high=3.1)


def linkage(p: Parameters) -> Linkage:
    """Driver and two RRP."""
    up, half = 0.5 * math.pi, 0.5 * p.angle
    return (
        Linkage("v_engine").pivot("O", 0.0, 0.0).guide("bore_1", 0.0, 0.0, up + half).guide("bore_2", 0.0, 0.0, up - half)
        .crank("crank", "O", "A", p.crank)
        .rrp("piston_1", "rod_1", "A", "bore_1", p.rod, 1).rrp("piston_2", "rod_2", "A", "bore_2", p.rod, 1)
    )  # fmt: skip


def piston(p: Parameters, t: float) -> float:
    """Distance of a piston from the shaft, crank at t from its bore: r cos t + sqrt(l^2 - r^2 sin^2 t)."""
    return p.crank * math.cos(t) + math.sqrt(p.rod**2 - (p.crank * math.sin(t)) ** 2)


ENTRY = planar_entry(
    "v_engine", "V-engine", "engine", summary="Two connecting rods side by side on one pin, cylinders in a V.",
    use="Motorcycles, cars, compressors.", origin="Gottlieb Daimler and Wilhelm Maybach, 1889", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.4 * p.crank, servo=(20.0, 0.2), slides=("piston_1", "piston_2"),
    sliders=("rod", "angle"), plots=(PlotRecipe("pistons", ("piston_1_slide", "piston_2_slide")),),
    outside=(
        Outside("piston 1 with the crank at 0", "m", lambda p: piston(p, 0.5 * math.pi + 0.5 * p.angle),
                lambda p, m: float(m["piston_1_slide"][0]), 1e-9, "r cos t + sqrt(l2 - r2 sin2 t)"),
        Outside("piston 2 with the crank upright", "m", lambda p: piston(p, 0.5 * p.angle), lambda p, m: float(m["piston_2_slide"][6]),
                1e-9, "r cos t + sqrt(l2 - r2 sin2 t)"),
    ),
    chain="R + 2 RRP", formulas="s = r cos t + sqrt(l2 - r2 sin2 t).", sources=("Heywood, Internal Combustion Engine Fundamentals, 2.2",),
)  # fmt: skip
