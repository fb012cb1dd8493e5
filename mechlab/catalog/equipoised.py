"""The equipoised arm: a spring of zero free length balances an arm in every position."""

from __future__ import annotations

import math

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, revolute
from mechlab.mechanism.parts import Spring


@dataclass(frozen=True)
class Parameters:
    """Arm on a pivot; the spring goes from a point straight above the pivot to a point on the arm."""

    length: float = parameter(0.5, "m", "arm, its load at the end", low=0, strict=True)
    load: float = parameter(1.0, "kg", "load", low=0, strict=True)
    above: float = parameter(0.15, "m", "upper end of the spring above the pivot", low=0, strict=True)
    along: float = parameter(0.2, "m", "lower end of the spring along the arm", low=0, strict=True)
    share: float = parameter(1.0, "", "stiffness over that of balance", low=0)


def stiffness(p: Parameters) -> float:
    """Balance for k above along = load g length: both potentials are cosines of the same angle."""
    return p.share * p.load * 9.81 * p.length / (p.above * p.along)


def build(p: Parameters) -> Mechanism:
    """Arm level in the reference pose; angle from the level, upwards."""
    w = InWorld("equipoised", 0.015, summary="equipoised arm").stand((0, 0, -0.1), (0, 0, p.above))
    w.link("arm", revolute("angle", "-y"), at=(0, 0, 0), to=[(p.length, 0, 0)], mass_per_length=1e-9,
           more=Inertia.cylinder(p.load, 0.04, 0.08).at((p.length, 0, 0)))
    w.spring(Spring("balance", "ground", "arm", (0.0, 0.0, p.above), (p.along, 0.0, 0.0), stiffness=stiffness(p)))
    return w.mark("P", "arm", (p.length, 0, 0)).drive("angle", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "equipoised", "Equipoised arm", "balance", summary="A spring of zero free length: the arm rests in every position.",
    use="Desk lamps, microscope stands, exoskeletons.", origin="George Carwardine, 1931", parameters=Parameters, build=build,
    path=lambda p: {"angle": (-1.2, 1.2)}, sliders=("above", "along"), plots=(PlotRecipe("angle", ("angle",)),),
    outside=(
        Outside("torque that holds the arm, at its largest: load g length (1 - share) cos(angle)", "N m",
                lambda p: p.load * 9.81 * p.length * (1 - p.share),
                lambda p, m: farthest(m["angle_force"], 0.0) if p.share == 1 else float(m["angle_force"][12]), 1e-7,
                "Carwardine 1931; rod of 1e-9 kg/m left out"),
        Outside("height of the load at the end", "m", lambda p: p.length * math.sin(1.2), lambda p, m: float(m["P_z"][-1]), 1e-9,
                "length sin(angle)"),
    ),
    chain="R, spring", formulas="k above along = load g length.",
    sources=("Carwardine, UK patent 404615, 1934", "French, Widden, The spring-and-lever balancing mechanism, 2000"),
)  # fmt: skip
