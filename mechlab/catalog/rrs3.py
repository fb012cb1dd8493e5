"""The 3-RRS platform: three legs in three planes lift and tilt a platform."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechlab.kit.compass import meet
from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle, platform, thirds
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Each leg bends outwards in its own upright plane."""

    base: float = parameter(0.15, "m", "radius of the base hinges", low=0, strict=True)
    platform: float = parameter(0.12, "m", "radius of the balls", low=0, strict=True)
    lower: float = parameter(0.1, "m", "lower links", low=0, strict=True)
    upper: float = parameter(0.15, "m", "upper links", low=0, strict=True)
    height: float = parameter(0.18, "m", "height at rest", low=0, strict=True)


def knee(p: Parameters, radius: float, height: float) -> complex:
    """Knee of a leg in its plane (outwards, up) for a ball at this radius and height, by compasses."""
    return meet(complex(p.base, 0.0), p.lower, complex(radius, height), p.upper, -1)


def build(p: Parameters) -> Mechanism:
    """Legs R R, balls on the platform; the platform keeps six joints, three of them are taken away by the legs."""
    w, up, k0 = InWorld("rrs3", 0.01, summary="3-RRS platform"), np.array([0, 0, p.height]), knee(p, p.platform, p.height)
    tops = [q + up for q in circle(p.platform, thirds())]
    platform(w, "platform", up, tops, 0.8)
    first = math.atan2(k0.imag, k0.real - p.base)
    for k, (turn, top) in enumerate(zip(thirds(), tops, strict=True), 1):
        out, axis = np.array([math.cos(turn), math.sin(turn), 0]), [math.sin(turn), -math.cos(turn), 0.0]
        bend = k0.real * out + [0, 0, k0.imag]
        w.link(f"lower_{k}", revolute(f"lower_{k}_angle", axis, zero=first), at=p.base * out, to=[bend])
        w.link(f"upper_{k}", revolute(f"knee_{k}", axis), at=bend, to=[top], parent=f"lower_{k}")
        w.close(f"ball_{k}", f"upper_{k}", "platform", top).drive(f"lower_{k}_angle", stiffness=50.0, damping=0.5)
    return w.build()


def lower(p: Parameters, tilt: float) -> float:
    """Leg 1 at the end, the platform pitched about y through its middle by the tilt: x shifts so that the balls 2 and 3 stay in their
    planes; ball 1 is at platform (cos tilt + parasitic shift) as Carretero 2000: shift = -platform (1 - cos tilt) / 2."""
    radius = p.platform * math.cos(tilt) - 0.5 * p.platform * (1 - math.cos(tilt))
    found = knee(p, radius, p.height + 0.03 - p.platform * math.sin(tilt))
    return math.atan2(found.imag, found.real - p.base)


DRIVES = ("lower_1_angle", "lower_2_angle", "lower_3_angle")
ENTRY = builder_entry(
    "rrs3", "3-RRS platform", "parallel-robot",
    summary="Three legs with a hinge, a knee and a ball: lift and two tilts, with a small parasitic shift.",
    use="Ball balancing tables, tilting heads.", origin="Kenneth Hunt, 1983", parameters=Parameters, build=build, drives=DRIVES,
    sliders=("height", "lower"), plots=(PlotRecipe("drives", DRIVES),),
    path=lambda p: {"platform_z": (0.0, 0.03), "platform_roll": (0.0, 0.0), "platform_pitch": (0.0, 0.2)},
    outside=(
        Outside("drive 1 at the end, lifted and tilted", "rad", lambda p: lower(p, 0.2), lambda p, m: float(m["lower_1_angle"][-1]),
                1e-9, "compasses and the parasitic shift of Carretero et al. 2000"),
        Outside("parasitic shift at the end", "m", lambda p: -0.5 * p.platform * (1 - math.cos(0.2)),
                lambda p, m: float(m["platform_x"][-1]), 1e-9, "Carretero et al., J. Mech. Design 122, 2000"),
    ),
    chain="3 R R S", formulas="x = -r (1 - cos tilt) / 2 for a tilt about y.",
    sources=("Carretero, Podhorodeski, Nahon, Gosselin, Kinematic analysis of a new 3-DOF spatial parallel manipulator, 2000",),
)  # fmt: skip
