"""The scissor lift: n crossed pairs of bars, height n times that of one."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Each stage has two bars that cross in their middles; the lowest right end slides on the floor."""

    bar: float = parameter(0.4, "m", "bars", low=0, strict=True)
    stages: int = parameter(3, "", "stages", low=1, high=12)
    low: float = parameter(0.4, "rad", "angle of the bars to the floor, lowered", low=0, high=1.5, strict=True)
    high: float = parameter(1.0, "rad", "raised", low=0, high=1.5, strict=True)


def linkage(p: Parameters) -> Linkage:
    """The driven bar, its partner on the floor (RRP), then a dyad RRR for each further stage."""
    half = 0.5 * p.bar
    chain = (
        Linkage("scissor_lift").pivot("O", 0.0, 0.0).guide("floor", 0.0, 0.0)
        .crank("bar", "O", "right_1", p.bar).point("middle_1", "bar", half)
        .rrp("foot", "back_1", "middle_1", "floor", half, 1).point("left_1", "back_1", half, math.pi)
    )  # fmt: skip
    for k in range(2, p.stages + 1):
        chain = chain.rrr(f"middle_{k}", (f"front_{k}", f"back_{k}"), (f"left_{k - 1}", f"right_{k - 1}"), (half, half), 1)
        chain = chain.point(f"right_{k}", f"front_{k}", p.bar).point(f"left_{k}", f"back_{k}", p.bar)
    return chain


def top(p: Parameters) -> str:
    """Name of the upper end of the last front bar."""
    return f"right_{p.stages}"


ENTRY = planar_entry(
    "scissor_lift", "Scissor lift", "lift", summary="Crossed bars in n stages: a long straight lift from a short base.",
    use="Lifting tables and platforms, extending mirrors, lazy tongs.",
    origin="lazy tongs, 18th century; lift table by Larry Murphy, 1963", parameters=Parameters,
    linkage=linkage, timestep=4e-4, released=0.2,
    path=lambda p: {"bar_angle": (p.low, p.high)}, width=lambda p: 0.05 * p.bar, slides=("foot",), links=("back_1",),
    points=("right_1", "left_1"), sliders=("bar", "low"), plots=(PlotRecipe("foot", ("foot_slide",)),),
    outside=(
        Outside("height, raised", "m", lambda p: p.stages * p.bar * math.sin(p.high), lambda p, m: float(m[f"{top(p)}_z"][-1]), 1e-9,
                "n bar sin(angle)"),
        Outside("lift for a small step of the foot: -n cot(angle), raised", "", lambda p: -p.stages / math.tan(p.high),
                lambda p, m: float(m[f"{top(p)}_z_rate"][-1] / m["foot_slide_rate"][-1]), 1e-9,
                "foot bar cos(angle), top n bar sin(angle)"),
    ),
    chain="R + RRP + RRR ...", formulas="height = n bar sin(angle).", sources=("Norton, Design of Machinery",),
)  # fmt: skip
