"""The Hexa robot 6-RUS: six rotary arms and rods, six freedoms with all motors on the base."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import platform, rod, turned
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, value_at
from mechlab.mechanism import Mechanism, revolute


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


def leg(p: Parameters, k: int, place: np.ndarray, yaw: float) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Arm angle of leg k (0 to 5), its pivot, elbow and joint: pivot + arm (cos t out + sin t z), at the distance rod from the joint d:
    d.out cos t + d.z sin t = (d2 + arm2 - rod2) / (2 arm), the outer solution."""
    turn, s = 2 * math.pi / 3 * (k // 2), 0.5 if k % 2 else -0.5
    out, side = np.array([math.cos(turn), math.sin(turn), 0]), np.array([-math.sin(turn), math.cos(turn), 0])
    pivot = p.base * out + s * p.width * side
    joint = place + turned(0.0, 0.0, yaw) @ (p.platform * out + s * p.narrow * side)
    d = joint - pivot
    u, v = float(d @ out), float(d[2])
    t = math.atan2(v, u) - math.acos((d @ d + p.arm**2 - p.rod**2) / (2 * p.arm * math.hypot(u, v)))
    return t, pivot, pivot + p.arm * (math.cos(t) * out + np.array([0, 0, math.sin(t)])), joint


def arm(p: Parameters, k: int) -> float:
    """Arm angle of leg k at the end of the path."""
    return leg(p, k, np.array([END["platform_x"], END["platform_y"], p.height + END["platform_z"]]), END["platform_yaw"])[0]


def build(p: Parameters) -> Mechanism:
    """Six arms, six rods with a universal joint and a ball."""
    up = np.array([0, 0, p.height])
    legs = [leg(p, k, up, 0.0) for k in range(6)]
    w = InWorld("hexa", 0.012, summary="Hexa robot")
    platform(w, "platform", up, [x[3] for x in legs])
    for k, (t, pivot, elbow, joint) in enumerate(legs, 1):
        turn = 2 * math.pi / 3 * ((k - 1) // 2)
        w.link(f"arm_{k}", revolute(f"arm_{k}_angle", (math.sin(turn), -math.cos(turn), 0), zero=t), at=pivot, to=[elbow])
        rod(w, f"rod_{k}", elbow, joint, f"arm_{k}", "platform")
        w.drive(f"arm_{k}_angle", stiffness=200.0, damping=2.0)
    return w.build()


END = {"platform_x": 0.05, "platform_y": 0.03, "platform_z": 0.04, "platform_roll": 0.0, "platform_pitch": 0.0, "platform_yaw": 0.2}
ARMS = tuple(f"arm_{k}_angle" for k in range(1, 7))
ENTRY = builder_entry(
    "hexa", "Hexa robot", "parallel-robot", summary="Six rotary arms with rods: six freedoms, light moving parts.",
    use="Fast handling with tilt; Reachy's neck and other 6-RSS heads are small ones.", origin="Francois Pierrot, 1991",
    parameters=Parameters, build=build, path=lambda p: {n: (0.0, x) for n, x in END.items()}, drives=ARMS,
    plots=(PlotRecipe("arms", ARMS),),
    outside=tuple(value_at(f"arm_{k + 1}_angle", partial(arm, k=k), "circle of the arm, sphere of the rod", unit="rad") for k in (0, 3)),
    chain="6 R U S", formulas="|elbow - joint| = rod.",
    sources=("Pierrot, Dauchez, Fournier, Hexa: a fast six-DOF fully parallel robot, ICAR 1991",),
)  # fmt: skip
