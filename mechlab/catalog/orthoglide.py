"""The Orthoglide: three slides at right angles, pairs of rods, a platform that stays parallel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import platform, rod
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.mechanism import Inertia, Mechanism, prismatic


@dataclass(frozen=True)
class Parameters:
    """In the middle pose all rods lie along their slides: the Jacobian is the identity there."""

    rod: float = parameter(0.3, "m", "rods", low=0, strict=True)
    width: float = parameter(0.06, "m", "distance of the rods of a pair", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Sliders at rod along x, y, z; each pair of rods in the plane across."""
    w, axes, half = InWorld("orthoglide", 0.01, summary="Orthoglide"), np.eye(3), 0.5 * p.width
    joints = [s * half * axes[(k + 1) % 3] for k in range(3) for s in (-1, 1)]
    platform(w, "platform", (0, 0, 0), joints, 0.5)
    for k, name in enumerate("xyz"):
        way, side = axes[k], axes[(k + 1) % 3]
        w.link(f"slider_{name}", prismatic(f"slide_{name}", name, zero=p.rod), at=p.rod * way,
               to=[p.rod * way - half * side, p.rod * way + half * side], more=Inertia.box(0.2, 0.03, 0.03, 0.03))
        for n, s in (("a", -1), ("b", 1)):
            rod(w, f"rod_{name}_{n}", p.rod * way + s * half * side, s * half * side, f"slider_{name}", "platform")
        w.drive(f"slide_{name}", stiffness=2e4, damping=200.0)
    return w.mark("P", "platform", (0, 0, 0)).build()


def slide(p: Parameters, along: float, a: float, b: float) -> float:
    """Slide of a platform place: along + sqrt(rod^2 - a^2 - b^2)."""
    return along + math.sqrt(p.rod**2 - a * a - b * b)


END, SLIDES = (0.05, -0.04, 0.06), ("slide_x", "slide_y", "slide_z")
ENTRY = builder_entry(
    "orthoglide", "Orthoglide", "parallel-robot",
    summary="Three slides at right angles with parallelograms: even in all directions about its middle.",
    use="Machine tools with the stiffness of a parallel and the evenness of a Cartesian machine.",
    origin="Philippe Wenger and Damien Chablat, 2000", parameters=Parameters, build=build,
    path=lambda p: {f"platform_{n}": (0.0, x) for n, x in zip("xyz", END, strict=True)}, drives=SLIDES, sliders=("rod",),
    plots=(PlotRecipe("slides", SLIDES),),
    outside=(
        Outside("slide x at the end", "m", lambda p: slide(p, *END), lambda p, m: float(m["slide_x"][-1]), 1e-9, "sphere of the rod"),
        Outside("slide z at the end", "m", lambda p: slide(p, END[2], END[0], END[1]), lambda p, m: float(m["slide_z"][-1]), 1e-9,
                "sphere of the rod"),
        Outside("rate of slide y over that of the platform in the middle", "", lambda p: 1.0,
                lambda p, m: float(m["slide_y_rate"][0] / m["platform_y_rate"][0]), 1e-9, "isotropic pose"),
        Outside("tilt along the path", "rad", lambda p: 0.0,
                lambda p, m: farthest(abs(m["platform_roll"]) + abs(m["platform_yaw"]), 0.0), 1e-9, "parallelograms"),
    ),
    chain="3 P (SS)2", formulas="slide = x + sqrt(rod2 - y2 - z2).",
    sources=("Wenger, Chablat, Kinematic analysis of a new parallel machine tool, ARK 2000",),
)  # fmt: skip
