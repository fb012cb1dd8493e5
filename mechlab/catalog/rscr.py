"""The spatial four-bar RSCR: a turning crank swings a rocker by a ball and a sleeve that slides along its pin."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

from mechlab.kit.in_world import InWorld, between
from mechlab.kit.palette import STEEL
from mechlab.kit.short import PlotRecipe, builder_entry, each, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, prismatic, revolute


@dataclass(frozen=True)
class Parameters:
    """Crank about z at the origin; rocker about x, its pivot at (0, -back, 0); the sleeve's pin is parallel to x."""

    crank: float = parameter(0.06, "m", "crank", low=0, strict=True)
    arm: float = parameter(0.17, "m", "arm from the ball to the pin", low=0, strict=True)
    rocker: float = parameter(0.12, "m", "rocker from its pivot to the pin", low=0, strict=True)
    back: float = parameter(0.2, "m", "pivot of the rocker behind the crank", low=0, strict=True)


def rocker_angle(p: Parameters, t: float) -> float:
    """Seen along x the ball stands at y = crank sin t, u from the pivot: arm^2 = rocker^2 + u^2 - 2 rocker u cos f, the pin above."""
    u = p.back + p.crank * math.sin(t)
    return math.acos((p.rocker**2 + u * u - p.arm**2) / (2.0 * p.rocker * u))


def closed(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """The rocker, and the sleeve, which follows the ball along x."""
    return {"rocker_angle": rocker_angle(p, given["crank_angle"]), "sleeve": p.crank * math.cos(given["crank_angle"])}


def build(p: Parameters) -> Mechanism:
    """The pose with the crank at 0."""
    f = rocker_angle(p, 0.0)
    y, z = p.rocker * math.cos(f) - p.back, p.rocker * math.sin(f)
    ball, pin, pivot, w = (p.crank, 0, 0), (p.crank, y, z), (0, -p.back, 0), InWorld("rscr", 0.01, summary="spatial four-bar RSCR")
    w.link("crank", revolute("crank_angle", "z"), at=(0, 0, 0), to=[ball])
    bar = between((-1.4 * p.crank, y + p.back, z), (1.4 * p.crank, y + p.back, z), 0.004, STEEL, "pin")
    w.link("rocker", revolute("rocker_angle", "x", zero=f), at=pivot, to=[(0, y, z)], shapes=[bar])
    w.link("arm", prismatic("sleeve", "x", zero=p.crank), revolute("arm_turn", "x"), at=pin, to=[ball], parent="rocker")
    w.close("ball", "arm", "crank", ball).mark("B", "crank", ball).drive("crank_angle", stiffness=20.0, damping=0.2)
    return w.build()


ENTRY = builder_entry(
    "rscr", "Spatial four-bar RSCR", "spatial-loop", summary="Crossed crank and rocker joined by a ball and a sliding sleeve, one freedom.",
    use="Agitators and feeds: a turn becomes a swing about a crossed axis, without a rod that spins.",
    origin="classified by Denavit and Hartenberg, 1955", parameters=Parameters, build=build, closed=each(closed), sliders=("crank", "arm"),
    path=lambda p: {"crank_angle": (0.0, 2 * math.pi)}, plots=(PlotRecipe("rocker", ("rocker_angle",)), PlotRecipe("sleeve", ("sleeve",))),
    outside=(
        value_at("rocker_angle", partial(rocker_angle, t=0.5 * math.pi), "law of cosines seen along the rocker's axis", 6, unit="rad"),
        value_at("sleeve", lambda p: -p.crank, "it follows the ball along the pin", 12),
    ),
    chain="R S C R", formulas="arm^2 = rocker^2 + u^2 - 2 rocker u cos f.", sources=("Hunt, Kinematic Geometry of Mechanisms, 1978",),
)  # fmt: skip
