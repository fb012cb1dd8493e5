"""The centrifugal governor: two balls on a turning spindle lift a sleeve."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute, shape

G, THICK = 9.81, 0.05  # gravity [m/s2]; thickness of the rods over their length


@dataclass(frozen=True)
class Parameters:
    """Arms hang from a point of the spindle, links as long hold the sleeve; both are uniform rods of a tenth of a ball's mass."""

    arm: float = parameter(0.2, "m", "arms and links", low=0, strict=True)
    ball: float = parameter(1.0, "kg", "each ball", low=0, strict=True)
    sleeve: float = parameter(0.5, "kg", "sleeve: Watt's is light, Porter's heavy", low=0, strict=True)
    angle: float = parameter(0.7, "rad", "of the arms to the spindle", low=0.1, high=1.4)


def speed(p: Parameters) -> float:
    """Of equilibrium [rad/s]: spin^2 arm cos(angle) = g weight / inertia by virtual work; Huygens' pendulum, for a heavy sleeve Porter's.
    Depths ball 1, arm 1/2, link 3/2, sleeve 2 (for both sides) in arm cos(angle); moments of inertia ball 1, arm and link 1/3 -
    thickness^2 / 16 each in arm^2 sin(angle)^2."""
    weight, inertia = 1.2 * p.ball + p.sleeve, p.ball + 0.2 * p.ball * (1 / 3 - THICK**2 / 16)
    return math.sqrt(G * weight / (inertia * p.arm * math.cos(p.angle)))


def build(p: Parameters) -> Mechanism:
    """Spindle with sleeve, and to both sides an arm and a link."""
    out, down = p.arm * math.sin(p.angle) * np.array([1.0, 0.0, 0.0]), p.arm * math.cos(p.angle) * np.array([0.0, 0.0, -1.0])
    w, rods = InWorld("watt_governor", THICK * p.arm, (0, 0, -G), "centrifugal governor"), 0.1 * p.ball / p.arm
    w.link("spindle", revolute("spindle", "z"), at=(0, 0, 0), to=[-0.5 * down, 2.4 * down])
    collar, looks = Inertia.cylinder(p.sleeve, 0.1 * p.arm, 0.2 * p.arm), shape("cylinder", radius=0.1 * p.arm, length=0.2 * p.arm)
    w.link("sleeve", prismatic("sleeve", "z", zero=2 * float(down[2])), at=2 * down, parent="spindle", more=collar, shapes=[looks])
    for k, ball, axis in ((1, out + down, "-y"), (2, down - out, "y")):
        arm = revolute(f"arm_{k}", axis, zero=p.angle)
        w.link(f"arm_{k}", arm, at=(0, 0, 0), to=[ball], parent="spindle", mass_per_length=rods, ball=p.ball)
        w.link(f"link_{k}", revolute(f"link_{k}", axis), at=ball, to=[2 * down], parent=f"arm_{k}", mass_per_length=rods)
        w.close(f"pin_{k}", f"link_{k}", "sleeve", 2 * down, "revolute", (0, 1, 0))
    return w.drive("spindle", damping=0.1).drive("arm_1", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "watt_governor", "Centrifugal governor", "balance", summary="Two balls on a turning spindle: their height says the speed.",
    use="Speed control of steam engines, gramophones and old telescopes.", origin="Christiaan Huygens, 1673; James Watt, 1788",
    parameters=Parameters, build=build, path=lambda p: {"spindle": (0.0, speed(p)), "arm_1": (p.angle, p.angle)},
    closed=lambda p, given: {"sleeve": -2 * p.arm * np.cos(given["arm_1"]), "arm_2": given["arm_1"]},
    sliders=("sleeve", "angle"), plots=(PlotRecipe("sleeve", ("sleeve",)),),
    outside=(value_at("arm_1_steady", lambda p: 0.0, "equilibrium at the speed of Porter's formula, 1858",
                      text="torque that is missing on both arms at this speed", unit="N m"),
             value_at("sleeve", lambda p: -2 * p.arm * math.cos(p.angle), "two equal bars")),
    chain="R, 2 (R R) P", formulas="w^2 arm cos(angle) = g weight / inertia.", sources=("Maxwell, On governors, Proc. R. Soc. 16, 1868",),
)  # fmt: skip
