"""Clavel's Delta: three rotary arms, three parallelograms of rods, a platform that stays level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle, platform, rod, thirds
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter, value_at
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Arms hang from a base above; each carries two parallel rods to the platform."""

    base: float = parameter(0.2, "m", "radius of the arm pivots", low=0, strict=True)
    platform: float = parameter(0.05, "m", "radius of the platform joints", low=0, strict=True)
    arm: float = parameter(0.3, "m", "arms", low=0, strict=True)
    rod: float = parameter(0.8, "m", "rods", low=0, strict=True)
    width: float = parameter(0.06, "m", "distance of the rods of a pair", low=0, strict=True)
    depth: float = parameter(0.7, "m", "platform below the base at rest", low=0, strict=True)


def arm_angle(p: Parameters, k: int, place: np.ndarray) -> float:
    """Arm k below the horizontal for a platform place: in its own plane the elbow (base + arm cos t, -arm sin t) keeps the distance
    rod from the platform joint (x, y, z): c cos t + z sin t = s, c = base - x, 2 arm s = rod2 - arm2 - c2 - y2 - z2, the outer one."""
    turn = thirds()[k]
    x = math.cos(turn) * place[0] + math.sin(turn) * place[1] + p.platform
    y = -math.sin(turn) * place[0] + math.cos(turn) * place[1]
    c, z = p.base - x, place[2]
    s = (p.rod**2 - p.arm**2 - c * c - y * y - z * z) / (2 * p.arm)
    return math.acos(s / math.hypot(c, z)) + math.atan2(z, c)


def build(p: Parameters) -> Mechanism:
    """The platform has all six freedoms; the rods take away its turns."""
    down = np.array([0.0, 0.0, -p.depth])
    w, t = InWorld("clavel_delta", 0.012, summary="Delta robot with rotary arms"), arm_angle(p, 0, down)
    joints = [np.array(q) + down for q in circle(p.platform, thirds())]
    platform(w, "platform", down, joints, 0.5)
    for k, turn in enumerate(thirds(), 1):
        out, side = np.array([math.cos(turn), math.sin(turn), 0.0]), np.array([-math.sin(turn), math.cos(turn), 0.0])
        elbow = (p.base + p.arm * math.cos(t)) * out - np.array([0, 0, p.arm * math.sin(t)])
        w.link(f"arm_{k}", revolute(f"arm_{k}_angle", side.tolist(), zero=t), at=p.base * out,
               to=[elbow + 0.5 * p.width * side, elbow - 0.5 * p.width * side])
        for n, s in (("left", 0.5), ("right", -0.5)):
            rod(w, f"rod_{k}_{n}", elbow + s * p.width * side, joints[k - 1] + s * p.width * side, f"arm_{k}", "platform")
        w.drive(f"arm_{k}_angle", stiffness=200.0, damping=2.0)
    return w.mark("P", "platform", down).build()


def at_end(p: Parameters, k: int) -> float:
    """Angle of arm k at the end of the path."""
    return arm_angle(p, k, np.array([*END.values()]) - [0, 0, p.depth])


END = {"platform_x": 0.1, "platform_y": -0.05, "platform_z": -0.06}
ENTRY = builder_entry(
    "clavel_delta", "Delta robot", "parallel-robot",
    summary="Three rotary arms and three pairs of rods: fast translation of a level platform.",
    use="Picking and packing at several parts a second.", origin="Reymond Clavel, 1985", parameters=Parameters, build=build,
    path=lambda p: {n: (0.0, x) for n, x in END.items()}, drives=("arm_1_angle", "arm_2_angle", "arm_3_angle"), sliders=("arm", "rod"),
    plots=(PlotRecipe("arms", ("arm_1_angle", "arm_2_angle", "arm_3_angle")),),
    outside=(
        *(value_at(f"arm_{k + 1}_angle", partial(at_end, k=k), "Clavel 1991: sphere and circle", unit="rad") for k in (0, 1)),
        Outside("tilt of the platform along the path", "rad", lambda p: 0.0,
                lambda p, m: farthest(abs(m["platform_roll"]) + abs(m["platform_pitch"]), 0.0), 1e-9, "parallelograms"),
    ),
    chain="3 R (SS)2", formulas="|elbow - platform joint| = rod.",
    sources=("Clavel, Conception d'un robot parallele rapide a 4 degres de liberte, 1991",),
)  # fmt: skip
