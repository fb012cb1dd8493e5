"""The rhombic drive: two geared cranks move piston and displacer in line without side force."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Cranks about O and D turn as mirror images; the upper rods meet in the power piston, the lower in the displacer."""

    half: float = parameter(0.05, "m", "half the distance of the shafts", low=0, strict=True)
    crank: float = parameter(0.03, "m", "cranks", low=0, strict=True)
    rod: float = parameter(0.11, "m", "all four rods", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, its geared mirror image, two RRR."""
    rods = (p.rod, p.rod)
    return (
        Linkage("rhombic_drive").pivot("O", -p.half, 0.0).pivot("D", p.half, 0.0)
        .crank("left", "O", "A", p.crank).geared("right", "D", "B", p.crank, "left", -1, math.pi)
        .rrr("piston", ("rod_1", "rod_2"), ("A", "B"), rods, 1).rrr("displacer", ("rod_3", "rod_4"), ("A", "B"), rods, -1)
    )  # fmt: skip


def reach(p: Parameters, t: float) -> float:
    """Height of the rhombus above the pins, crank angle t: sqrt(rod^2 - (half - crank cos t)^2)."""
    return math.sqrt(p.rod**2 - (p.half - p.crank * math.cos(t)) ** 2)


ENTRY = planar_entry(
    "rhombic_drive", "Rhombic drive", "engine",
    summary="Four equal rods between two geared cranks: piston and displacer of a Stirling engine in line, out of phase.",
    use="Stirling engines with a sealed crankcase, fully balanced.", origin="Rolf Meijer, Philips, 1953", parameters=Parameters,
    linkage=linkage, path=lambda p: {"left_angle": (0.0, 2 * math.pi)}, width=lambda p: 0.3 * p.crank, servo=(20.0, 0.2),
    points=("piston", "displacer"), sliders=("crank", "rod"), plots=(PlotRecipe("piston and displacer", ("piston_z", "displacer_z")),),
    outside=(
        Outside("piston with the cranks upright", "m", lambda p: p.crank + reach(p, 0.5 * math.pi), lambda p, m: float(m["piston_z"][6]),
                1e-9, "rhombus"),
        Outside("gap from piston to displacer with the cranks inward", "m", lambda p: 2 * reach(p, 0.0),
                lambda p, m: float(m["piston_z"][0] - m["displacer_z"][0]), 1e-9, "rhombus"),
        Outside("side motion of the piston", "m", lambda p: 0.0, lambda p, m: farthest(m["piston_x"], 0.0), 1e-9, "symmetry"),
    ),
    chain="R, gears, 2 RRR", formulas="z = crank sin t +- sqrt(rod2 - (half - crank cos t)2).",
    sources=("Meijer, Der Philips-Stirlingmotor, MTZ 29, 1968",),
)  # fmt: skip
