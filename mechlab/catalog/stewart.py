"""The Gough-Stewart platform 6-UPS: six legs of changing length hold a platform with six freedoms."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import platform, posed, telescope, to
from mechlab.kit.short import PlotRecipe, builder_entry, each, ends, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Joints in pairs on two circles; the platform is turned by 60 degrees against the base."""

    base: float = parameter(0.4, "m", "radius of the base joints", low=0, strict=True)
    platform: float = parameter(0.25, "m", "radius of the platform joints", low=0, strict=True)
    spread: float = parameter(0.2, "rad", "half the angle of a pair", low=0, high=0.5, strict=True)
    height: float = parameter(0.5, "m", "height of the platform at rest", low=0, strict=True)


def joints(p: Parameters) -> tuple[np.ndarray, np.ndarray]:
    """(6, 3) base joints, and platform joints in the platform's axes."""
    turns = np.radians([0, 0, 120, 120, 240, 240])
    below = turns + p.spread * np.array([-1, 1] * 3)
    above = turns + np.array([-1, 1] * 3) * (math.pi / 3 - p.spread)
    return tuple(r * np.column_stack([np.cos(a), np.sin(a), 0 * a]) for r,
                 a in ((p.base, below), (p.platform, above)))  # type: ignore[return-value]


def build(p: Parameters) -> Mechanism:
    """The platform with three slides and three turns in the world; each leg a universal joint, a slide and a ball."""
    below, above = joints(p)
    w, up = InWorld("stewart", 0.015, summary="Gough-Stewart platform"), np.array([0, 0, p.height])
    platform(w, "platform", up, list(above + up), 2.0)
    for k, (a, b) in enumerate(zip(below, above + up, strict=True), 1):
        telescope(w, k, a, b, "platform")
    return w.build()


def lengths(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """Length of each leg, |place + R b - a|."""
    (below, above), (place, rotation) = joints(p), posed("platform", given, (0, 0, p.height))
    return dict(zip(LEGS, np.linalg.norm(place + above @ rotation.T - below, axis=1).tolist(), strict=True))


PATH, LEGS = to("platform", 0.05, 0.0, 0.04, 0.15, -0.1, 0.0), tuple(f"length_{k}" for k in range(1, 7))
ENTRY = builder_entry(
    "stewart", "Gough-Stewart platform", "parallel-robot", summary="Six legs of changing length: a stiff platform with six freedoms.",
    use="Flight simulators, machine tools, telescopes.", origin="Eric Gough, 1954; D. Stewart, 1965", parameters=Parameters, build=build,
    path=lambda p: PATH, closed=each(lengths), drives=LEGS, duration=2.0, sliders=("height", "spread"), plots=(PlotRecipe("legs", LEGS),),
    outside=ends(lengths, PATH, ("length_1", "length_4"), "inverse kinematics: distance of its joints", "m"),
    chain="6 U P S", formulas="leg = |place + R b - a|.", sources=("Merlet, Parallel Robots, 2006",),
)  # fmt: skip
