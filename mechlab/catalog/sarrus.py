"""The Sarrus linkage: two hinged pairs of plates at right angles lift a platform exactly straight."""

from __future__ import annotations

import math

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Two chains of two plates; all hinges of one chain are parallel to x, those of the other to y."""

    plate: float = parameter(0.12, "m", "plates, equal", low=0, strict=True)
    top: float = parameter(0.15, "m", "side of base and platform", low=0, strict=True)
    low: float = parameter(0.5, "rad", "angle of the lower plates to the base, lowered", low=0, high=1.5, strict=True)
    high: float = parameter(1.3, "rad", "raised", low=0, high=1.5, strict=True)


def build(p: Parameters) -> Mechanism:
    """Reference pose lowered; plates lean outwards, the platform on the first chain, the second closes to it."""
    r, out, up = 0.5 * p.top, p.plate * math.cos(p.low), p.plate * math.sin(p.low)
    w = InWorld("sarrus", 0.08 * p.plate, summary="Sarrus linkage")
    w.stand((r, 0, 0), (0, r, 0))
    w.link("lower_1", revolute("lift", "-y", zero=p.low), at=(r, 0, 0), to=[(r + out, 0, up)])
    w.link("upper_1", revolute("knee_1", "-y"), at=(r + out, 0, up), to=[(r, 0, 2 * up)], parent="lower_1")
    w.link("platform", revolute("top_1", "-y"), at=(r, 0, 2 * up), to=[(0, r, 2 * up), (-r, 0, 2 * up), (0, -r, 2 * up)],
           parent="upper_1")
    w.link("lower_2", revolute("base_2", "x"), at=(0, r, 0), to=[(0, r + out, up)])
    w.link("upper_2", revolute("knee_2", "x"), at=(0, r + out, up), to=[(0, r, 2 * up)], parent="lower_2")
    w.close("top_2", "platform", "upper_2", (0, r, 2 * up), "revolute", (1, 0, 0))
    w.mark("P", "platform", (0, 0, 2 * up)).drive("lift", stiffness=50.0, damping=0.5)
    return w.build()


ENTRY = builder_entry(
    "sarrus", "Sarrus linkage", "straight-line",
    summary="Two chains of hinges at right angles: the platform goes exactly straight, without a slide.",
    use="Lifting tables, suspensions, pop-up structures; the first exact straight line.", origin="Pierre-Frederic Sarrus, 1853",
    parameters=Parameters, build=build, released=0.25, path=lambda p: {"lift": (p.low, p.high)}, sliders=("plate",),
    plots=(PlotRecipe("platform", ("P_z",)),),
    outside=(
        Outside("height, raised", "m", lambda p: 2 * p.plate * math.sin(p.high), lambda p, m: float(m["P_z"][-1]), 1e-9,
                "2 plate sin(angle)"),
        Outside("side motion along the path", "m", lambda p: 0.0, lambda p, m: farthest(abs(m["P_x"]) + abs(m["P_y"]), 0.0), 1e-9,
                "Sarrus 1853: a straight line"),
        Outside("lift speed over turn speed, raised", "m", lambda p: 2 * p.plate * math.cos(p.high),
                lambda p, m: float(m["P_z_rate"][-1] / m["lift_rate"][-1]), 1e-9, "2 plate cos(angle)"),
    ),
    chain="6 R, overconstrained", formulas="height = 2 plate sin(angle).",
    sources=("Sarrus, Note sur la transformation des mouvements, C. R. Acad. Sci. 36, 1853",),
)  # fmt: skip
