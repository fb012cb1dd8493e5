"""The usual knife drive that the source sets its linkages against: a clutch turns both slider-cranks once and lets them rest. Parameters
and Mechanism: a main shaft with motor and flywheel, a crankshaft on the same axis, two rods, two knives; two freedoms."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mechlab.analytic.gear_linkage import crank_inertia
from mechlab.catalog.gear_linkage.knife import SIDES, Knives
from mechlab.experiment.held_rates import HeldRates, RateHold
from mechlab.experiment.laws import Law
from mechlab.experiment.parameters import parameter
from mechlab.kit.palette import BLUE, BRASS, ORANGE, STEEL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, prismatic, revolute, shape

ROD_MASS = 6.0
"""Mass of a connecting rod [kg]."""


@dataclass(frozen=True)
class Parameters(Knives):
    """The crankshaft and its clutch besides; their sizes are ours too."""

    crankshaft: float = parameter(0.5, "kg m2", "crankshaft with the driven half of the clutch", low=0, strict=True)
    clutch: float = parameter(1000.0, "N m", "friction torque of the clutch", low=0, strict=True)
    brake: float = parameter(1000.0, "N m", "friction torque of the brake that stops the crankshaft after its turn", low=0, strict=True)

    def pin(self, side: str) -> float:
        """Angle of a knife's pin on the crankshaft [rad]: that of the side knives is up where the crankshaft rests."""
        return 0.5 * math.pi - (self.lag if side == "front" else 0.0)


def clutch_law(p: Parameters, others: Sequence[Law], time: float) -> HeldRates:
    """The closed clutch, dry friction between both shafts, with the other laws of the scene; time: that of the capture [s]."""
    return HeldRates((RateHold((("crank", 1.0), ("shaft", -1.0)), 0.0, -p.clutch, p.clutch),), tuple(others), time)


def brake_law(p: Parameters, others: Sequence[Law], time: float) -> HeldRates:
    """The open clutch, and the brake on the crankshaft, with the other laws of the scene; time: that of the capture [s]."""
    return HeldRates((RateHold("crank", 0.0, -p.brake, p.brake),), tuple(others), time)


def inertia(p: Parameters) -> float:
    """Inertia of the resting crankshaft with rods and knives [kg m2]."""
    return crank_inertia(p.knife, [p.pin("sides"), p.pin("front")], p.crankshaft, p.knife_mass, ROD_MASS)


def build(p: Parameters) -> Mechanism:
    """The main shaft and the crankshaft, and on each side rod and knife: 6 bodies, two freedoms."""
    b = Builder("knife_clutch", gravity=(0.0, 0.0, 0.0), summary="a clutch turns the knives of a three-knife cutter once")
    wheel = shape("disc", Placement((0.0, 0.0, -0.05)), BRASS, "flywheel", radius=2.5 * p.throw, thickness=0.04, bore=0.02)
    webs = [shape("disc", Placement((0.0, 0.0, z - 0.015)), ORANGE, f"crank {s}", radius=1.25 * p.throw, thickness=0.015, bore=0.02)
            for s, z in SIDES.items()]  # fmt: skip
    b.body("shaft", revolute("shaft"), inertia=Inertia.axial(200.0, p.flywheel, 0.5 * p.flywheel), shapes=[wheel])
    b.body("crank", revolute("crank"), inertia=Inertia.axial(10.0, p.crankshaft, 0.5 * p.crankshaft), shapes=webs)
    guess = {"shaft": 0.0, "crank": 0.0}
    for s, z in SIDES.items():
        pin = p.pin(s)
        place = float(p.knife.place(pin)[0])
        lean = -math.acos(-p.throw * math.cos(pin) / p.rod)
        b.bar(f"rod_{s}", revolute(f"rod_{s}"), length=p.rod, mass=ROD_MASS, parent="crank",
              at=(p.throw * math.cos(pin), p.throw * math.sin(pin), z), color=STEEL)  # fmt: skip
        b.body(f"knife_{s}", prismatic(f"knife_{s}", "y"), at=(0.0, 0.0, z), inertia=Inertia.box(p.knife_mass, 0.4, 0.1, 0.02),
               shapes=[shape("box", Placement((0.0, -0.05, 0.0)), BLUE, "knife", x=0.4, y=0.1, z=0.02)])  # fmt: skip
        b.loop(f"hinge_{s}", f"rod_{s}", f"knife_{s}", (p.rod, 0.0, 0.0))
        guess |= {f"rod_{s}": lean, f"knife_{s}": place}
    return b.drive("shaft").drive("crank").assemble(guess, hold=["shaft", "crank"])
