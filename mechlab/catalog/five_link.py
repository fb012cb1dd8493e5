"""A five-link suspension: five rods guide a wheel carrier, which keeps one freedom."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import platform, rod
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, speeds
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism

WHEEL, RODS = np.array([0.0, 0.75, 0.0]), {
    "front_lower": ((0.18, 0.35, -0.10), (0.02, 0.66, -0.12)), "rear_lower": ((-0.16, 0.30, -0.08), (-0.02, 0.68, -0.11)),
    "front_upper": ((0.14, 0.42, 0.10), (0.03, 0.66, 0.13)), "rear_upper": ((-0.12, 0.40, 0.12), (-0.02, 0.67, 0.14)),
    "toe": ((-0.20, 0.36, 0.00), (-0.13, 0.68, -0.01)),
}  # fmt: skip
"""Wheel centre, and joints of the rods at the body and at the carrier [m]: x forward, y outward, z up; a rear left wheel."""


@dataclass(frozen=True)
class Parameters:
    """The rods as above but for the height of the toe link, which sets the steering of the wheel as it rises."""

    toe: float = parameter(0.0, "m", "toe link at the body, raised", low=-0.05, high=0.05)
    bump: float = parameter(0.06, "m", "rise of the wheel", low=0, high=0.1, strict=True)


def rods(p: Parameters) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Rod -> its joints."""
    return {n: (np.array(a) + [0, 0, p.toe * (n == "toe")], np.array(b)) for n, (a, b) in RODS.items()}


def build(p: Parameters) -> Mechanism:
    """The carrier, free in all directions, and the rods."""
    w = InWorld("five_link", 0.02, summary="five-link suspension")
    platform(w, "wheel", WHEEL, [b for _, b in rods(p).values()], 20.0)
    for name, (a, b) in rods(p).items():
        rod(w, name, a, b, "ground", "wheel")
    return w.drive("wheel_z", stiffness=2e4, damping=1e3).build()


def twist(p: Parameters, k: int) -> float:
    """Rates x, y, z, roll, pitch, yaw over that of the rise at the start: no rod b - a gets longer, (b - a).(v + w x r) = 0, r from the
    wheel centre to b; five Pluecker lines, and the one screw reciprocal to them."""
    screw = np.linalg.svd([np.concatenate([b - a, np.cross(b - WHEEL, b - a)]) for a, b in rods(p).values()])[2][-1]
    return float(screw[k] / screw[2])


ENTRY = builder_entry(
    "five_link", "Five-link suspension", "suspension", summary="Five rods with balls guide a wheel: camber, toe and track over its travel.",
    use="Rear axles of cars; every direction of the wheel is tuned by one rod.", origin="Mercedes-Benz W201, 1982", parameters=Parameters,
    build=build, path=lambda p: {"wheel_z": (0.0, p.bump)}, sliders=("toe",), released=0.25,
    plots=(PlotRecipe("turns", ("wheel_roll", "wheel_yaw")),),
    outside=tuple(speeds(f"wheel_{n}", "wheel_z", partial(twist, k=k), "Ball 1900: the screw reciprocal to five lines", unit=unit)
                  for k, n, unit in ((1, "y", ""), (3, "roll", "rad/m"), (5, "yaw", "rad/m"))),
    chain="5 S S", formulas="(b - a) . (v + w x r) = 0 for each rod.", sources=("Matschinsky, Road Vehicle Suspensions, 2000",),
)  # fmt: skip
