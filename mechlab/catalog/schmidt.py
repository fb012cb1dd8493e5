"""The Schmidt coupling: three discs and parallel links join shafts with an offset that may change."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle, thirds
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Shafts along z; three links from disc to disc, one more than needed, so that no position is singular."""

    offset: float = parameter(0.04, "m", "offset of the shafts", low=0, strict=True)
    link: float = parameter(0.035, "m", "links, longer than half the offset", low=0, strict=True)
    radius: float = parameter(0.06, "m", "pins of the discs", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Driver at the origin, middle disc above the line of the shafts, follower at (offset, 0)."""
    w = InWorld("schmidt", 0.1 * p.radius, (0, 0, 0), "Schmidt coupling")
    centre = np.array([0.5 * p.offset, math.sqrt(p.link**2 - 0.25 * p.offset**2), 0.0])
    end, pins = np.array([p.offset, 0.0, 0.0]), circle(p.radius, thirds(0.4))
    w.link("driver", revolute("driver_angle", "z"), at=(0, 0, 0), to=pins)
    w.link("link_1", revolute("link_1_angle", "z"), at=pins[0], to=[centre + pins[0]], parent="driver")
    w.link("middle", revolute("middle_pin", "z"), at=centre + pins[0], to=[centre, centre + pins[1], centre + pins[2]], parent="link_1")
    w.link("follower", revolute("follower_angle", "z"), at=end, to=[end + q for q in pins])
    others = [("driver", pins[1], 1), ("driver", pins[2], 2), *(("follower", end + pins[k], k) for k in range(3))]
    for n, (disc, at, k) in enumerate(others, 2):
        to = centre + pins[k]
        w.link(f"link_{n}", revolute(f"link_{n}_angle", "z"), at=at, to=[to], parent=disc).close(f"pin_{n}", f"link_{n}", "middle", to)
    w.mark("M", "middle", centre).drive("driver_angle", stiffness=20.0, damping=0.2)
    return w.build()


ENTRY = builder_entry(
    "schmidt", "Schmidt coupling", "coupling", summary="Three discs with parallel links: equal turn of shafts with a large offset.",
    use="Rolling mills and printing rollers that shift while they run.", origin="Richard Schmidt, 1963", parameters=Parameters,
    build=build, path=lambda p: {"driver_angle": (0.0, 1.0)}, sliders=("offset", "link"),
    plots=(PlotRecipe("middle disc", ("M_x", "M_y")),),
    outside=(
        Outside("follower against driver", "rad", lambda p: 0.0, lambda p, m: farthest(m["follower_angle"] - m["driver_angle"], 0.0),
                1e-9, "parallelograms"),
        Outside("the middle disc stays where it is", "m", lambda p: 0.5 * p.offset, lambda p, m: farthest(m["M_x"], 0.5 * p.offset),
                1e-9, "links of equal length: isosceles triangle"),
    ),
    chain="R, 2 x 3 links, R", formulas="follower = driver.", sources=("Schmidt, US patent 3242694, 1966",),
)  # fmt: skip
