"""A Stephenson III six-bar whose second coupler carries a point, anywhere in the plane: what path synthesis with six bars finds."""

from __future__ import annotations

from mechlab.catalog import path_fourbar
from mechlab.kit.compass import at, meet
from mechlab.kit.short import Linkage, PlotRecipe, parameter, planar_entry, point_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(path_fourbar.Parameters):
    """Four-bar O-A-B-D with the joint C on its coupler, dyad C-E-G, point P of the link C-E; the crank goes from `first` on by `turn`."""

    joint: float = parameter(0.15, "m", "joint C of the coupler: distance A-C", low=0)
    joint_angle: float = parameter(0.7, "rad", "joint C: from A-B to A-C, counter-clockwise")
    link: float = parameter(0.16, "m", "link C-E", low=0, strict=True)
    output: float = parameter(0.2, "m", "output G-E", low=0, strict=True)
    output_x: float = parameter(0.2, "m", "pivot G of the output, x")
    output_y: float = parameter(0.3, "m", "pivot G of the output, y")
    mode_output: int = parameter(1, "", "+1: E left of the way from C to G, -1: right", low=-1, high=1)
    point: float = parameter(0.1, "m", "point P of the link: distance C-P", low=0)
    point_angle: float = parameter(0.5, "rad", "point P: from C-E to C-P, counter-clockwise")


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, a joint of the coupler, RRR, a point of its link."""
    d = complex(p.pivot_x, p.pivot_y) + at(p.ground, p.tilt)
    return (
        Linkage("path_stephenson").pivot("O", p.pivot_x, p.pivot_y).pivot("D", d.real, d.imag).pivot("G", p.output_x, p.output_y)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (p.coupler, p.rocker), p.mode or 1).point("C", "coupler", p.joint, p.joint_angle)
        .rrr("E", ("link", "output"), ("C", "G"), (p.link, p.output), p.mode_output or 1).point("P", "link", p.point, p.point_angle)
    )  # fmt: skip


def by_hand(p: Parameters, place: float) -> complex:
    """P by compasses, at a share of the path."""
    o = complex(p.pivot_x, p.pivot_y)
    a = o + at(p.crank, p.first + place * p.turn)
    b = meet(a, p.coupler, o + at(p.ground, p.tilt), p.rocker, p.mode or 1)
    c = a + (b - a) / p.coupler * at(p.joint, p.joint_angle)
    e = meet(c, p.link, complex(p.output_x, p.output_y), p.output, p.mode_output or 1)
    return c + (e - c) / p.link * at(p.point, p.point_angle)


ENTRY = planar_entry(
    "path_stephenson", "Path six-bar (Stephenson III)", "linkage",
    summary="Four-bar and a dyad on its coupler, whose link carries a point: curves of more kinds than a four-bar has.",
    use="The result of `synthesize path chain=six-bar`.", origin="chains named after Watt and Stephenson: Burmester, 1888",
    parameters=Parameters, linkage=linkage, path=lambda p: {"crank_angle": (p.first, p.first + p.turn)}, timestep=2e-3,
    width=lambda p: 0.12 * p.rocker,
    links=("coupler", "rocker", "link", "output"), points=("P",), sliders=("coupler", "point"),
    plots=(PlotRecipe("point P", ("P_x", "P_z")),),
    outside=(*point_at("P", lambda p: by_hand(p, 0.25), "ruler and compasses", 6),
             *point_at("P", lambda p: by_hand(p, 0.625), "ruler and compasses", 15)),
    chain="R + RRR + RRR", formulas="Two dyads RRR in series, a point of the second.", sources=("Norton, Design of Machinery, 3.8",),
)  # fmt: skip
