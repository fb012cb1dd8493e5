"""The Tracta joint: two forks and two sliding blocks that turn both shafts alike."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, alike, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, prismatic, revolute


@dataclass(frozen=True)
class Parameters:
    """Both forks stand at the same distance from the crossing of the shafts."""

    angle: float = parameter(0.6, "rad", "angle between the shafts", low=0, high=1.2, strict=True)
    fork: float = parameter(0.03, "m", "fork pins from the crossing", low=0, strict=True)
    shaft: float = parameter(0.12, "m", "length of the shafts", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """Shafts in the plane x-y, bent alike against x; both fork pins along z; the tongue slides and turns in the groove, its normal y."""
    c, s = math.cos(0.5 * p.angle), math.sin(0.5 * p.angle)
    into, out, z = np.array([c, s, 0.0]), np.array([c, -s, 0.0]), np.array([0.0, 0.0, 0.6 * p.fork])
    left, right = -p.fork * into, p.fork * out
    w = InWorld("tracta", 0.2 * p.fork, (0, 0, 0), "Tracta joint")
    w.link("driver", revolute("driver_angle", into.tolist()), at=left, to=[-p.shaft * into, left + z, left - z])
    w.link("groove", revolute("fork_1", "-z", zero=0.5 * p.angle), at=left, to=[(0, 0, 0)], parent="driver")
    slides = prismatic("slide_a", "x"), prismatic("slide_b", "z"), revolute("tongue", "-y")
    w.link("tongue", *slides, at=(0, 0, 0), to=[right], parent="groove")
    w.link("follower", revolute("follower_angle", out.tolist()), at=right, to=[p.shaft * out, right + z, right - z])
    w.close("fork_2", "tongue", "follower", right, "revolute", (0, 0, 1)).drive("driver_angle", stiffness=2.0, damping=0.01)
    return w.build()


def closed(p: Parameters, given: Motion) -> Motion:
    """The normal n of the sliding faces is at right angles to both fork pins and, both pins at one distance, to x: n = x times pin.
    With pin 1 = cos t z + sin t y', n = cos(a/2) s + sin(a/2) cos t into, s at right angles to pin and shaft: tan(fork) = tan(a/2) cos t.
    Reflection in the plane across x takes pin 1 to pin 2, so both shafts turn alike; cos of the pins' angle = 1 - 2 sin2 t sin2(a/2)."""
    t, h = given["driver_angle"], 0.5 * p.angle
    return {"follower_angle": t, "fork_1": np.arctan(math.tan(h) * np.cos(t)), "tongue": 2 * np.arcsin(np.sin(t) * math.sin(h))}


ENTRY = builder_entry(
    "tracta", "Tracta joint", "coupling", summary="Fork, groove, tongue, fork: constant velocity from flat sliding faces alone.",
    use="Front wheel drive of the first cars that had it, jeeps and lorries.",
    origin="Pierre Fenaille and Jean-Albert Gregoire, 1926", parameters=Parameters, build=build, closed=closed, sliders=("angle",),
    path=lambda p: {"driver_angle": (0.0, 2 * math.pi)}, plots=(PlotRecipe("blocks", ("fork_1", "tongue")),),
    outside=(
        alike("follower_angle", "driver_angle", "mirror symmetry, Hunt 1973"),
        value_at("tongue", lambda p: p.angle, "pins at their largest angle: that of the shafts", 6, unit="rad"),
        value_at("fork_1", lambda p: -0.5 * p.angle, "half a turn on, tan(fork) = tan(angle / 2) cos t", 12, unit="rad"),
    ),
    chain="R R E R R", formulas="tan(fork) = tan(angle / 2) cos t.",
    sources=("Hunt, Constant-velocity shaft couplings: a general theory, J. Eng. Ind. 95, 1973",),
)  # fmt: skip
