"""Humpage's bevel reduction: bevel wheels on one moving arm, high ratio in little room."""

from __future__ import annotations

import math

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter, ratio
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.shapes import pitch_angles


@dataclass(frozen=True)
class Parameters:
    """Input a, fixed wheel f, compound planet b-c across, output d; all about the axis z."""

    a: int = parameter(20, "", "input wheel", low=12)
    b: int = parameter(56, "", "planet, meshes with input and fixed wheel", low=12)
    c: int = parameter(24, "", "planet, meshes with the output", low=12)
    d: int = parameter(35, "", "output wheel", low=12)
    f: int = parameter(76, "", "fixed wheel", low=12)


def build(p: Parameters) -> Mechanism:
    """The arm turns freely; the planet lies across the axis, its second crown on the same body."""
    t = Train("humpage", 0.002, "Humpage's bevel gear").carrier("arm", [0.06])
    into, b_a = pitch_angles(p.a, p.b)
    t.bevel("input", p.a, (0, 0, 1), into).bevel("planet", p.b, (1, 0, 0), b_a, "arm")
    t.bevel("fixed", p.f, (0, 0, -1), pitch_angles(p.f, p.b)[0]).bevel("output", p.d, (0, 0, -1), pitch_angles(p.d, p.c)[0])
    t.mesh_of("input", "planet", "arm", bevel=True).mesh_of("fixed", "planet", "arm", bevel=True)
    t.gears("output_planet", "output", "planet", (p.d, p.c), "arm", "bevel")
    return t.relation("held", fixed=1).drive("input", stiffness=20.0, damping=0.2).build()


def willis(p: Parameters) -> float:
    """Input over output: (1 + f / a) / (1 - f c / (b d)), from the planet relative to the arm."""
    return (1 + p.f / p.a) / (1 - p.f * p.c / (p.b * p.d))


ENTRY = builder_entry(
    "humpage", "Humpage's bevel gear", "gear-train", summary="Bevel wheels on a moving arm: input and output in line, high reduction.",
    use="Machine tool drives, wheel hubs.", origin="Thomas Humpage, about 1890", parameters=Parameters, build=build,
    path=lambda p: {"input": (0.0, 2 * math.pi)}, plots=(PlotRecipe("output", ("output_rate",)),),
    outside=(
        # output and fixed wheel count their angles about -z, the input about +z
        Outside("ratio of input to output", "", willis, lambda p, m: -ratio(m, "input", "output"), 1e-9,
                "Willis 1841, signs from the sides of the planet"),
        Outside("ratio of input to arm", "", lambda p: 1 + p.f / p.a, lambda p, m: ratio(m, "input", "arm"), 1e-9, "Willis 1841"),
    ),
    chain="arm, 5 bevel crowns", formulas="(w_in - w_arm) / (w_fixed - w_arm) = -f / a.",
    sources=("Merritt, Gear Trains, 1947", "teeth 20, 56, 24, 35, 76: Shigley, Theory of Machines"),
)  # fmt: skip
