"""The Scotch yoke: a pin in a cross slot moves the yoke as a pure cosine."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A; the yoke slides along x, its slot stands at right angles to it."""

    crank: float = parameter(0.1, "m", "crank O-A", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver and RPP."""
    return Linkage("scotch_yoke").pivot("O", 0.0, 0.0).guide("bed", 0.0, 0.0).crank("crank", "O", "A", p.crank).rpp("yoke", "A", "bed",
            math.pi / 2)


ENTRY = planar_entry(
    "scotch_yoke", "Scotch yoke", "engine", summary="A crank pin in the cross slot of a yoke: the yoke moves as a pure cosine.",
    use="Pumps, valve actuators and vibration tables: harmonic motion without the second order of a rod.",
    origin="known in the 18th century; Bourke's engine, 1938", parameters=Parameters, linkage=linkage,
    path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.2 * p.crank, slides=("yoke_1", "yoke_2"), sliders=("crank",),
    plots=(PlotRecipe("yoke", ("yoke_1_slide",)),),
    outside=(
        Outside("stroke of the yoke", "m", lambda p: 2 * p.crank, lambda p, m: float(m["yoke_1_slide"][0] - m["yoke_1_slide"][12]), 1e-9,
                "x = r cos t"),
        Outside("x^2 + (x' / w)^2 = r^2 over the turn", "m2", lambda p: p.crank**2,
                lambda p, m: farthest(m["yoke_1_slide"] ** 2 + (m["yoke_1_slide_rate"] / (2 * math.pi)) ** 2, p.crank**2), 1e-9,
                "x = r cos t, x' = -r w sin t"),
    ),
    chain="R + RPP", formulas="Dyad RPP: x = crank cos(angle).", sources=("Norton, Design of Machinery, 2.12",),
)  # fmt: skip
