"""The double cardan joint: two crosses whose unevenness cancels."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Three shafts in one plane; both bends are equal, the yokes of the middle shaft lie in one plane."""

    angle: float = parameter(0.4, "rad", "each bend", low=0, high=1.0, strict=True)
    shaft: float = parameter(0.12, "m", "length of each shaft", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """The middle shaft along x; driver and follower in the plane x-y, bent to the same side."""
    c, s, half = math.cos(p.angle), math.sin(p.angle), 0.5 * p.shaft
    left, right = np.array([-half, 0.0, 0.0]), np.array([half, 0.0, 0.0])
    into, out = np.array([c, s, 0.0]), np.array([c, -s, 0.0])
    w, arm = InWorld("double_cardan", 0.1 * p.shaft, summary="two universal joints"), 0.2 * p.shaft
    w.link("driver", revolute("driver_angle", into.tolist()), at=left, to=[left - p.shaft * into])
    pin, pin_2 = np.array([-s, c, 0.0]), np.array([s, c, 0.0])
    w.link("cross_1", revolute("cross_1_angle", pin.tolist()), at=left, to=[left + arm * pin, left - arm * pin], parent="driver")
    w.link("middle", revolute("middle_pin", "z"), at=left, to=[right], parent="cross_1")
    w.link("follower", revolute("follower_angle", out.tolist()), at=right, to=[right + p.shaft * out])
    w.link("cross_2", revolute("cross_2_angle", pin_2.tolist()), at=right, to=[right + arm * pin_2, right - arm * pin_2],
           parent="follower")
    w.close("pin", "cross_2", "middle", right, "revolute", (0, 0, 1))
    w.drive("driver_angle", stiffness=2.0, damping=0.01)
    return w.assemble({}, hold=["driver_angle"])


ENTRY = builder_entry(
    "double_cardan", "Double cardan joint", "coupling",
    summary="Two cardan joints with equal bends: the output turns exactly as the input.",
    use="Axles and drive lines at larger bends; constant velocity from two simple joints.", origin="Robert Hooke, 1683",
    parameters=Parameters, build=build, path=lambda p: {"driver_angle": (0.0, 2 * math.pi)}, sliders=("angle",),
    plots=(PlotRecipe("shafts", ("driver_angle_rate", "follower_angle_rate")),),
    outside=(
        Outside("follower against driver", "rad", lambda p: 0.0, lambda p, m: farthest(m["follower_angle"] - m["driver_angle"], 0.0),
                1e-8, "mirror symmetry about the middle shaft"),
        Outside("speed ratio, at its farthest from 1", "", lambda p: 1.0,
                lambda p, m: farthest(m["follower_angle_rate"] / m["driver_angle_rate"], 1.0), 1e-8, "mirror symmetry"),
    ),
    chain="R, 2 R, 2 R, R", formulas="tan(middle) = tan(driver) cos(angle) and back.",
    sources=("Seherr-Thoss, Schmelz, Aucktor, Universal Joints and Driveshafts",),
)  # fmt: skip
