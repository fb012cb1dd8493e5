"""The cardan (universal) joint: two shafts at an angle and a cross between them."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, builder_entry, parameter, speeds
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Both shafts meet in the middle of the cross."""

    angle: float = parameter(0.6, "rad", "angle between the shafts", low=0, high=1.2, strict=True)
    shaft: float = parameter(0.15, "m", "length of the shafts", low=0, strict=True)
    arm: float = parameter(0.03, "m", "arms of the cross", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Input along x, its yoke along z; output in the plane x-y, its yoke in that plane."""
    c, s = math.cos(p.angle), math.sin(p.angle)
    out, pin = np.array([c, s, 0.0]), np.array([-s, c, 0.0])
    w = InWorld("cardan", 0.1 * p.shaft, summary="universal joint")
    w.link("driver", revolute("driver_angle", "x"), at=(0, 0, 0), to=[(-p.shaft, 0, 0)])
    w.link("cross", revolute("cross_angle", "z"), at=(0, 0, 0), to=[(0, 0, p.arm), (0, 0, -p.arm), p.arm * pin, -p.arm * pin],
           parent="driver")
    w.link("follower", revolute("follower_angle", out.tolist()), at=(0, 0, 0), to=[p.shaft * out])
    w.close("pin", "cross", "follower", (0, 0, 0), "revolute", pin)
    w.drive("driver_angle", stiffness=2.0, damping=0.01)
    return w.assemble({}, hold=["driver_angle"])


def closed(p: Parameters, given: Motion) -> Motion:
    """tan(follower) = tan(driver) cos(angle): pins (0, -sin t, cos t) and (-s cos f, c cos f, sin f) are at right angles."""
    return {"follower_angle": np.arctan2(math.cos(p.angle) * np.sin(given["driver_angle"]), np.cos(given["driver_angle"]))}


ENTRY = builder_entry(
    "cardan", "Cardan joint", "coupling", summary="Two shafts at an angle, a cross between their yokes: the output runs unevenly.",
    use="Drive shafts, steering columns, sockets.", origin="Girolamo Cardano, 16th century; Robert Hooke, 1676", parameters=Parameters,
    build=build, path=lambda p: {"driver_angle": (0.0, 2 * math.pi)}, closed=closed, sliders=("angle",),
    plots=(PlotRecipe("speed", ("follower_angle_rate",)),),
    outside=(
        speeds("follower_angle", "driver_angle", lambda p: math.cos(p.angle), "Hooke 1676: cos(angle)",
               text="speed ratio with the driving yoke across the bend"),
        speeds("follower_angle", "driver_angle", lambda p: 1 / math.cos(p.angle), "Hooke 1676: 1 / cos(angle)", 6,
               text="speed ratio a quarter turn on"),
    ),
    chain="R, 2 R, R", formulas="tan(follower) = tan(driver) cos(angle).",
    sources=("Seherr-Thoss, Schmelz, Aucktor, Universal Joints and Driveshafts",),
)  # fmt: skip
