"""The 3-UPU robot: three telescopic legs with universal joints translate a platform without turning it."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle, platform, thirds
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, prismatic, revolute


@dataclass(frozen=True)
class Parameters:
    """Both universal joints of a leg have parallel pins."""

    base: float = parameter(0.3, "m", "radius of the base joints", low=0, strict=True)
    platform: float = parameter(0.12, "m", "radius of the platform joints", low=0, strict=True)
    height: float = parameter(0.45, "m", "height at rest", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Leg: pin along the tangent, pin across the leg, slide; a universal joint of the same pins on the platform."""
    up, w = np.array([0, 0, p.height]), InWorld("upu3", 0.012, summary="3-UPU robot")
    below, above = circle(p.base, thirds()), [q + up for q in circle(p.platform, thirds())]
    platform(w, "platform", up, above)
    for k, (a, b) in enumerate(zip(below, above, strict=True), 1):
        way, tangent = (b - a) / np.linalg.norm(b - a), np.cross((0, 0, 1), a) / p.base
        pin = np.cross(way, tangent)
        w.link(f"leg_{k}", revolute(f"leg_{k}_a", tangent.tolist()), revolute(f"leg_{k}_b", pin.tolist()), at=a, to=[a + 0.5 * (b - a)])
        w.link(f"rod_{k}", prismatic(f"length_{k}", way.tolist(), zero=float(np.linalg.norm(b - a))), at=b, to=[a + 0.45 * (b - a)],
               parent=f"leg_{k}")
        w.link(f"fork_{k}", revolute(f"fork_{k}_b", pin.tolist()), at=b, to=[b + 0.02 * tangent], parent=f"rod_{k}")
        w.close(f"pin_{k}", f"fork_{k}", "platform", b, "revolute", tangent).drive(f"length_{k}", stiffness=2e4, damping=200.0)
    return w.build()


def length(p: Parameters, k: int) -> float:
    """Leg k (0 to 2) at the end: distance of its joints, the platform level."""
    return float(np.linalg.norm(np.array(END) + [0, 0, p.height] + circle(p.platform, thirds())[k] - circle(p.base, thirds())[k]))


END, LEGS = (0.06, -0.03, 0.05), ("length_1", "length_2", "length_3")
ENTRY = builder_entry(
    "upu3", "3-UPU robot", "parallel-robot", summary="Three telescopic legs with parallel pins: the platform translates and never turns.",
    use="Positioners; a textbook case of a constraint singularity.", origin="Lung-Wen Tsai, 1996", parameters=Parameters,
    build=build, timestep=8e-4,
    path=lambda p: {f"platform_{n}": (0.0, x) for n, x in zip("xyz", END, strict=True)}, drives=LEGS, sliders=("height", "platform"),
    plots=(PlotRecipe("legs", LEGS),),
    outside=(
        *(value_at(f"length_{k + 1}", partial(length, k=k), "distance of its joints") for k in (0, 1)),
        Outside("turn of the platform along the path", "rad", lambda p: 0.0,
                lambda p, m: farthest(abs(m["platform_roll"]) + abs(m["platform_yaw"]), 0.0), 1e-9, "Tsai 1996: parallel pins"),
    ),
    chain="3 U P U", formulas="leg = |place + b - a|.",
    sources=("Tsai, Kinematics of a three-DOF platform with three extensible limbs, ARK 1996",),
)  # fmt: skip
