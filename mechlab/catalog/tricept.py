"""The Tricept: three telescopic legs around a passive one that guides the platform."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle, telescope, thirds, turned
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute


@dataclass(frozen=True)
class Parameters:
    """Base above, platform below on a central column that tilts twice and slides."""

    base: float = parameter(0.3, "m", "radius of the base joints", low=0, strict=True)
    platform: float = parameter(0.12, "m", "radius of the platform joints", low=0, strict=True)
    depth: float = parameter(0.7, "m", "length of the column at rest", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Column: turn about x, turn about y, slide; the platform is its end."""
    down, w = np.array([0, 0, -p.depth]), InWorld("tricept", 0.02, summary="Tricept")
    above, below = circle(p.base, thirds()), [q + down for q in circle(p.platform, thirds())]
    joints = [revolute("tilt_x", "x"), revolute("tilt_y", "y"), prismatic("column", "-z", zero=p.depth)]
    w.link("platform", *joints, at=(0, 0, 0), to=[down, *below], more=Inertia.cylinder(3.0, p.platform, 0.04).at((0, 0, -p.depth)))
    for k, (a, b) in enumerate(zip(above, below, strict=True), 1):
        telescope(w, k, a, b, "platform")
    return w.mark("P", "platform", down).build()


def length(p: Parameters, k: int) -> float:
    """Leg k (0 to 2) at the end: |Rx(tilt_x) Ry(tilt_y) (b - (0, 0, column)) - a|."""
    b = turned(END["tilt_x"], END["tilt_y"]) @ (circle(p.platform, thirds())[k] - [0, 0, p.depth + END["column"]])
    return float(np.linalg.norm(b - circle(p.base, thirds())[k]))


END, LEGS = {"tilt_x": 0.2, "tilt_y": -0.15, "column": 0.08}, ("length_1", "length_2", "length_3")
ENTRY = builder_entry(
    "tricept", "Tricept", "parallel-robot", summary="Three driven legs and a passive column: a stiff arm with three freedoms.",
    use="Machining and riveting of aircraft parts.", origin="Karl-Erik Neumann, 1985", parameters=Parameters, build=build,
    path=lambda p: {n: (p.depth, p.depth + x) if n == "column" else (0.0, x) for n, x in END.items()}, drives=LEGS,
    sliders=("depth", "base"), plots=(PlotRecipe("legs", LEGS),),
    outside=tuple(value_at(f"length_{k + 1}", partial(length, k=k), "distance of its joints") for k in range(3)), chain="3 U P S + U P",
    formulas="leg = |R b - a|.", sources=("Neumann, US patent 4732525, 1988",),
)  # fmt: skip
