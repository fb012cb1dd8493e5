"""The external Geneva drive: a pin turns a slotted wheel by one slot a turn and locks it for the rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mechlab.analytic.geneva import engaged_from, fastest, wheel_law
from mechlab.kit.palette import BLUE, BRASS
from mechlab.kit.profiles import geneva_curve, in_a_second
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape

TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Parameters:
    """The pin enters and leaves its slot at right angles: `crank = center sin(pi / slots)`."""

    slots: int = parameter(6, "", "slots of the wheel", low=3, high=16)
    center: float = parameter(0.1, "m", "distance of the two axes", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Crank at the origin, pin towards the wheel; pin, slot and locking disc are one curve."""
    c = p.center
    size: dict[str, Any] = {"slots": p.slots, "center": c, "pin": 0.04 * c, "thickness": 0.1 * c, "bore": 0.04 * c}
    wheel = shape("geneva_wheel", Placement.of(np.diag([-1.0, -1.0, 1.0]), (0.0, 0.0, 0.0)), BLUE, "wheel", **size)
    b = Builder("geneva", gravity=(0, 0, 0), summary="external Geneva drive")
    b.body("crank", revolute("crank", "z"), inertia=Inertia.cylinder(0.5, 0.4 * p.center, 0.01),
           shapes=[shape("geneva_driver", color=BRASS, name="driver", **size)])
    b.body("wheel", revolute("wheel", "z"), at=(p.center, 0, 0), inertia=Inertia.cylinder(0.4, 0.9 * p.center, 0.01), shapes=[wheel])
    return b.curve("slot", "wheel", "crank", geneva_curve(p.slots)).drive("crank", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "geneva", "Geneva drive", "dwell", summary="A pin turns a slotted wheel by one slot a turn and locks it for the rest.",
    use="Film projectors, indexing tables, counters.", origin="Swiss watchmakers, to keep springs from being overwound",
    parameters=Parameters, build=build, path=lambda p: {"crank": (0.0, TURN)}, duration=3.0, sliders=("slots",),
    closed=lambda p, given: in_a_second("wheel", wheel_law(p.slots, given["crank"])),
    through=lambda p: (fastest(p.slots)[0] / TURN, engaged_from(p.slots) / TURN),
    plots=(PlotRecipe("wheel", ("wheel",)), PlotRecipe("rate of the wheel", ("wheel_rate",))),
    outside=(
        Outside("share of a turn in which the wheel moves", "", lambda p: (p.slots - 2) / (2 * p.slots),
                lambda p, m: float(2 * np.min(m["crank"][np.abs(m["wheel_rate"]) < 1e-9]) / TURN), 1e-9,
                "the pin enters at right angles: the crank turns by pi - 2 pi / n"),
        Outside("largest rate of the wheel over that of the crank", "", lambda p: 1 / (1 / math.sin(math.pi / p.slots) - 1),
                lambda p, m: float(np.max(np.abs(m["wheel_rate"])) / TURN), 1e-9, "r / (c - r) on the line of centres, r = c sin(pi / n)"),
        # the derivative of l (1 - l^2) sin a / (1 - 2 l cos a + l^2)^2 vanishes: cos a = sqrt(g^2 + 2) - g, g = (1 + l^2) / 4 l
        Outside("largest acceleration of the wheel over the squared rate of the crank", "", lambda p: fastest(p.slots)[1],
                lambda p, m: float(np.max(np.abs(m["wheel_accel"])) / TURN**2), 1e-5, "b'' where b''' = 0: 5.407 for 4 slots, 1.350 for 6"),
    ),
    chain="R + R, a curve", formulas="tan b = l sin a / (1 - l cos a), l = sin(pi / n).",
    sources=("Bickford, Mechanisms for Intermittent Motion, 1972",),
)  # fmt: skip
