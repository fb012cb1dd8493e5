"""A pump jack: crank, pitman and walking beam lift the rod of an oil well."""

from __future__ import annotations

import cmath
import math

from mechlab.kit.compass import corner
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank O-A, pitman A-B, beam on D from B to its head H beyond D; the head is an arc about D, so the rod hangs plumb."""

    crank: float = parameter(0.9, "m", "crank", low=0, strict=True)
    pitman: float = parameter(3.0, "m", "pitman", low=0, strict=True)
    tail: float = parameter(2.4, "m", "beam from D to the pitman", low=0, strict=True)
    head: float = parameter(3.0, "m", "beam from D to its head", low=0, strict=True)
    base: float = parameter(2.4, "m", "crankshaft beside D", low=0, strict=True)
    height: float = parameter(3.1, "m", "crankshaft below D", low=0, strict=True)
    speed: float = parameter(1.0, "rad/s", "speed of the crank")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the head across the beam."""
    return (
        Linkage("pump_jack").pivot("O", 0.0, 0.0).pivot("D", -p.base, p.height)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("pitman", "beam"), ("A", "D"), (p.pitman, p.tail), -1).point("H", "beam", p.head, math.pi)
    )  # fmt: skip


def swing(p: Parameters) -> float:
    """Of the beam: at the dead centres crank and pitman are in line, O-B is pitman +- crank; law of cosines at D."""
    post = math.hypot(p.base, p.height)
    return corner(post, p.tail, p.pitman + p.crank) - corner(post, p.tail, p.pitman - p.crank)


def dead(p: Parameters, reach: float, turn: float) -> float:
    """Crank angle of a dead centre: direction of O-B, its length `reach`, by the law of cosines at O."""
    post = complex(-p.base, p.height)
    return cmath.phase(post) - corner(abs(post), reach, p.tail) + turn


ENTRY = planar_entry(
    "pump_jack", "Pump jack", "engine", summary="A crank rocks a beam whose curved head pulls the rod of a well straight up and down.",
    use="Pumping of oil wells too weak to flow.", origin="Walter Trout, 1925", parameters=Parameters, linkage=linkage, timestep=2e-3,
    path=lambda p: {"crank_angle": (dead(p, p.pitman + p.crank, 0.0), dead(p, p.pitman - p.crank, math.pi))},
    width=lambda p: 0.1 * p.crank, links=("beam",), points=("H",), sliders=("crank", "head"), plots=(PlotRecipe("head", ("H_z",)),),
    outside=(Outside("stroke of the rod, head times swing of the beam, from dead centre to dead centre", "m", lambda p: p.head * swing(p),
                     lambda p, m: p.head * abs(float(m["beam_angle"][-1] - m["beam_angle"][0])), 1e-9, "law of cosines"),),
    chain="R + RRR", formulas="Dyad RRR.", sources=("API Spec 11E, Pumping Units",),
)  # fmt: skip
