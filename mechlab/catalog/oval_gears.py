"""Oval gears: two equal ellipses that roll on each other about their foci, a uniform turn in, an uneven one out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.kit.palette import BLUE, BRASS
from mechlab.kit.profiles import in_a_second, oval_curve, oval_law
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute, shape


@dataclass(frozen=True)
class Parameters:
    """The axes stand as far apart as the ellipses are long."""

    major: float = parameter(0.05, "m", "half of the long axis", low=0, strict=True)
    eccentricity: float = parameter(0.5, "", "distance of the foci over the long axis", low=0, high=0.6)


def build(p: Parameters) -> Mechanism:
    """Both wheels about a focus; at 0 the far end of the first touches the near end of the second."""
    size: dict[str, Any] = {"major": p.major, "eccentricity": p.eccentricity, "thickness": 0.2 * p.major, "bore": 0.1 * p.major}
    b = Builder("oval_gears", gravity=(0, 0, 0), summary="two elliptic gears about their foci")
    for name, x, color in (("input", 0.0, BRASS), ("output", 2.0 * p.major, BLUE)):
        b.body(name, revolute(name, "z"), at=(x, 0, 0), inertia=Inertia.cylinder(0.5, p.major, 0.2 * p.major),
               shapes=[shape("oval", color=color, name=name, **size)])
    return b.curve("mesh", "output", "input", oval_curve(p.eccentricity)).drive("input", stiffness=20.0, damping=0.2).build()


def radii(p: Parameters, m: Mapping[str, Any]) -> Any:
    """Radii of both ellipses on the line of the axes, A (1 - e^2) / (1 -+ e cos), over the distance 2 A."""
    e = p.eccentricity
    return 0.5 * (1 - e * e) * (1 / (1 - e * np.cos(m["input"])) + 1 / (1 + e * np.cos(m["output"])))


ENTRY = builder_entry(
    "oval_gears", "Oval gears", "gear-train",
    summary="Two equal ellipses roll about their foci: even input, output once fast and once slow a turn.",
    use="Flow meters, presses with a slow stroke and a quick return.", origin="Leonardo da Vinci, about 1500; Holditch, 1838",
    parameters=Parameters, build=build, path=lambda p: {"input": (-math.pi, math.pi)},
    closed=lambda p, given: in_a_second("output", oval_law(p.eccentricity, given["input"])), sliders=("eccentricity",),
    plots=(PlotRecipe("ratio", ("output_rate",)),),
    outside=(
        # at the far end of the input the radii are A (1 + e) and A (1 - e)
        Outside("largest ratio of output to input", "", lambda p: (1 + p.eccentricity) / (1 - p.eccentricity),
                lambda p, m: float(np.max(np.abs(m["output_rate"]))) / (2 * math.pi), 1e-9, "(1 + e) / (1 - e): far end on near end"),
        Outside("sum of the radii at the point of contact, over the distance of the axes, at its farthest from 1", "", lambda p: 1.0,
                lambda p, m: farthest(radii(p, m), 1.0), 1e-9, "polar form of the ellipse about its focus"),
    ),
    chain="R + R, a curve", formulas="tan(b / 2) = (1 + e) / (1 - e) tan(a / 2).",
    sources=("Litvin and Fuentes, Gear Geometry and Applied Theory, 2004: elliptical gears",),
)  # fmt: skip
