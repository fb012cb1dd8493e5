"""Ackermann steering: a trapezium turns the two wheels of a car by different angles."""

from __future__ import annotations

import math

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Seen from above, to the front is +y: kingpins O and D, steering arms to the rear and inward, tie rod A-B."""

    track: float = parameter(1.3, "m", "distance of the kingpins", low=0, strict=True)
    base: float = parameter(2.6, "m", "wheel base; the arms point at the middle of the rear axle", low=0, strict=True)
    arm: float = parameter(0.18, "m", "steering arms", low=0, strict=True)
    lock: float = parameter(0.6, "rad", "lock of the inner wheel", low=0, high=0.9, strict=True)
    gravity: float = parameter(0.0, "m/s2", "the plane lies flat")


def straight(p: Parameters) -> float:
    """Angle of the left arm straight ahead: it points at the middle of the rear axle."""
    return -math.atan2(p.base, 0.5 * p.track)


def linkage(p: Parameters) -> Linkage:
    """Driver and RRR."""
    rod = p.track - 2 * p.arm * math.cos(straight(p))
    return (
        Linkage("ackermann").pivot("O", 0.0, 0.0).pivot("D", p.track, 0.0)
        .crank("left", "O", "A", p.arm)
        .rrr("B", ("tie_rod", "right"), ("A", "D"), (rod, p.arm), -1)
    )  # fmt: skip


def outer(p: Parameters) -> float:
    """Angle of the outer wheel at full lock of the inner one (left), from the vector loop: closed by the law of cosines."""
    a = complex(p.arm * math.cos(straight(p) + p.lock), p.arm * math.sin(straight(p) + p.lock))
    way, rod = complex(p.track, 0) - a, p.track - 2 * p.arm * math.cos(straight(p))
    at_d = math.acos((abs(way) ** 2 + p.arm**2 - rod**2) / (2 * abs(way) * p.arm))
    return math.atan2(-way.imag, -way.real) + at_d - (-math.pi - straight(p))


ENTRY = planar_entry(
    "ackermann", "Ackermann steering trapezium", "steering",
    summary="Two steering arms and a tie rod: the inner wheel turns more than the outer one.",
    use="Front axles: nearly no scrub of the tyres in a curve.", origin="Georg Lankensperger, 1817; Rudolph Ackermann's patent, 1818",
    parameters=Parameters, linkage=linkage, path=lambda p: {"left_angle": (straight(p), straight(p) + p.lock)},
    width=lambda p: 0.15 * p.arm, links=("tie_rod", "right"), points=("A", "B"), sliders=("arm", "base"),
    plots=(PlotRecipe("wheels", ("left_angle", "right_angle")),),
    outside=(
        Outside("angle of the outer wheel at full lock", "rad", outer, lambda p, m: float(m["right_angle"][-1] - m["right_angle"][0]),
                1e-9, "law of cosines at D"),
        # near straight ahead both arms turn alike: the trapezium is symmetric
        Outside("ratio of the wheel rates straight ahead", "", lambda p: 1.0,
                lambda p, m: float(m["right_angle_rate"][0] / m["left_angle_rate"][0]), 1e-9, "symmetry"),
    ),
    chain="R + RRR", formulas="Dyad RRR.", sources=("Norton, Design of Machinery, problem 3-x; Jazar, Vehicle Dynamics, chapter 7",),
)  # fmt: skip
