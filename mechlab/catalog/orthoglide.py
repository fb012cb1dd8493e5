"""The Orthoglide: three slides at right angles, pairs of rods, a platform that stays parallel."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import platform, rod, to
from mechlab.kit.short import PlotRecipe, always, builder_entry, each, ends, parameter, speeds
from mechlab.lazy_dataclass import dataclass
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


def slides(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """Sphere of the rods about a platform place: slide = along + sqrt(rod^2 - the squares across)."""
    place = np.array([given[f"platform_{n}"] for n in "xyz"])
    return {f"slide_{n}": x + math.sqrt(p.rod**2 - place @ place + x * x) for n, x in zip("xyz", place.tolist(), strict=True)}


PATH, SLIDES = to("platform", 0.05, -0.04, 0.06), ("slide_x", "slide_y", "slide_z")
ENTRY = builder_entry(
    "orthoglide", "Orthoglide", "parallel-robot",
    summary="Three slides at right angles with parallelograms: even in all directions about its middle.",
    use="Machine tools with the stiffness of a parallel and the evenness of a Cartesian machine.",
    origin="Philippe Wenger and Damien Chablat, 2000", parameters=Parameters, build=build,
    path=lambda p: PATH, closed=each(slides), drives=SLIDES, sliders=("rod",), plots=(PlotRecipe("slides", SLIDES),),
    outside=(
        *ends(slides, PATH, ("slide_x", "slide_z"), "sphere of the rod", "m"),
        speeds("slide_y", "platform_y", lambda p: 1.0, "isotropic pose, in the middle of the space"),
        always("tilt", "rad", lambda p, m: abs(m["platform_roll"]) + abs(m["platform_yaw"]), lambda p: 0.0, "parallelograms"),
    ),
    chain="3 P (SS)2", formulas="slide = x + sqrt(rod2 - y2 - z2).",
    sources=("Wenger, Chablat, Kinematic analysis of a new parallel machine tool, ARK 2000",),
)  # fmt: skip
