"""The Schatz linkage: the six-bar loop that swings the drum of the Turbula mixer."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, always, builder_entry, parameter, speeds
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Three equal bars between two forks on parallel shafts; all other neighbouring hinges meet or cross at right angles."""

    bar: float = parameter(0.15, "m", "the bars; the shafts stand sqrt(3) bars apart", low=0, strict=True)


def closed(p: Parameters, given: Motion) -> Motion:
    """Unit vectors x, y, z of the bars have the sum sqrt(3) e, e from shaft to shaft; neighbours are at right angles to the hinge between.
    Squared: (1 + cos 3)(1 + cos 4) = 1. Times the pin of fork 1, at right angles to x and hinge 3: sin 3 (1 + cos 4) = -sqrt(3) sin 1, so
    tan(3 / 2) = -sqrt(3) sin 1, and from the other shaft tan(4 / 2) = -sqrt(3) sin 6; both in the square: tan 1 tan 6 = -1 / 2."""
    t = given["theta_1"]
    last = np.arctan2(-np.cos(t), 2.0 * np.sin(t))
    return {"theta_3": -2 * np.arctan(math.sqrt(3) * np.sin(t)), "theta_4": -2 * np.arctan(math.sqrt(3) * np.sin(last)), "theta_6": last}


def build(p: Parameters) -> Mechanism:
    """The pose theta_1 = 0.5; the sum times x gives 1 - cos 4 = -sqrt(3) cos 1 cos 2, times z 1 - cos 3 = -sqrt(3) cos 6 cos 5."""
    right, root, a = 0.5 * math.pi, math.sqrt(3), p.bar
    t3, t4, t6 = (float(x) for x in closed(p, {"theta_1": np.array(0.5)}).values())
    t2, t5 = -math.acos((math.cos(t4) - 1) / (root * math.cos(0.5))), math.acos((math.cos(t3) - 1) / (root * math.cos(t6)))
    steps = [(a * k, right, 0.0, t) for k, t in zip((0, 1, 1, 1, 0), (0.5, t2, t3, t4, t5), strict=True)]
    return InWorld("schatz", 0.06 * a, summary="Schatz linkage").ring([*steps, (root * a, 0.0, 0.0, t6)], 2).build()


ENTRY = builder_entry(
    "schatz", "Schatz linkage (Turbula)", "spatial-loop",
    summary="Six bars between two forks on parallel shafts: the middle bar swings, turns and tumbles in three directions.",
    use="The Turbula mixer for powders and liquids: the drum is the middle bar.", origin="Paul Schatz, 1929; built since 1933",
    parameters=Parameters, build=build, path=lambda p: {"theta_1": (0.5, 0.5 + 2 * math.pi)}, closed=closed, sliders=("bar",),
    plots=(PlotRecipe("shafts", ("theta_1_rate", "theta_6_rate")), PlotRecipe("drum", ("theta_3", "theta_4"))),
    outside=(
        always("(1 + cos theta_3)(1 + cos theta_4)", "", lambda p, m: (1 + np.cos(m["theta_3"])) * (1 + np.cos(m["theta_4"])),
               lambda p: 1.0, "equal bars, as derived"),
        # tan 1 tan 6 = -1 / 2 as of a cardan joint of 60 degrees: d6 / d1 = 2 / (4 sin^2 + cos^2)
        speeds("theta_6", "theta_1", lambda p: 2.0 / (4.0 * math.sin(0.5) ** 2 + math.cos(0.5) ** 2), "as a cardan joint of 60 degrees"),
    ),
    chain="6 R", formulas="tan 1 tan 6 = -1/2.", sources=("Schatz, Rhythmusforschung und Technik, 1975", "Swiss patent 500000, 1971"),
)  # fmt: skip
