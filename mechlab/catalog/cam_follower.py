"""A disc cam with a roller follower: rise, dwell, fall and dwell by one of the laws that cams are cut to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechlab.analytic.cams import LAWS, rise_and_fall
from mechlab.kit.palette import BLUE, BRASS, STEEL
from mechlab.kit.profiles import cam_curve
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, prismatic, revolute, shape

PEAKS = {"cycloidal": (2.0, 2 * math.pi, 0.25), "345": (1.875, 10 / math.sqrt(3), 0.5 - math.sqrt(3) / 6),
         "4567": (35 / 16, 84 / (5 * math.sqrt(5)), 0.5 - math.sqrt(5) / 10), "harmonic": (0.5 * math.pi, 0.5 * math.pi**2, 0.0)}
"""Largest s' and s'' of the law from 0 to 1, and where the latter is: s''' = 0 there, at the end for the harmonic law."""


@dataclass(frozen=True)
class Parameters:
    """The roller moves through the cam's axis."""

    law: str = parameter("cycloidal", "", "cycloidal, 345, 4567 or harmonic")
    lift: float = parameter(0.02, "m", "lift", low=0, strict=True)
    rise: float = parameter(2.0, "rad", "turn of the rise", low=0, strict=True)
    top: float = parameter(0.8, "rad", "turn of the dwell at the top", low=0)
    fall: float = parameter(2.0, "rad", "turn of the fall", low=0, strict=True)
    base: float = parameter(0.04, "m", "base circle", low=0, strict=True)
    roller: float = parameter(0.01, "m", "radius of the roller", low=0, strict=True)
    stiffness: float = parameter(2000.0, "N/m", "spring on the follower", low=0)


def build(p: Parameters) -> Mechanism:
    """Cam on the ground, its roller on +y; contact and profile are one curve. The spring is relaxed one lift below the bottom."""
    curve, up, at = cam_curve(p.law, p.lift, p.rise, p.top, p.fall), p.base + p.roller, 0.8 * p.roller
    cam = shape("disc_cam", color=BRASS, name="cam", base=p.base, lift=p.lift, rise=p.rise, top=p.top, fall=p.fall, law=LAWS.index(p.law),
                roller=p.roller, thickness=at, bore=0.2 * p.base)  # fmt: skip
    stem = Placement((0, 0.6 * up, at), (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0))
    b = Builder("cam_follower", gravity=(0, 0, 0), summary="disc cam with translating roller follower")
    b.body("cam", revolute("cam", "z"), inertia=Inertia.cylinder(2.0, p.base, at), shapes=[cam])
    b.body("follower", prismatic("lift", "y", stiffness=p.stiffness, spring_rest=-p.lift), at=(0, up, 0), inertia=Inertia.box(0.3, 0.02, 0.1, 0.02),
           shapes=[shape("disc", color=BLUE, name="roller", radius=p.roller, thickness=1.1 * at, bore=0.3 * p.roller),
                   shape("cylinder", stem, STEEL, "stem", radius=0.35 * p.roller, length=1.2 * up)])
    return b.curve("profile", "lift", "cam", curve).frame("F", "follower").drive("cam", stiffness=50.0, damping=0.5).build()


def closed(p: Parameters, given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The law of the lift, path time 1 s a turn."""
    s, v, a = rise_and_fall(p.law, given["cam"], p.lift, p.rise, p.top, p.fall)
    return {"lift": s, "lift_rate": 2 * math.pi * v, "lift_accel": (2 * math.pi) ** 2 * a}


ENTRY = builder_entry(
    "cam_follower", "Cam with roller follower", "dwell", summary="A disc cam lifts a roller by a law of motion: rise, dwell, fall, dwell.",
    use="Valve gear, packaging and textile machines.", origin="trip hammers of antiquity; laws of motion since about 1900",
    parameters=Parameters, build=build, path=lambda p: {"cam": (0.0, 2 * math.pi)}, closed=closed, sliders=("lift", "rise", "top", "fall"),
    through=lambda p: (p.rise * PEAKS[p.law][2] / (2 * math.pi), p.rise / (4 * math.pi)),
    plots=(PlotRecipe("lift", ("lift",)), PlotRecipe("rate", ("lift_rate",)), PlotRecipe("drive", ("cam_force",))),
    outside=(
        Outside("largest rate of the rise over lift per time of the rise", "", lambda p: PEAKS[p.law][0],
                lambda p, m: float(np.max(m["lift_rate"])) * p.rise / (2 * math.pi * p.lift), 1e-7, "s'(1/2): 2; 1.875; 2.1875; 1.5708"),
        Outside("largest acceleration of the rise over lift per squared time of the rise", "", lambda p: PEAKS[p.law][1],
                lambda p, m: float(np.max(m["lift_accel"][m["cam"] <= 0.5 * p.rise])) * (p.rise / (2 * math.pi)) ** 2 / p.lift, 1e-5,
                "s'' where s''' = 0: 2 pi; 5.7735; 7.5132; 4.9348"),
    ),
    chain="R + P, a curve", formulas="cycloidal s = h (u - sin(2 pi u) / 2 pi).",
    sources=("Norton, Cam Design and Manufacturing Handbook, chapter 2",),
)  # fmt: skip
