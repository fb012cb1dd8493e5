"""The spatial four-bar RSSR: crank and rocker with crossed axes, a rod with two ball joints."""

from __future__ import annotations

import math
from functools import partial

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute, spherical


@dataclass(frozen=True)
class Parameters:
    """Crank about z at the origin; rocker about x, its pivot at (base, -back, 0); the rod joins their ends."""

    crank: float = parameter(0.05, "m", "crank", low=0, strict=True)
    rod: float = parameter(0.25, "m", "rod between the balls", low=0, strict=True)
    rocker: float = parameter(0.15, "m", "rocker", low=0, strict=True)
    base: float = parameter(0.05, "m", "rocker plane from the crank axis, x")
    back: float = parameter(0.2, "m", "rocker pivot behind the crank axis, y")


def rocker_angle(p: Parameters, t: float) -> float:
    """Rocker end at (base, -back + rocker cos f, rocker sin f), at the distance rod from (crank cos t, crank sin t, 0):
    rocker^2 + (base - x)^2 + (back + y)^2 - 2 rocker (back + y) cos f = rod^2; the branch above."""
    x, y = p.crank * math.cos(t), p.crank * math.sin(t)
    u = p.back + y
    return math.acos((p.rocker**2 + (p.base - x) ** 2 + u * u - p.rod**2) / (2.0 * p.rocker * u))


def build(p: Parameters) -> Mechanism:
    """The pose with the crank at 0; the rod hangs on the crank."""
    f = rocker_angle(p, 0.0)
    ball, end, pivot = (p.crank, 0.0, 0.0), (p.base, -p.back + p.rocker * math.cos(f), p.rocker * math.sin(f)), (p.base, -p.back, 0.0)
    w = InWorld("rssr", 0.01, summary="spatial four-bar RSSR")
    w.link("crank", revolute("crank_angle", "z"), at=(0, 0, 0), to=[ball])
    w.link("rod", spherical("rod_ball"), at=ball, to=[end], parent="crank")
    w.link("rocker", revolute("rocker_angle", "x", zero=f), at=pivot, to=[end])
    w.close("ball", "rod", "rocker", end).mark("E", "rocker", end)
    w.drive("crank_angle", stiffness=20.0, damping=0.2)
    return w.build()


ENTRY = builder_entry(
    "rssr", "Spatial four-bar RSSR", "spatial-loop", summary="Crossed crank and rocker, a rod with two balls that also spins on its own.",
    use="Steering, linkages of cars and aircraft.", origin="analysed by Dimentberg, 1948", parameters=Parameters, build=build,
    path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, sliders=("rod", "rocker"), plots=(PlotRecipe("rocker", ("rocker_angle",)),),
    outside=tuple(
        value_at("rocker_angle", partial(rocker_angle, t=0.5 * math.pi * k), "distance of the two balls", 6 * k, unit="rad") for k in (1,
                3)
    ),
    chain="R S S R", formulas="|rocker end - crank end| = rod.", sources=("Hunt, Kinematic Geometry of Mechanisms, 1978",),
)  # fmt: skip
