"""A level-luffing crane: a double rocker whose jib head goes level, so that the load is moved without lifting it."""

from __future__ import annotations

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Jib O-A, back stay D-B, head link B-A-P with the pulley P in front."""

    jib: float = parameter(2.0, "m", "jib O-A", low=0, strict=True)
    stay: float = parameter(2.2, "m", "back stay D-B", low=0, strict=True)
    tail: float = parameter(0.5, "m", "tail A-B of the head", low=0, strict=True)
    head: float = parameter(1.1, "m", "head A-P", low=0, strict=True)
    behind: float = parameter(0.7, "m", "pivot D behind the jib's", low=0, strict=True)
    above: float = parameter(0.4, "m", "pivot D above it")
    speed: float = parameter(0.5, "rad/s", "speed of the jib in the scenes")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the pulley."""
    return (
        Linkage("luffing_crane").pivot("O", 0.0, 0.0).pivot("D", -p.behind, p.above)
        .crank("jib", "O", "A", p.jib).rrr("B", ("head", "stay"), ("A", "D"), (p.tail, p.stay), -1).point("P", "head", p.head,
                3.14159265358979)
    )  # fmt: skip


def pulley(p: Parameters, t: float) -> complex:
    """Pulley by compasses, jib at t: on the line from B through A."""
    a = at(p.jib, t)
    b = meet(a, p.tail, complex(-p.behind, p.above), p.stay, -1)
    return a + (a - b) * p.head / p.tail


LOW, HIGH = 0.9, 1.3
ENTRY = planar_entry(
    "luffing_crane", "Level-luffing crane", "lift",
    summary="A double rocker whose head goes nearly level: the load is luffed without work.", use="Harbour cranes.",
    origin="common in harbours since about 1910", parameters=Parameters, linkage=linkage, path=lambda p: {"jib_angle": (LOW, HIGH)},
    width=lambda p: 0.04 * p.jib, links=("head",), points=("P",), sliders=("stay", "head"), plots=(PlotRecipe("pulley", ("P_x", "P_z")),),
    outside=(
        Outside("reach of the pulley, jib lowered", "m", lambda p: pulley(p, LOW).real, lambda p, m: float(m["P_x"][0]), 1e-9,
                "ruler and compasses"),
        Outside("height of the pulley, jib raised", "m", lambda p: pulley(p, HIGH).imag, lambda p, m: float(m["P_z"][-1]), 1e-9,
                "ruler and compasses"),
    ),
    chain="R + RRR", formulas="Dyad RRR.", sources=("Artobolevsky, Mechanisms in Modern Engineering Design I",),
)  # fmt: skip
