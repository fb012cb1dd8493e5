"""A geared five-bar with a coupler point, anywhere in the plane: what path synthesis finds where a four-bar does not reach."""

from __future__ import annotations

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, PlotRecipe, parameter, planar_entry, point_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Pivots O and D, crank O-A, second crank D-C geared to it, coupler A-B with the point P, link C-B."""

    pivot_x: float = parameter(0.0, "m", "pivot O of the crank, x")
    pivot_y: float = parameter(0.0, "m", "pivot O of the crank, y")
    tilt: float = parameter(0.0, "rad", "direction of the ground, from O to D")
    ground: float = parameter(0.25, "m", "ground O-D", low=0, strict=True)
    crank: float = parameter(0.08, "m", "crank O-A", low=0, strict=True)
    second: float = parameter(0.05, "m", "second crank D-C", low=0, strict=True)
    gear_ratio: int = parameter(-2, "", "turns of the second crank in one of the first, not 0; negative: external gears", low=-4, high=4)
    phase: float = parameter(0.5, "rad", "angle of the second crank with the first at 0, both from the x axis")
    coupler: float = parameter(0.25, "m", "coupler A-B", low=0, strict=True)
    link: float = parameter(0.22, "m", "link C-B", low=0, strict=True)
    mode: int = parameter(1, "", "+1: B left of the way from A to C, -1: right", low=-1, high=1)
    point: float = parameter(0.2, "m", "coupler point: distance A-P", low=0)
    point_angle: float = parameter(0.5, "rad", "coupler point: from A-B to A-P, counter-clockwise")
    first: float = parameter(0.0, "rad", "crank angle at the beginning of the path, from the x axis")
    turn: float = parameter(6.283185307179586, "rad", "turn of the crank along the path, negative: clockwise")
    speed: float = parameter(1.0, "rad/s", "speed of the drive in the scenes")


def linkage(p: Parameters) -> Linkage:
    """Driver, a crank geared to it, RRR, a point of the coupler."""
    d = complex(p.pivot_x, p.pivot_y) + at(p.ground, p.tilt)
    return (
        Linkage("path_fivebar").pivot("O", p.pivot_x, p.pivot_y).pivot("D", d.real, d.imag).crank("crank", "O", "A", p.crank)
        .geared("second", "D", "C", p.second, "crank", p.gear_ratio or 1, p.phase)
        .rrr("B", ("coupler", "link"), ("A", "C"), (p.coupler, p.link), p.mode or 1).point("P", "coupler", p.point, p.point_angle)
    )  # fmt: skip


def by_hand(p: Parameters, place: float) -> complex:
    """P by compasses, at a share of the path."""
    t, o = p.first + place * p.turn, complex(p.pivot_x, p.pivot_y)
    a, c = o + at(p.crank, t), o + at(p.ground, p.tilt) + at(p.second, p.phase + (p.gear_ratio or 1) * t)
    b = meet(a, p.coupler, c, p.link, p.mode or 1)
    return a + (b - a) / p.coupler * at(p.point, p.point_angle)


ENTRY = planar_entry(
    "path_fivebar", "Geared path five-bar", "linkage",
    summary="Five bars and a pair of gears with a coupler point, placed as a path demands.",
    use="The result of `synthesize path` where a four-bar does not reach.", origin="Freudenstein and Primrose, 1963", parameters=Parameters,
    linkage=linkage, path=lambda p: {"crank_angle": (p.first, p.first + p.turn)}, width=lambda p: 0.12 * p.link,
    links=("coupler", "link"), points=("P",), sliders=("second", "phase"), plots=(PlotRecipe("point P", ("P_x", "P_z")),),
    outside=(*point_at("P", lambda p: by_hand(p, 0.25), "ruler and compasses", 6),
             *point_at("P", lambda p: by_hand(p, 0.625), "ruler and compasses", 15)),
    chain="R, gears, RRR", formulas="Dyad RRR between geared cranks.", sources=("Freudenstein and Primrose, J. Appl. Mech. 30, 1963",),
)  # fmt: skip
