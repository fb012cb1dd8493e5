"""The Thompson coupling: two cardan joints within each other, their common pin held in the plane of symmetry."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, alike, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """All axes go through one point; the bend may change while it runs."""

    first: float = parameter(0.2, "rad", "bend at the start", low=0, high=1.2, strict=True)
    last: float = parameter(0.7, "rad", "bend at the end", low=0, high=1.2, strict=True)
    shaft: float = parameter(0.12, "m", "length of the shafts", low=0, strict=True)


TILT = 0.5
"""Of the plane of the shafts, about the driver [rad]."""


def build(p: Parameters) -> Mechanism:
    """Driver along x, the follower's housing swings about z. The control yoke, a spherical pantograph, stands as the relation that it
    makes: its ring turns about the bisector. The common pin of both crosses lies in the ring. The plane of the shafts leans by TILT:
    of the three rows that MuJoCo has for a point, in world axes, that along a pin says nothing where all turns about one centre, and
    where a pin came to lie in a world axis nothing but rounding was left of it, with a force without limit."""
    h, half, r, o = p.first, 0.5 * p.first, 0.25 * p.shaft, np.zeros(3)
    x, y, z = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(TILT), math.sin(TILT)], [0.0, -math.sin(TILT), math.cos(TILT)]])
    out, middle, pin = (math.cos(a) * x + math.sin(a) * y for a in (h, half, half + 0.5 * math.pi))
    w = InWorld("thompson", 0.06 * p.shaft, (0, 0, 0), "Thompson coupling")
    w.link("driver", revolute("driver_angle", "x"), at=o, to=[(-p.shaft, 0, 0), 1.2 * r * z, -1.2 * r * z])
    w.link("housing", revolute("bend", z.tolist(), zero=h), at=o, to=[1.3 * p.shaft * out])
    w.link("follower", revolute("follower_angle", out.tolist()), at=o, to=[p.shaft * out, 0.9 * r * z, -0.9 * r * z], parent="housing")
    w.link("yoke", revolute("yoke_angle", z.tolist(), zero=half), at=o, to=[0.5 * r * middle]).relation("pantograph", bend=1, yoke_angle=-2)
    w.link("ring", revolute("ring_angle", middle.tolist()), at=o, to=[1.4 * r * pin, -1.4 * r * pin], parent="yoke")
    for name, parent, size in (("cross_1", "driver", 1.2 * r), ("cross_2", "follower", 0.9 * r)):
        w.link(name, revolute(f"{name}_angle", z.tolist()), at=o, to=[size * z, -size * z, size * pin, -size * pin], parent=parent)
        w.close(f"pin_{name}", name, "ring", o, "revolute", pin)
    return w.drive("driver_angle", stiffness=2.0, damping=0.01).drive("bend", stiffness=2.0, damping=0.01).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """Driver and ring are the shafts of a cardan joint of half the bend, the pin on the ring: tan(ring) = tan(driver) cos(bend / 2);
    the follower is the mirror image of the driver."""
    t, c = given["driver_angle"], np.cos(0.5 * given["bend"])
    return {"follower_angle": t, "ring_angle": np.arctan2(c * np.sin(t), np.cos(t)), "yoke_angle": 0.5 * given["bend"]}


ENTRY = builder_entry(
    "thompson", "Thompson coupling", "coupling",
    summary="Two cardan joints with one centre and a pin held on the bisector: constant velocity while the bend changes.",
    use="Drive lines of vehicles and pumps without sliding balls.", origin="Glenn Thompson, about 2000", parameters=Parameters, build=build,
    path=lambda p: {"driver_angle": (0.0, 2 * math.pi), "bend": (p.first, p.last)}, closed=closed, sliders=("first", "last"),
    plots=(PlotRecipe("shafts", ("driver_angle_rate", "ring_angle_rate", "follower_angle_rate")),),
    outside=(
        alike("follower_angle", "driver_angle", "mirror symmetry at any bend, Hunt 1973"),
        value_at("ring_angle", lambda p: math.atan(math.cos(0.5 * (0.875 * p.first + 0.125 * p.last))), "Hooke's joint", 3, unit="rad"),
    ),
    chain="R, 2 (R R), ring", formulas="tan(ring) = tan(driver) cos(bend / 2).", sources=("Thompson, US patent 7144326, 2006",),
)  # fmt: skip
