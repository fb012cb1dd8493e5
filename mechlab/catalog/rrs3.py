"""The 3-RRS platform: three legs in three planes lift and tilt a platform."""

from __future__ import annotations

import cmath
from collections.abc import Mapping

from mechlab.kit.compass import meet
from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import circle, crank, platform, thirds
from mechlab.kit.short import PlotRecipe, builder_entry, each, ends, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Each leg bends outwards in its own upright plane."""

    base: float = parameter(0.15, "m", "radius of the base hinges", low=0, strict=True)
    platform: float = parameter(0.12, "m", "radius of the balls", low=0, strict=True)
    lower: float = parameter(0.1, "m", "lower links", low=0, strict=True)
    upper: float = parameter(0.15, "m", "upper links", low=0, strict=True)
    height: float = parameter(0.18, "m", "height at rest", low=0, strict=True)


def lower(p: Parameters, radius: float, height: float) -> complex:
    """Lower link in the plane of its leg (outwards, up) for a ball at this radius and height, by compasses."""
    return meet(complex(p.base, 0.0), p.lower, complex(radius, height), p.upper, -1) - p.base


def build(p: Parameters) -> Mechanism:
    """Legs R R, balls on the platform; the platform keeps six joints, three of them are taken away by the legs."""
    w, up, link = InWorld("rrs3", 0.01, summary="3-RRS platform"), [0.0, 0.0, p.height], lower(p, p.platform, p.height)
    platform(w, "platform", up, tops := [q + up for q in circle(p.platform, thirds())], 0.8)
    for k, (out, top) in enumerate(zip(circle(1.0, thirds()), tops, strict=True), 1):
        bend = (p.base + link.real) * out + [0, 0, link.imag]
        crank(w, f"lower_{k}", f"lower_{k}_angle", p.base * out, out, cmath.phase(link), bend)
        w.link(f"upper_{k}", revolute(f"knee_{k}", (out[1], -out[0], 0.0)), at=bend, to=[top], parent=f"lower_{k}")
        w.close(f"ball_{k}", f"upper_{k}", "platform", top)
    return w.build()


def closed(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """The platform pitched about y: it shifts along x by -platform (1 - cos) / 2 so that the balls 2 and 3 stay in their planes."""
    ball, height = cmath.rect(p.platform, given["platform_pitch"]), p.height + given["platform_z"]
    shift = 0.5 * (ball.real - p.platform)
    return {"platform_x": shift, DRIVES[0]: cmath.phase(lower(p, ball.real + shift, height - ball.imag))}


DRIVES = ("lower_1_angle", "lower_2_angle", "lower_3_angle")
PATH = {"platform_z": (0.0, 0.03), "platform_roll": (0.0, 0.0), "platform_pitch": (0.0, 0.2)}
ENTRY = builder_entry(
    "rrs3", "3-RRS platform", "parallel-robot",
    summary="Three legs with a hinge, a knee and a ball: lift and two tilts, with a small parasitic shift.",
    use="Ball balancing tables, tilting heads.", origin="Kenneth Hunt, 1983", parameters=Parameters, build=build, drives=DRIVES,
    sliders=("height", "lower"), plots=(PlotRecipe("drives", DRIVES),), path=lambda p: PATH, closed=each(closed),
    outside=(*ends(closed, PATH, DRIVES[:1], "compasses, Carretero 2000"), *ends(closed, PATH, ("platform_x",), "Carretero 2000", "m")),
    chain="3 R R S", formulas="x = -r (1 - cos tilt) / 2.", sources=("Carretero, Podhorodeski, Nahon, Gosselin, J. Mech. Des. 122, 2000",),
)  # fmt: skip
