"""A Stephenson III six-bar: a four-bar and a dyad RRR from a point of its coupler to the ground."""

from __future__ import annotations

from mechlab.analytic.linkage import Linkage
from mechlab.experiment.entry import Entry, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.kit.planar_build import Style
from mechlab.kit.planar_entry import Planar
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters:
    """Four-bar O-A-B-D, coupler point P, dyad P-R-G."""

    crank: float = parameter(0.1, "m", "crank O-A", low=0, strict=True)
    coupler: float = parameter(0.3, "m", "coupler A-B", low=0, strict=True)
    rocker: float = parameter(0.25, "m", "rocker D-B", low=0, strict=True)
    ground: float = parameter(0.3, "m", "ground O-D", low=0, strict=True)
    point: float = parameter(0.2, "m", "coupler point: distance A-P", low=0, strict=True)
    point_angle: float = parameter(0.6, "rad", "coupler point: from A-B to A-P, counter-clockwise")
    link: float = parameter(0.25, "m", "link P-R", low=0, strict=True)
    output: float = parameter(0.3, "m", "output G-R", low=0, strict=True)
    pivot_x: float = parameter(0.45, "m", "pivot G, x")
    pivot_y: float = parameter(0.1, "m", "pivot G, y")
    mode: int = parameter(1, "", "+1: B left of the way from A to D, -1: right", low=-1, high=1)
    mode_output: int = parameter(1, "", "+1: R left of the way from P to G, -1: right", low=-1, high=1)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(6.0, "rad/s", "crank speed of the scenes", scene=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RRR, a point of the coupler, RRR."""
    return (
        Linkage("stephenson").pivot("O", 0.0, 0.0).pivot("D", p.ground, 0.0).pivot("G", p.pivot_x, p.pivot_y)
        .crank("crank", "O", "A", p.crank)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (p.coupler, p.rocker), p.mode or 1)
        .point("P", "coupler", p.point, p.point_angle)
        .rrr("R", ("link", "output"), ("P", "G"), (p.link, p.output), p.mode_output or 1)
    )  # fmt: skip


PLANAR = Planar(
    name="stephenson", summary="Stephenson III six-bar linkage", linkage=linkage,
    start=lambda p: {"crank": 1.0}, speeds=lambda p: {"crank": p.speed},
    style=lambda p: Style(p.mass_per_length, gravity=p.gravity, width=0.06 * max(p.coupler, p.output)),
    points=("A", "B", "P", "R"), links=("coupler", "rocker", "link", "output"),
)  # fmt: skip

ENTRY = Entry(
    name="stephenson",
    title="Stephenson six-bar",
    family="linkage",
    summary="Four-bar with a dyad on its coupler point (Stephenson III); four assembly modes.",
    parameters=Parameters,
    build=PLANAR.build,
    fidelities={"kinematic": "closed form", "minimal": "five bars, two pins; exact dynamics"},
    default_fidelity="minimal",
    scenes=PLANAR.scenes(),
    default_scene="driven-crank",
    sliders=("crank", "link"),
    plots=(
        PlotRecipe("output angle", ("output_angle",)),
        PlotRecipe("output speed", ("output_angle_rate",)),
    ),
    questions=(PLANAR.question(),),
    checks=PLANAR.checks("S"),
    reference=PLANAR.reference,
    chain="R + RRR + RRR",
    formulas="Two dyads RRR in series, each on its own side.",
)
