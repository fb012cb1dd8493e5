"""An adaptive (underactuated) finger: one drive, two phalanges that close around what they meet."""

from __future__ import annotations

from mechlab.kit.compass import at, meet
from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry, point_at, ratio
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Drive O-A and first phalanx O-K on one pivot, rod A-B, second phalanx K-B with its tip; two freedoms."""

    first: float = parameter(0.05, "m", "first phalanx O-K", low=0, strict=True)
    drive: float = parameter(0.03, "m", "driven arm O-A", low=0, strict=True)
    rod: float = parameter(0.036, "m", "rod A-B", low=0, strict=True)
    lug: float = parameter(0.018, "m", "lug K-B of the second phalanx", low=0, strict=True)
    tip: float = parameter(0.04, "m", "second phalanx K-tip", low=0, strict=True)
    gravity: float = parameter(0.0, "m/s2", "the plane lies flat")


def linkage(p: Parameters) -> Linkage:
    """Two inputs, RRR at the lug, the tip."""
    return (
        Linkage("adaptive_gripper").pivot("O", 0.0, 0.0)
        .crank("drive", "O", "A", p.drive).crank("first", "O", "K", p.first)
        .rrr("B", ("rod", "second"), ("A", "K"), (p.rod, p.lug), -1).point("tip", "second", p.tip, 1.8)
    )  # fmt: skip


DRIVE, FIRST = (0.2, 1.1), (1.4, 1.7)  # angles [rad] at both ends of the path


def tip(p: Parameters) -> complex:
    """Tip at the end, by compasses."""
    a, k = at(p.drive, DRIVE[1]), at(p.first, FIRST[1])
    return k + (meet(a, p.rod, k, p.lug, -1) - k) / p.lug * at(p.tip, 1.8)


def share(p: Parameters) -> float:
    """Seen from the first phalanx, drive and second one are arms of a four-bar, rates as O-I to K-I, I where the rod meets O-K."""
    a, k = at(p.drive, 0.5 * sum(DRIVE)), at(p.first, 0.5 * sum(FIRST))
    way = meet(a, p.rod, k, p.lug, -1) - a
    along = (a.conjugate() * way).imag / (k.conjugate() * way).imag
    return along / (along - 1.0)


ENTRY = planar_entry(
    "adaptive_gripper", "Adaptive finger", "gripper", summary="Two phalanges, one drive: the finger wraps around what it meets.",
    use="Robot hands and prostheses that grasp without sensing.", origin="Shigeo Hirose's soft gripper, 1978; Laliberte, Gosselin, 1998",
    parameters=Parameters, linkage=linkage, path=lambda p: {"drive_angle": DRIVE, "first_angle": FIRST},
    width=lambda p: 0.1 * p.first, links=("second",), points=("tip",), sliders=("rod", "lug"), servo=(2.0, 0.02),
    plots=(PlotRecipe("phalanges", ("first_angle", "second_angle")),),
    outside=(
        Outside("rate of the second phalanx over that of the drive, both against the first, in the middle", "", share,
                lambda p, m: ratio(m, "second_angle", "drive_angle", less="first_angle"), 1e-9, "Aronhold, Kennedy"),
        *point_at("tip", tip, "ruler and compasses")),
    chain="R, R + RRR", formulas="Dyad RRR; Kennedy's theorem.", sources=("Birglen et al., Underactuated Robotic Hands, 2008",),
)  # fmt: skip
