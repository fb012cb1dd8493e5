"""The Oldham coupling: two parallel shafts with an offset, a cross block that slides on both."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.palette import GOLD
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute, shape


@dataclass(frozen=True)
class Parameters:
    """Shafts along z, the second one `offset` to the right; the block slides along x on the first, along y on the second."""

    offset: float = parameter(0.01, "m", "offset of the shafts", low=0, strict=True)
    radius: float = parameter(0.04, "m", "hubs", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Hub, block, hub; the second slide closes the loop."""
    r = p.radius
    hub = Inertia.cylinder(0.3, r, 0.5 * r)
    disc = shape("disc", color=GOLD, name="disc", radius=r, thickness=0.2 * r)
    w = InWorld("oldham", 0.15 * r, summary="Oldham coupling")
    w.link("driver", revolute("driver_angle", "z"), at=(0, 0, -0.3 * r), to=[(-r, 0, -0.3 * r), (r, 0, -0.3 * r)], more=hub)
    w.link("block", prismatic("slide", "x", zero=p.offset), at=(p.offset, 0, 0), parent="driver", more=Inertia.cylinder(0.1, r, 0.2 * r),
           shapes=[disc])
    e = p.offset
    w.link("follower", revolute("follower_angle", "z"), at=(e, 0, 0.3 * r), to=[(e, -r, 0.3 * r), (e, r, 0.3 * r)], more=hub)
    w.close("cross_slide", "block", "follower", (e, 0, 0), "prismatic", (0, 1, 0))
    w.mark("block_centre", "block", (e, 0, 0)).drive("driver_angle", stiffness=20.0, damping=0.2)
    return w.build()


ENTRY = builder_entry(
    "oldham", "Oldham coupling", "coupling", summary="Parallel shafts with an offset, a block with crossed slides: equal speeds.",
    use="Couples shafts that are out of line.", origin="John Oldham, 1821", parameters=Parameters, build=build,
    path=lambda p: {"driver_angle": (0.0, 2 * math.pi)}, sliders=("offset",), plots=(PlotRecipe("slide", ("slide",)),),
    outside=(
        Outside("follower against driver", "rad", lambda p: 0.0, lambda p, m: farthest(m["follower_angle"] - m["driver_angle"], 0.0),
                1e-9, "the slides stay at right angles"),
        # both slides pass through their shafts at right angles: the middle of the block lies on the circle over the offset (Thales)
        Outside("distance of the block from the middle between the shafts", "m", lambda p: 0.5 * p.offset,
                lambda p, m: farthest(np.hypot(m["block_centre_x"] - 0.5 * p.offset, m["block_centre_y"]), 0.5 * p.offset), 1e-9,
                "Thales' theorem"),
    ),
    chain="R P P R", formulas="slide = offset cos(angle).", sources=("Reuleaux, Theoretische Kinematik, 1875",),
)  # fmt: skip
