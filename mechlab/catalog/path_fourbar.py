"""A four-bar with a coupler point, anywhere in the plane and over any turn of its crank: what path and function synthesis find."""

from __future__ import annotations

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, PlotRecipe, parameter, planar_entry, point_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Pivots O and D, crank O-A, coupler A-B with the point P, rocker D-B; the crank goes from `first` on by `turn`."""

    pivot_x: float = parameter(0.0, "m", "pivot O of the crank, x")
    pivot_y: float = parameter(0.0, "m", "pivot O of the crank, y")
    tilt: float = parameter(0.0, "rad", "direction of the ground, from O to D")
    crank: float = parameter(0.08, "m", "crank O-A", low=0, strict=True)
    coupler: float = parameter(0.2, "m", "coupler A-B", low=0, strict=True)
    rocker: float = parameter(0.18, "m", "rocker D-B", low=0, strict=True)
    ground: float = parameter(0.22, "m", "ground O-D", low=0, strict=True)
    mode: int = parameter(1, "", "+1: B left of the way from A to D, -1: right", low=-1, high=1)
    point: float = parameter(0.15, "m", "coupler point: distance A-P", low=0)
    point_angle: float = parameter(0.7, "rad", "coupler point: from A-B to A-P, counter-clockwise")
    first: float = parameter(0.0, "rad", "crank angle at the beginning of the path, from the x axis")
    turn: float = parameter(6.283185307179586, "rad", "turn of the crank along the path, negative: clockwise")
    speed: float = parameter(1.0, "rad/s", "speed of the drive in the scenes")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, a point of the coupler."""
    d = complex(p.pivot_x, p.pivot_y) + at(p.ground, p.tilt)
    return (
        Linkage("path_fourbar").pivot("O", p.pivot_x, p.pivot_y).pivot("D", d.real, d.imag).crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (p.coupler, p.rocker), p.mode or 1).point("P", "coupler", p.point, p.point_angle)
    )  # fmt: skip


def by_hand(p: Parameters, place: float) -> complex:
    """P by compasses, at a share of the path."""
    o = complex(p.pivot_x, p.pivot_y)
    a = o + at(p.crank, p.first + place * p.turn)
    b = meet(a, p.coupler, o + at(p.ground, p.tilt), p.rocker, p.mode or 1)
    return a + (b - a) / p.coupler * at(p.point, p.point_angle)


ENTRY = planar_entry(
    "path_fourbar", "Path four-bar", "linkage",
    summary="Four-bar with a coupler point, placed and turned as a synthesis of a path demands.",
    use="The result of `synthesize path`, `function` and `straight_line`.", origin="coupler curves: Watt, 1784; Roberts, 1875",
    parameters=Parameters, linkage=linkage, path=lambda p: {"crank_angle": (p.first, p.first + p.turn)}, timestep=2e-3,
    width=lambda p: 0.12 * p.rocker,
    links=("coupler", "rocker"), points=("P",), sliders=("coupler", "point"), plots=(PlotRecipe("point P", ("P_x", "P_z")),),
    outside=(*point_at("P", lambda p: by_hand(p, 0.25), "ruler and compasses", 6),
             *point_at("P", lambda p: by_hand(p, 0.625), "ruler and compasses", 15)),
    chain="R + RRR", formulas="Dyad RRR and a point of its first link.", sources=("Hrones and Nelson, Analysis of the Four-Bar Linkage",),
)  # fmt: skip
