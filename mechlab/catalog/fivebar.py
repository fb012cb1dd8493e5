"""The five-bar: two driven cranks and a dyad RRR between their pins, a planar robot of two freedoms."""

from __future__ import annotations

from mechlab.analytic.linkage import Linkage
from mechlab.experiment.entry import Entry, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.kit.planar_build import Style
from mechlab.kit.planar_entry import Planar
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters:
    """Pivots (0, 0) and (base, 0); the rods meet in P."""

    base: float = parameter(0.2, "m", "distance of the pivots", low=0, strict=True)
    crank_left: float = parameter(0.1, "m", "left crank", low=0, strict=True)
    crank_right: float = parameter(0.1, "m", "right crank", low=0, strict=True)
    rod_left: float = parameter(0.3, "m", "left rod", low=0, strict=True)
    rod_right: float = parameter(0.3, "m", "right rod", low=0, strict=True)
    mode: int = parameter(1, "", "+1: P left of the way from the left pin to the right one, -1: right", low=-1, high=1)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(6.0, "rad/s", "speed of both cranks in the scenes", scene=True)


def linkage(p: Parameters) -> Linkage:
    """Two drivers and a dyad RRR."""
    return (
        Linkage("fivebar").pivot("O", 0.0, 0.0).pivot("Q", p.base, 0.0)
        .crank("left", "O", "A", p.crank_left)
        .crank("right", "Q", "B", p.crank_right)
        .rrr("P", ("rod_left", "rod_right"), ("A", "B"), (p.rod_left, p.rod_right), p.mode or 1)
    )  # fmt: skip


PLANAR = Planar(
    name="fivebar", summary="planar five-bar, two drives", linkage=linkage, cranks=("left", "right"),
    start=lambda p: {"left": 2.2, "right": 1.1}, speeds=lambda p: {"left": p.speed, "right": p.speed},
    style=lambda p: Style(p.mass_per_length, gravity=p.gravity, width=0.08 * p.rod_left),
    points=("P",), links=("rod_left", "rod_right"), released=0.25,
)  # fmt: skip

ENTRY = Entry(
    name="fivebar",
    title="Five-bar",
    family="parallel-robot",
    summary="Planar five-bar with two driven cranks; both assembly modes.",
    parameters=Parameters,
    build=PLANAR.build,
    fidelities={"kinematic": "closed form", "minimal": "four bars, one pin; exact dynamics"},
    default_fidelity="minimal",
    scenes=PLANAR.scenes(),
    default_scene="driven-crank",
    sliders=("base", "rod_left"),
    plots=(
        PlotRecipe("point P", ("P_x", "P_z")),
        PlotRecipe("cranks", ("left_angle", "right_angle")),
    ),
    questions=(PLANAR.question(),),
    checks=PLANAR.checks("V"),
    reference=PLANAR.reference,
    chain="R, R + RRR",
    formulas="Dyad RRR between two driven pins.",
)
