"""The Hexa robot 6-RUS: six rotary arms and rods, six freedoms with all motors on the base."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import arm_to, crank, platform, posed, rod, to
from mechlab.kit.short import PlotRecipe, builder_entry, each, ends, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Arms in three pairs; both arms of a pair turn about one line."""

    base: float = parameter(0.25, "m", "distance of the arm axes from the middle", low=0, strict=True)
    platform: float = parameter(0.1, "m", "distance of the platform joints from the middle", low=0, strict=True)
    width: float = parameter(0.2, "m", "distance of the arms of a pair", low=0, strict=True)
    narrow: float = parameter(0.1, "m", "distance of their joints on the platform", low=0, strict=True)
    arm: float = parameter(0.2, "m", "arms", low=0, strict=True)
    rod: float = parameter(0.6, "m", "rods", low=0, strict=True)
    height: float = parameter(0.55, "m", "platform above the arms at rest", low=0, strict=True)


def leg(p: Parameters, k: int, given: Mapping[str, float]) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Arm angle of leg k (0 to 5), elbow, joint, pivot, and the direction of its plane."""
    turn, s, (place, rotation) = 2 * math.pi / 3 * (k // 2), 0.5 if k % 2 else -0.5, posed("platform", given, (0, 0, p.height))
    out, side = np.array([math.cos(turn), math.sin(turn), 0]), np.array([-math.sin(turn), math.cos(turn), 0])
    pivot, joint = p.base * out + s * p.width * side, place + rotation @ (p.platform * out + s * p.narrow * side)
    return (*arm_to(pivot, out, joint, p.arm, p.rod), joint, pivot, out)


def arms(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """Where the circle of each arm meets the sphere of its rod, outside."""
    return {f"arm_{k + 1}_angle": leg(p, k, given)[0] for k in range(6)}


def build(p: Parameters) -> Mechanism:
    """Six arms, six rods with a universal joint and a ball."""
    w, legs = InWorld("hexa", 0.012, summary="Hexa robot"), [leg(p, k, {}) for k in range(6)]
    platform(w, "platform", (0, 0, p.height), [x[2] for x in legs])
    for k, (t, elbow, joint, pivot, out) in enumerate(legs, 1):
        crank(w, f"arm_{k}", f"arm_{k}_angle", pivot, out, t, elbow)
        rod(w, f"rod_{k}", elbow, joint, f"arm_{k}", "platform")
    return w.build()


PATH, ARMS = to("platform", 0.05, 0.03, 0.04, 0.0, 0.0, 0.2), tuple(f"arm_{k}_angle" for k in range(1, 7))
ENTRY = builder_entry(
    "hexa", "Hexa robot", "parallel-robot", summary="Six rotary arms with rods: six freedoms, light moving parts.",
    use="Fast handling with tilt.", origin="Francois Pierrot, 1991", parameters=Parameters, build=build, path=lambda p: PATH, drives=ARMS,
    closed=each(arms), plots=(PlotRecipe("arms", ARMS),),
    outside=ends(arms, PATH, (ARMS[0], ARMS[3]), "circle of the arm, sphere of the rod"),
    chain="6 R U S", formulas="|elbow - joint| = rod.", sources=("Pierrot et al., Hexa: a fast six-DOF parallel robot, ICAR 1991",),
)  # fmt: skip
