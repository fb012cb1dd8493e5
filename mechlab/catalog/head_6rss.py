"""A robot head on six servo arms and rods (6-RSS): the rotary Stewart platform."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import arm_to, circle, crank, platform, posed, rod, to
from mechlab.kit.short import PlotRecipe, builder_entry, each, ends, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Servos in pairs on a circle, the arms of a pair point to each other; joints of the head in pairs, turned by 60 degrees."""

    base: float = parameter(0.05, "m", "radius of the servo axes", low=0, strict=True)
    head: float = parameter(0.045, "m", "radius of the joints of the head", low=0, strict=True)
    spread: float = parameter(0.35, "rad", "half the angle of a pair", low=0, high=0.5, strict=True)
    arm: float = parameter(0.02, "m", "servo arms", low=0, strict=True)
    rod: float = parameter(0.085, "m", "rods", low=0, strict=True)
    height: float = parameter(0.08, "m", "head above the servos at rest", low=0, strict=True)


def leg(p: Parameters, k: int, given: Mapping[str, float]) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Servo angle of leg k (0 to 5), elbow, joint, pivot, and the direction of its arm along the circle."""
    s, at, (place, turn) = (-1 if k % 2 else 1), math.radians(120 * (k // 2)), posed("head", given, (0, 0, p.height))
    pivot, top = circle(p.base, [at - s * (math.pi / 3 - p.spread)])[0], circle(p.head, [at - s * p.spread])[0]
    along, joint = -s * np.array([-math.sin(at), math.cos(at), 0.0]), place + turn @ top
    return (*arm_to(pivot, along, joint, p.arm, p.rod), joint, pivot, along)


def servos(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """Where the circle of each arm meets the sphere of its rod."""
    return {f"servo_{k + 1}": leg(p, k, given)[0] for k in range(6)}


def build(p: Parameters) -> Mechanism:
    """Six arms, six rods with a universal joint and a ball."""
    w, legs = InWorld("head_6rss", 0.004, summary="head on six servo arms"), [leg(p, k, {}) for k in range(6)]
    platform(w, "head", (0, 0, p.height), [x[2] for x in legs], 0.4)
    for k, (t, elbow, joint, pivot, along) in enumerate(legs, 1):
        crank(w, f"arm_{k}", f"servo_{k}", pivot, along, t, elbow)
        rod(w, f"rod_{k}", elbow, joint, f"arm_{k}", "head")
    return w.build()


PATH, SERVOS = to("head", 0.005, -0.004, 0.006, 0.2, -0.15, 0.25), tuple(f"servo_{k}" for k in range(1, 7))
ENTRY = builder_entry(
    "head_6rss", "Robot head 6-RSS", "parallel-robot", summary="Six servo arms and rods under a head: it nods, tilts, turns and shifts.",
    use="Heads of desktop robots, camera mounts, motion platforms.", origin="after Pierrot's Hexa, 1991; Reachy Mini, 2025",
    parameters=Parameters, build=build, drives=SERVOS, released=0.1,
    path=lambda p: PATH, closed=each(servos), plots=(PlotRecipe("servos", SERVOS),), sliders=("height", "spread"),
    outside=ends(servos, PATH, ("servo_1", "servo_4"), "circle of the arm, sphere of the rod"),
    chain="6 R S S", formulas="|elbow - joint| = rod.", sources=("Merlet, Parallel Robots, 2006",),
)  # fmt: skip
