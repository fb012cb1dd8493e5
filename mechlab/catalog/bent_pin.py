"""Hobson's bent-pin coupling: bent pins slide in the holes of two hubs at an angle; both turn alike."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle
from mechlab.kit.short import Motion, PlotRecipe, alike, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute


@dataclass(frozen=True)
class Parameters:
    """Shaft 1 along x, shaft 2 turned from it about z; each pin is parallel to both shafts."""

    bend: float = parameter(1.5707963, "rad", "angle between the shafts", low=0.2, high=2.2)
    radius: float = parameter(0.04, "m", "circle of the holes", low=0, strict=True)
    pins: int = parameter(3, "", "pins", low=2, high=6)


def slide(p: Parameters, t: np.ndarray, k: int) -> np.ndarray:
    """Corner of pin k along shaft 1: it lies in the plane of symmetry, x (1 + cos bend) + y sin bend = 0, with y = radius cos(t + t_k)."""
    return -p.radius * np.cos(t + 2.0 * math.pi * k / p.pins) * math.tan(0.5 * p.bend)


def build(p: Parameters) -> Mechanism:
    """A pin slides and turns in hub 1, and in hub 2 by the loop."""
    out, r = np.array([math.cos(p.bend), math.sin(p.bend), 0.0]), p.radius
    w, hub = InWorld("bent_pin", 0.15 * r, (0, 0, 0), "bent-pin coupling"), Inertia.cylinder(0.2, r, r)
    corners = [np.array([-y * math.tan(0.5 * p.bend), y, z]) for y, z, _ in circle(r, (2 * math.pi / p.pins * np.arange(p.pins)).tolist())]
    far, end = (3.0 * r * math.tan(0.5 * p.bend) * x for x in (np.array([-1.0, 0, 0]), out))
    w.link("driver", revolute("driver_angle", "x"), at=far, to=[far * 1.4, *(far + c * [0, 1, 1] for c in corners)], more=hub)
    w.link("follower", revolute("follower_angle", out.tolist()), at=end, to=[1.4 * end, *(end + c - c @ out * out for c in corners)],
           more=hub)
    for k, c in enumerate(corners):
        joints = prismatic(f"slide_{k}", "x", zero=float(c[0])), revolute(f"turn_{k}", "x")
        w.link(f"pin_{k}", *joints, at=c, to=[[1.2 * far[0], *c[1:]], c + (1.2 * end - c) @ out * out], parent="driver")
        w.close(f"hole_{k}", f"pin_{k}", "follower", c, "cylindrical", out)
    return w.drive("driver_angle", stiffness=2.0, damping=0.01).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """The reflection in the plane of symmetry takes shaft 1 to shaft 2; pins never turn in space."""
    t = given["driver_angle"]
    return {"follower_angle": t} | {f"slide_{k}": slide(p, t, k) for k in range(p.pins)} | {f"turn_{k}": -t for k in range(p.pins)}


ENTRY = builder_entry(
    "bent_pin", "Bent-pin coupling", "coupling", summary="Bent pins slide in two hubs at an angle: equal turn even at ninety degrees.",
    use="Right-angle drives without gears, elbow engines, hand tools.", origin="known as Hobson's coupling since about 1900",
    parameters=Parameters, build=build, path=lambda p: {"driver_angle": (0.0, 2 * math.pi)}, closed=closed, sliders=("bend",), duration=0.5,
    plots=(PlotRecipe("pins", ("slide_0", "slide_1")),),
    outside=(alike("follower_angle", "driver_angle", "mirror symmetry"),
             value_at("slide_0", lambda p: p.radius * math.tan(0.5 * p.bend), "corner in the plane of symmetry", 12)),
    chain="R, n (C C), R", formulas="slide = -radius cos(t + t_k) tan(bend / 2).", sources=("Hiscox, Mechanical Movements, 1899",),
)  # fmt: skip
