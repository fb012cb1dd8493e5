"""A six-bar dwell from a straight line: a slotted lever guides the coupler point of a four-bar and rests while it goes along the slot."""

from __future__ import annotations

import math

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, PlotRecipe, parameter, planar_entry, point_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Crank-rocker O-A-B-D with coupler point P; slotted lever about Q; the crank turns once, from `first` on."""

    crank: float = parameter(0.05, "m", "crank O-A", low=0, strict=True)
    coupler: float = parameter(0.2273, "m", "coupler A-B", low=0, strict=True)
    rocker: float = parameter(0.2472, "m", "rocker D-B", low=0, strict=True)
    ground: float = parameter(0.1876, "m", "ground O-D", low=0, strict=True)
    mode: int = parameter(1, "", "+1: B left of the way from A to D, -1: right", low=-1, high=1)
    point: float = parameter(0.2935, "m", "coupler point: distance A-P", low=0)
    point_angle: float = parameter(0.2129, "rad", "coupler point: from A-B to A-P, counter-clockwise")
    pivot_x: float = parameter(0.117, "m", "pivot Q of the slotted lever, x, from O")
    pivot_y: float = parameter(0.3743, "m", "pivot Q of the slotted lever, y, from O")
    lever: float = parameter(0.21, "m", "lever Q-T: as far as the slot reaches", low=0, strict=True)
    first: float = parameter(4.06, "rad", "crank angle at the beginning")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, the coupler point, RPR."""
    return (
        Linkage("slotted_dwell").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0).pivot("Q", p.pivot_x, p.pivot_y)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (p.coupler, p.rocker), p.mode or 1).point("P", "coupler", p.point, p.point_angle)
        .rpr("lever", "Q", "P").point("T", "lever", p.lever)
    )  # fmt: skip


def by_hand(p: Parameters, place: float) -> complex:
    """T by compasses, at a share of the turn: on the way from Q to P."""
    a = at(p.crank, p.first + 2.0 * math.pi * place)
    b = meet(a, p.coupler, complex(p.ground), p.rocker, p.mode or 1)
    q = complex(p.pivot_x, p.pivot_y)
    way = a + (b - a) / p.coupler * at(p.point, p.point_angle) - q
    return q + p.lever * way / abs(way)


ENTRY = planar_entry(
    "slotted_dwell", "Slotted dwell", "dwell",
    summary="A slotted lever over the straight part of a coupler curve: it rests for a quarter of a turn and swings by 45 degrees.",
    use="The result of `synthesize dwell segment=straight`.", origin="dwells by coupler curves: Hain, 1961", parameters=Parameters,
    linkage=linkage, path=lambda p: {"crank_angle": (p.first, p.first + 2.0 * math.pi)}, width=lambda p: 0.25 * p.crank,
    links=("coupler", "lever"), points=("P", "T"), sliders=("coupler", "pivot_x"), plots=(PlotRecipe("lever", ("lever_angle",)),),
    outside=(*point_at("T", lambda p: by_hand(p, 0.25), "ruler and compasses", 6),
             *point_at("T", lambda p: by_hand(p, 0.625), "ruler and compasses", 15)),
    chain="R + RRR + RPR", formulas="Dyads RRR and RPR.", sources=("Norton, Design of Machinery, 3.9",),
)  # fmt: skip
