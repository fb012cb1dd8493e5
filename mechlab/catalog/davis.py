"""Davis' steering: slides in the steering arms fulfil Ackermann's condition exactly."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute


@dataclass(frozen=True)
class Parameters:
    """Seen from above, front +y: arms point back and inwards by a with tan a = track / (2 base); the rod slides along x."""

    track: float = parameter(1.3, "m", "distance of the kingpins", low=0, strict=True)
    base: float = parameter(2.6, "m", "wheel base", low=0, strict=True)
    back: float = parameter(0.2, "m", "rod behind the kingpins", low=0, strict=True)
    stroke: float = parameter(0.12, "m", "travel of the rod", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Rod with two pins; on each arm a block slides, and its pin is held by the rod."""
    w, inner = InWorld("davis", 0.02, (0, 0, 0), "Davis steering gear"), p.back * p.track / (2 * p.base)
    pins = {"left": np.array([-0.5 * p.track + inner, -p.back, 0]), "right": np.array([0.5 * p.track - inner, -p.back, 0])}
    w.link("rod", prismatic("rod", "x"), at=(0, -p.back, 0), to=list(pins.values()))
    for side, x in (("left", -0.5 * p.track), ("right", 0.5 * p.track)):
        pivot, pin = np.array([x, 0, 0]), pins[side]
        way = (pin - pivot) / np.linalg.norm(pin - pivot)
        w.link(f"arm_{side}", revolute(side, "z"), at=pivot, to=[pivot + 1.6 * p.back * way, pivot + [0, 0.15, 0]])
        w.link(f"block_{side}", prismatic(f"slide_{side}", way.tolist()), at=pin, parent=f"arm_{side}",
               more=Inertia.box(0.3, 0.04, 0.04, 0.04))
        w.close(f"pin_{side}", f"block_{side}", "rod", pin)
    return w.drive("rod", stiffness=2e4, damping=200.0).build()


ENTRY = builder_entry(
    "davis", "Davis steering", "steering", summary="Slotted arms on a sliding rod: all wheels turn about one point at every lock.",
    use="Shows that Ackermann's condition can be met exactly; wears too fast for cars.",
    origin="known as Davis' steering gear since about 1900", parameters=Parameters, build=build, path=lambda p: {"rod": (0.0, p.stroke)},
    sliders=("back", "base"), plots=(PlotRecipe("wheels", ("left", "right")),),
    outside=(
        Outside("cot(outer) - cot(inner), at its farthest, all along the path", "", lambda p: p.track / p.base,
                lambda p, m: farthest(abs(1 / np.tan(m["left"][1:]) - 1 / np.tan(m["right"][1:])), p.track / p.base), 1e-8,
                "Ackermann's condition, exact for tan a = track / (2 base)"),
        Outside("left wheel at the end", "rad",
                lambda p: math.atan((p.stroke + p.back * p.track / (2 * p.base)) / p.back) - math.atan(p.track / (2 * p.base)),
                lambda p, m: float(m["left"][-1]), 1e-9, "direction from the kingpin to the pin"),
    ),
    chain="P, 2 (P R)", formulas="tan(arm) = (rod + inner) / back.", sources=("Dunkerley, Mechanism, 1905",),
)  # fmt: skip
