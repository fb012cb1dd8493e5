"""The palletizer: two drives near the base, and two parallelograms that keep the tool level."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, farthest, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Upper arm O-A, forearm A-W moved by the crank O-C through the rod C-B; levelling rods G-H and K-N."""

    upper: float = parameter(0.5, "m", "upper arm O-A", low=0, strict=True)
    fore: float = parameter(0.45, "m", "forearm A-W", low=0, strict=True)
    crank: float = parameter(0.15, "m", "crank O-C and tail A-B of the forearm", low=0, strict=True)
    level: float = parameter(0.1, "m", "levers of the levelling rods", low=0, strict=True)


def linkage(p: Parameters) -> Linkage:
    """Arm and crank drive the forearm by a parallelogram; two more in series hold the tool plate parallel to the ground."""
    return (
        Linkage("palletizer").pivot("O", 0.0, 0.0).pivot("G", -p.level, 0.0)
        .crank("arm", "O", "A", p.upper).crank("crank", "O", "C", p.crank)
        .rrr("B", ("rod", "forearm"), ("C", "A"), (p.upper, p.crank), 1).point("W", "forearm", p.fore, math.pi)
        .rrr("H", ("level_rod", "triangle"), ("G", "A"), (p.upper, p.level), 1).point("K", "triangle", p.level, -0.5 * math.pi)
        .rrr("N", ("tool_rod", "tool"), ("K", "W"), (p.fore, p.level), 1).point("tip", "tool", 0.5 * p.level, math.pi)
    )  # fmt: skip


ENTRY = planar_entry(
    "palletizer", "Palletizing arm", "lift",
    summary="Two cranks at the base, parallelograms to the wrist: the tool stays level without a drive.",
    use="Robots that stack boxes; excavators and desk lamps share the idea.", origin="Fujiyusoki Kogyo palletizing robots, 1980s",
    parameters=Parameters, linkage=linkage, released=0.25, path=lambda p: {"arm_angle": (1.3, 0.9), "crank_angle": (2.9, 2.5)},
    width=lambda p: 0.25 * p.level, links=("forearm", "tool"), points=("W",), sliders=("upper", "fore"),
    plots=(PlotRecipe("wrist", ("W_x", "W_z")),),
    outside=(
        Outside("tilt of the tool along the path", "rad", lambda p: 0.0,
                lambda p, m: farthest(m["tool_angle"] - m["tool_angle"][0], 0.0), 1e-9, "parallelograms"),
        # A-B is parallel to O-C, W lies opposite: W = upper e^(i arm) - fore e^(i crank)
        Outside("x of the wrist at the end", "m", lambda p: p.upper * math.cos(0.9) - p.fore * math.cos(2.5),
                lambda p, m: float(m["W_x"][-1]), 1e-9, "parallelogram O-A-B-C"),
        Outside("height of the wrist at the end", "m", lambda p: p.upper * math.sin(0.9) - p.fore * math.sin(2.5),
                lambda p, m: float(m["W_z"][-1]), 1e-9, "parallelogram O-A-B-C"),
    ),
    chain="R, R + 3 RRR", formulas="W = upper (cos, sin)(arm) - fore (cos, sin)(crank).",
    sources=("Artobolevsky, Mechanisms in Modern Engineering Design I",),
)  # fmt: skip
