"""A radial engine: a master rod on the crank pin carries the knuckle pins of the other rods."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Cylinder 1, upright, has the master rod; the others are spaced evenly, their rods hang on it."""

    cylinders: int = parameter(5, "", "cylinders", low=3, high=9)
    crank: float = parameter(0.06, "m", "crank", low=0, strict=True)
    rod: float = parameter(0.22, "m", "master rod", low=0, strict=True)
    knuckle: float = parameter(0.045, "m", "knuckle pins, from the crank pin; the other rods are shorter by it", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, the master as RRP, for each other cylinder a point of the master rod and an RRP."""
    up, step = 0.5 * math.pi, 2 * math.pi / p.cylinders
    chain = Linkage("radial_engine").pivot("O", 0.0, 0.0).guide("bore_1", 0.0, 0.0, up)
    chain = chain.crank("crank", "O", "A", p.crank).rrp("piston_1", "master", "A", "bore_1", p.rod, 1)
    for k in range(2, p.cylinders + 1):
        turn = (k - 1) * step
        chain = chain.guide(f"bore_{k}", 0.0, 0.0, up + turn).point(f"knuckle_{k}", "master", p.knuckle, turn)
        chain = chain.rrp(f"piston_{k}", f"rod_{k}", f"knuckle_{k}", f"bore_{k}", p.rod - p.knuckle, 1)
    return chain


def second(p: Parameters) -> float:
    """Piston 2 with the crank upright: master upright too, so its knuckle lies at (0, r) + knuckle at the angle of bore 2 from upright."""
    turn = 2 * math.pi / p.cylinders
    x, y = -p.knuckle * math.sin(turn), p.crank + p.knuckle * math.cos(turn)
    along, off = -x * math.sin(turn) + y * math.cos(turn), x * math.cos(turn) + y * math.sin(turn)
    return along + math.sqrt((p.rod - p.knuckle) ** 2 - off**2)


ENTRY = planar_entry(
    "radial_engine", "Radial engine", "engine", summary="One master rod, the others on its knuckles: all pistons in one plane.",
    use="Aircraft engines with a short crankshaft.", origin="Charles Manly, 1901", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.5 * math.pi, 2.5 * math.pi)}, width=lambda p: 0.3 * p.crank, slides=("piston_1", "piston_2"),
    links=("master",), sliders=("rod", "knuckle"), plots=(PlotRecipe("pistons", ("piston_1_slide", "piston_2_slide")),),
    outside=(
        Outside("stroke of the master piston", "m", lambda p: 2 * p.crank,
                lambda p, m: float(m["piston_1_slide"][0] - m["piston_1_slide"][12]), 1e-9, "twice the crank"),
        Outside("piston 2 with the crank upright", "m", second, lambda p, m: float(m["piston_2_slide"][0]), 1e-9,
                "knuckle and rod, Pythagoras"),
    ),
    chain="R + n RRP", formulas="Dyads RRP, the first one carries the pins of the others.",
    sources=("Artobolevsky, Mechanisms in Modern Engineering Design II",),
)  # fmt: skip
