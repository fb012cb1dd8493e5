"""The quick-return mechanism of a shaper: crank, slotted lever (dyad RPR), connecting rod and ram (dyad RRP)."""

from __future__ import annotations

from mechlab.analytic.linkage import Linkage
from mechlab.experiment.entry import Entry, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.kit.planar_build import Style
from mechlab.kit.planar_entry import Planar
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters:
    """Crank pivot O = (0, 0), lever pivot Q = (0, -distance); the ram slides along y = height."""

    crank: float = parameter(0.1, "m", "crank O-A", low=0, strict=True)
    distance: float = parameter(0.25, "m", "from O down to the pivot Q of the lever", low=0, strict=True)
    lever: float = parameter(0.5, "m", "lever Q-T", low=0, strict=True)
    rod: float = parameter(0.25, "m", "connecting rod T-D", low=0, strict=True)
    height: float = parameter(0.22, "m", "line of the ram above O")
    offset: float = parameter(0.0, "m", "slot to the left of the lever's pivot")
    mode: int = parameter(1, "", "+1: ram right of the rod's other end, -1: left", low=-1, high=1)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    slider_mass: float = parameter(0.2, "kg", "mass of the block and of the ram", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(6.0, "rad/s", "crank speed of the scenes", scene=True)


def linkage(p: Parameters) -> Linkage:
    """Driver, RPR, a point of the lever, RRP."""
    return (
        Linkage("quick_return").pivot("O", 0.0, 0.0).pivot("Q", 0.0, -p.distance)
        .crank("crank", "O", "A", p.crank)
        .rpr("lever", "Q", "A", p.offset)
        .point("T", "lever", p.lever)
        .guide("line", 0.0, p.height)
        .rrp("D", "rod", "T", "line", p.rod, p.mode or 1)
    )  # fmt: skip


PLANAR = Planar(
    name="quick_return", summary="shaper: crank, slotted lever, rod and ram", linkage=linkage,
    start=lambda p: {"crank": 0.3}, speeds=lambda p: {"crank": p.speed},
    style=lambda p: Style(p.mass_per_length, p.slider_mass, p.gravity, 0.08 * p.lever),
    points=("A", "T", "D"), links=("lever", "rod"), slides=("lever", "D"),
)  # fmt: skip

ENTRY = Entry(
    name="quick_return",
    title="Quick-return mechanism",
    family="quick-return",
    summary="Shaper with a slotted lever: slow working stroke, quick return.",
    parameters=Parameters,
    build=PLANAR.build,
    fidelities={"kinematic": "closed form", "minimal": "five parts, two pins; exact dynamics"},
    default_fidelity="minimal",
    scenes=PLANAR.scenes(),
    default_scene="driven-crank",
    sliders=("crank", "lever"),
    plots=(
        PlotRecipe("stroke of the ram", ("D_slide",)),
        PlotRecipe("speed of the ram", ("D_slide_rate",)),
        PlotRecipe("angle of the lever", ("lever_angle",)),
    ),
    questions=(PLANAR.question(),),
    checks=PLANAR.checks("Q"),
    reference=PLANAR.reference,
    chain="R + RPR + RRP",
    formulas="Lever: Q + s e(th) + h n(th) = A; ram: |D - T| = rod on its line.",
)
