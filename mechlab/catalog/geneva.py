"""The external Geneva drive: a pin turns a slotted wheel by one slot a turn and locks it for the rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechlab.analytic.geneva import engaged_from, fastest, wheel_law
from mechlab.kit.palette import BLUE, BRASS
from mechlab.kit.profiles import geneva_curve
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute, shape


@dataclass(frozen=True)
class Parameters:
    """The pin enters and leaves its slot at right angles: crank = center sin(pi / slots)."""

    slots: int = parameter(6, "", "slots of the wheel", low=3, high=16)
    center: float = parameter(0.1, "m", "distance of the two axes", low=0, strict=True)
    pin: float = parameter(0.004, "m", "radius of the pin; of the picture only", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Crank at the origin, pin towards the wheel; pin, slot and locking disc are one curve."""
    size = {"slots": p.slots, "center": p.center, "pin": p.pin, "thickness": 2.5 * p.pin, "bore": 1.5 * p.pin}
    r, turned = p.center * math.cos(math.pi / p.slots), Placement.of(np.diag([-1.0, -1.0, 1.0]), (0.0, 0.0, 0.0))
    b = Builder("geneva", gravity=(0, 0, 0), summary="external Geneva drive")
    b.body("crank", revolute("crank", "z"), inertia=Inertia.cylinder(0.5, 0.4 * p.center, 0.01),
           shapes=[shape("geneva_driver", color=BRASS, name="driver", **size)])
    b.body("wheel", revolute("wheel", "z"), at=(p.center, 0, 0), inertia=Inertia.cylinder(0.4, r, 0.01),
           shapes=[shape("geneva_wheel", turned, BLUE, "wheel", **size)])
    return b.curve("slot", "wheel", "crank", geneva_curve(p.slots)).drive("crank", stiffness=20.0, damping=0.2).build()


def closed(p: Parameters, given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The law of the wheel, path time 1 s a turn."""
    w = 2.0 * math.pi
    b, v, a = wheel_law(p.slots, given["crank"])
    return {"wheel": b, "wheel_rate": w * v, "wheel_accel": w**2 * a}


ENTRY = builder_entry(
    "geneva", "Geneva drive", "dwell", summary="A pin turns a slotted wheel by one slot a turn and locks it for the rest.",
    use="Film projectors, indexing tables, counters.", origin="Swiss watchmakers' stopwork, 17th century", parameters=Parameters,
    build=build, path=lambda p: {"crank": (0.0, 2.0 * math.pi)}, closed=closed, duration=3.0, sliders=("slots",),
    through=lambda p: (fastest(p.slots)[0] / (2 * math.pi), engaged_from(p.slots) / (2 * math.pi), 1 - engaged_from(p.slots) / (2 * math.pi)),
    plots=(PlotRecipe("wheel", ("wheel",)), PlotRecipe("rate of the wheel", ("wheel_rate",))),
    outside=(
        Outside("half of the share of a turn in which the wheel moves", "", lambda p: (p.slots - 2) / (4 * p.slots),
                lambda p, m: float(np.min(m["crank"][np.abs(m["wheel_rate"]) < 1e-9]) / (2 * math.pi)), 1e-9,
                "the pin enters at right angles, so that the crank turns by pi - 2 pi / n"),
        Outside("largest rate of the wheel over that of the crank", "", lambda p: 1 / (1 / math.sin(math.pi / p.slots) - 1),
                lambda p, m: float(np.max(np.abs(m["wheel_rate"])) / (2 * math.pi)), 1e-9, "r / (c - r) on the line of centres, r = c sin(pi / n)"),
        # the derivative of l (1 - l^2) sin a / (1 - 2 l cos a + l^2)^2 vanishes: cos a = sqrt(g^2 + 2) - g, g = (1 + l^2) / 4 l
        Outside("largest acceleration of the wheel over the squared rate of the crank", "", lambda p: fastest(p.slots)[1],
                lambda p, m: float(np.max(np.abs(m["wheel_accel"])) / (2 * math.pi) ** 2), 1e-5, "Bickford 1972; 1.350 for 6 slots"),
    ),
    chain="R + R, a curve", formulas="tan b = l sin a / (1 - l cos a), l = sin(pi / n).",
    sources=("Bickford, Mechanisms for Intermittent Motion, 1972, chapter 9",),
)  # fmt: skip
