"""A one-stage cycloidal reducer, its lobes and pins as relations: an eccentric rolls a disc in a ring of pins."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from mechlab.kit.palette import BRASS, SLATE
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter, ratio
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, Placement, revolute, shape
from mechlab.mechanism.parts import Shape


@dataclass(frozen=True)
class Parameters:
    """One lobe less than pins; the output pins follow the disc's turn."""

    lobes: int = parameter(11, "", "lobes of the disc; the ring has one pin more", low=5, high=80)
    eccentricity: float = parameter(0.003, "m", "eccentric", low=0, strict=True)
    ring: float = parameter(0.06, "m", "radius of the circle of pins", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Input eccentric, disc on it, output with the absolute turn of the disc. The disc rolls: its turn is -1 / lobes of the input."""
    e, r = p.eccentricity, p.ring
    t = Train("cycloidal", 0.002, "cycloidal reducer").carrier("input", [e])
    solid = Inertia.cylinder(0.5, r, 0.01)
    t.body("disc", revolute("disc", "z"), parent="input", at=(e, 0, 0), inertia=solid,
           shapes=[shape("disc", color=BRASS, name="disc", radius=r - 2.5 * e, thickness=0.01)])
    t.body("output", revolute("output", "z"), inertia=solid,
           shapes=[shape("disc", Placement((0, 0, 0.015)), name="flange", radius=0.5 * r, thickness=0.006)])
    pins: list[Shape] = []
    for k in range(p.lobes + 1):
        a = 2 * math.pi * k / (p.lobes + 1)
        pins.append(shape("cylinder", Placement((r * math.cos(a), r * math.sin(a), 0)), SLATE, f"pin_{k}", radius=1.5 * e, length=0.014))
    # disc relative to the input: -(lobes + 1) / lobes; output = input + disc
    t.ground(*pins).relation("lobes", disc=1, input=Fraction(p.lobes + 1, p.lobes)).relation("output_pins", output=1, input=-1, disc=-1)
    return t.frame("C", "disc", (0, 0, 0)).drive("input", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "cycloidal", "Cycloidal reducer", "gear-train",
    summary="An eccentric, a lobed disc and pins: a large reduction in one flat stage, lobes as relations.",
    use="Robot joints and conveyors.", origin="Lorenz Braren, 1931", parameters=Parameters, build=build,
    path=lambda p: {"input": (0.0, 2 * math.pi)}, plots=(PlotRecipe("output", ("output_rate",)),),
    outside=(
        Outside("ratio of input to output", "", lambda p: -float(p.lobes), lambda p, m: ratio(m, "input", "output"), 1e-9,
                "Braren 1931: -lobes / (pins - lobes)"),
        Outside("distance of the disc's centre from the axis", "m", lambda p: p.eccentricity,
                lambda p, m: farthest(np.hypot(m["C_x"], m["C_y"]), p.eccentricity), 1e-12, "eccentric"),
    ),
    chain="eccentric, 2 relations", formulas="output = -input / lobes.", sources=("Braren, German patent 459025, 1928",),
)  # fmt: skip
