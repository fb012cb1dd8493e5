"""Clavel's Delta: three rotary arms, three parallelograms of rods, a platform that stays level."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import arm_to, circle, crank, platform, posed, rod, thirds, to
from mechlab.kit.short import PlotRecipe, always, builder_entry, each, ends, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Arms hang from a base above; each carries two parallel rods to the platform."""

    base: float = parameter(0.2, "m", "radius of the arm pivots", low=0, strict=True)
    platform: float = parameter(0.05, "m", "radius of the platform joints", low=0, strict=True)
    arm: float = parameter(0.3, "m", "arms", low=0, strict=True)
    rod: float = parameter(0.8, "m", "rods", low=0, strict=True)
    width: float = parameter(0.06, "m", "distance of the rods of a pair", low=0, strict=True)
    depth: float = parameter(0.7, "m", "platform below the base at rest", low=0, strict=True)


def leg(p: Parameters, k: int, given: Mapping[str, float]) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Angle of arm k (0 to 2) below the level, its elbow, the middle of the platform joints, the direction of its plane; the outer one."""
    out, place = circle(1.0, thirds())[k], posed("platform", given, (0, 0, -p.depth))[0]
    angle, elbow = arm_to(p.base * out, out, place + p.platform * out, p.arm, p.rod, 1)
    return -angle, elbow, place + p.platform * out, out


def arms(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """Where the circle of each arm meets the sphere of its rods; the platform stays level."""
    return {ARMS[k]: leg(p, k, given)[0] for k in range(3)} | {"platform_roll": 0.0, "platform_pitch": 0.0, "platform_yaw": 0.0}


def build(p: Parameters) -> Mechanism:
    """The platform has all six freedoms; the rods take away its turns."""
    w, legs = InWorld("clavel_delta", 0.012, summary="Delta robot with rotary arms"), [leg(p, k, {}) for k in range(3)]
    platform(w, "platform", (0, 0, -p.depth), [x[2] for x in legs], 0.5)
    for k, (t, elbow, joint, out) in enumerate(legs, 1):
        half = 0.5 * p.width * np.cross([0, 0, 1], out)
        crank(w, f"arm_{k}", ARMS[k - 1], p.base * out, -out, t, elbow + half, elbow - half)
        rod(w, f"rod_{k}_left", elbow + half, joint + half, f"arm_{k}", "platform")
        rod(w, f"rod_{k}_right", elbow - half, joint - half, f"arm_{k}", "platform")
    return w.mark("P", "platform", (0, 0, -p.depth)).build()


PATH, ARMS = to("platform", 0.1, -0.05, -0.06), ("arm_1_angle", "arm_2_angle", "arm_3_angle")
ENTRY = builder_entry(
    "clavel_delta", "Delta robot", "parallel-robot", use="Picking and packing at several parts a second.",
    summary="Three rotary arms and three pairs of rods: fast translation of a level platform.", origin="Reymond Clavel, 1985", drives=ARMS,
    parameters=Parameters, build=build, path=lambda p: PATH, closed=each(arms), sliders=("arm", "rod"), plots=(PlotRecipe("arms", ARMS),),
    outside=(*ends(arms, PATH, ARMS[:2], "Clavel 1991: sphere and circle"),
             always("tilt", "rad", lambda p, m: abs(m["platform_roll"]) + abs(m["platform_pitch"]), lambda p: 0.0, "parallelograms")),
    chain="3 R (SS)2", formulas="|elbow - platform joint| = rod.", sources=("Clavel, Conception d'un robot parallele rapide, EPFL 1991",),
)  # fmt: skip
