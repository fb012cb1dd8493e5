"""A disc cam with a roller follower: rise, dwell, fall and dwell by one of the laws that cams are cut to."""

from __future__ import annotations

from typing import Any

from mechlab.analytic.cams import LAWS, PEAKS, rise_and_fall
from mechlab.kit.palette import BLUE, BRASS, STEEL
from mechlab.kit.profiles import TURN, cam_curve, in_a_second
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, prismatic, revolute, shape


@dataclass(frozen=True)
class Parameters:
    """The roller moves through the cam's axis; its spring is relaxed one lift below the bottom."""

    law: str = parameter("cycloidal", "", "cycloidal, poly345, poly4567 or harmonic")
    lift: float = parameter(0.02, "m", "lift", low=0, strict=True)
    rise: float = parameter(2.0, "rad", "turn of the rise", low=0, strict=True)
    top: float = parameter(0.8, "rad", "turn of the dwell at the top", low=0)
    fall: float = parameter(2.0, "rad", "turn of the fall", low=0, strict=True)
    base: float = parameter(0.04, "m", "base circle", low=0, strict=True)
    roller: float = parameter(0.01, "m", "radius of the roller", low=0, strict=True)
    stiffness: float = parameter(2000.0, "N/m", "spring on the follower", low=0)

    def __post_init__(self) -> None:
        cam_curve(self.law, self.lift, self.rise, self.top, self.fall)  # refuses an unknown law, or parts longer than a turn


def build(p: Parameters) -> Mechanism:
    """Cam on the ground, its roller on +y; contact and profile are one curve."""
    curve, up, t = cam_curve(p.law, p.lift, p.rise, p.top, p.fall), p.base + p.roller, 0.8 * p.roller
    size: dict[str, Any] = {n: getattr(p, n) for n in ("base", "lift", "rise", "top", "fall", "roller")}
    cam = shape("disc_cam", color=BRASS, name="cam", law=LAWS.index(p.law), thickness=t, bore=0.2 * p.base, **size)
    roller = shape("disc", color=BLUE, name="roller", radius=p.roller, thickness=1.1 * t, bore=0.3 * p.roller)
    stem = shape("box", Placement((0, 0.6 * up, t)), STEEL, "stem", x=0.7 * p.roller, y=1.2 * up, z=0.7 * p.roller)
    b = Builder("cam_follower", gravity=(0, 0, 0), summary="disc cam with translating roller follower")
    b.body("cam", revolute("cam", "z"), inertia=Inertia.cylinder(2.0, p.base, t), shapes=[cam])
    joint = prismatic("lift", "y", stiffness=p.stiffness, spring_rest=-p.lift)
    b.body("follower", joint, at=(0, up, 0), inertia=Inertia.box(0.3, 0.02, 0.1, 0.02), shapes=[roller, stem])
    return b.curve("profile", "lift", "cam", curve).frame("F", "follower").drive("cam", stiffness=50.0, damping=0.5).build()


ENTRY = builder_entry(
    "cam_follower", "Cam with roller follower", "dwell", summary="A disc cam lifts a roller by a law of motion: rise, dwell, fall, dwell.",
    use="Valve gear, packaging and textile machines.", origin="trip hammers of antiquity", parameters=Parameters, build=build,
    path=lambda p: {"cam": (0.0, TURN)}, sliders=("lift", "rise", "top", "fall"),
    closed=lambda p, given: in_a_second("lift", rise_and_fall(p.law, given["cam"], p.lift, p.rise, p.top, p.fall)),
    through=lambda p: (p.rise * PEAKS[p.law][2] / TURN, 0.5 * p.rise / TURN), plots=(PlotRecipe("lift", ("lift",)),),
    outside=(
        Outside("largest rate of the rise over lift per time of the rise", "", lambda p: PEAKS[p.law][0],
                lambda p, m: float(m["lift_rate"].max()) * p.rise / (TURN * p.lift), 1e-7, "s'(1/2): 2; 15/8; 35/16; pi/2"),
        Outside("largest acceleration of the rise over lift per squared time of the rise", "", lambda p: PEAKS[p.law][1],
                lambda p, m: float(m["lift_accel"][m["cam"] <= 0.5 * p.rise].max()) * (p.rise / TURN) ** 2 / p.lift, 1e-5,
                "s'' where s''' = 0: 2 pi; 10/sqrt(3) = 5.7735; 7.5132; pi^2/2"),
    ),
    chain="R + P, a curve", formulas="s = h s(u).", sources=("Norton, Cam Design and Manufacturing Handbook, chapter 2",),
)  # fmt: skip
