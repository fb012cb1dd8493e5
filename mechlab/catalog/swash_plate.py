"""The swash plate: an inclined disc on a turning shaft moves axial pistons as pure sines."""

from __future__ import annotations

import math

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, Placement, prismatic, revolute, shape
from mechlab.mechanism.geometry import axis_rotation


@dataclass(frozen=True)
class Parameters:
    """Pistons along z on a circle; each stands on a slipper that slides on the plate."""

    tilt: float = parameter(0.3, "rad", "inclination of the plate", low=0, high=0.8, strict=True)
    radius: float = parameter(0.05, "m", "circle of the pistons", low=0, strict=True)
    pistons: int = parameter(3, "", "pistons", low=1, high=7)


def build(p: Parameters) -> Mechanism:
    """The plate's normal is (-sin, 0, cos)(tilt) at the start; a slipper has two slides in the plate and a ball at its piston."""
    c, s = math.cos(p.tilt), math.sin(p.tilt)
    w, r = InWorld("swash_plate", 0.1 * p.radius, summary="swash plate"), p.radius
    disc = shape("disc", Placement.of(axis_rotation((0.0, 1.0, 0.0), -p.tilt), (0, 0, 0)), name="plate", radius=1.3 * r,
                 thickness=0.1 * r)
    w.link("plate", revolute("shaft_angle", "z"), at=(0, 0, 0), to=[(0, 0, -r)], more=Inertia.cylinder(0.8, 1.3 * r, 0.1 * r),
           shapes=[disc])
    for k, at in enumerate(circle(r, [2 * math.pi * i / p.pistons for i in range(p.pistons)]), 1):
        at[2] = at[0] * s / c
        slides = prismatic(f"slip_{k}_a", (c, 0, s)), prismatic(f"slip_{k}_b", "y")
        w.link(f"slipper_{k}", *slides, at=at, parent="plate", more=Inertia.cylinder(0.02, 0.15 * r, 0.1 * r))
        w.link(f"piston_{k}", prismatic(f"piston_{k}", "z", zero=float(at[2])), at=at, to=[at + [0, 0, r]], mass_per_length=3.0)
        w.close(f"ball_{k}", f"slipper_{k}", f"piston_{k}", at)
    return w.drive("shaft_angle", stiffness=50.0, damping=0.5).build()


def piston(p: Parameters, t: float, at: float = 0.0) -> float:
    """Height of a piston at the angle `at` of the circle, shaft at t: radius tan(tilt) cos(t - at)."""
    return p.radius * math.tan(p.tilt) * math.cos(t - at)


ENTRY = builder_entry(
    "swash_plate", "Swash plate", "engine", summary="An inclined plate and axial pistons: stroke by the inclination, pure sines.",
    use="Axial pumps and motors, air-conditioning compressors, helicopter rotors.",
    origin="Anthony Michell's crankless engine, 1920; Hans Thoma's pumps, 1930s", parameters=Parameters, build=build, duration=0.5,
    path=lambda p: {"shaft_angle": (0.0, 2 * math.pi)}, sliders=("tilt", "radius"), plots=(PlotRecipe("piston", ("piston_1",)),),
    outside=(
        Outside("stroke of piston 1", "m", lambda p: 2 * p.radius * math.tan(p.tilt),
                lambda p, m: float(m["piston_1"][0] - m["piston_1"][12]), 1e-9, "2 radius tan(tilt)"),
        Outside("last piston after an eighth of a turn", "m",
                lambda p: piston(p, math.pi / 4, 2 * math.pi * (p.pistons - 1) / p.pistons),
                lambda p, m: float(m[f"piston_{p.pistons}"][3]), 1e-9, "radius tan(tilt) cos(t - t_k)"),
    ),
    chain="R, n (P P S P)", formulas="z = radius tan(tilt) cos(t - t_k).",
    sources=("Ivantysyn, Ivantysynova, Hydrostatic Pumps and Motors, 2001",),
)  # fmt: skip
