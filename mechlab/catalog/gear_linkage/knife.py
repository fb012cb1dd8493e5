"""The knife drive of a three-knife cutter: parameters and Mechanism of two linkages on one main shaft, each with its knife."""

from __future__ import annotations

import math

from mechlab.analytic.gear_linkage import GearLinkage, Knife, angles, pin_angle
from mechlab.experiment.parameters import parameter
from mechlab.kit.palette import BLUE, BRASS, ORANGE, RED, STEEL, TEAL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, as_fraction, prismatic, revolute, shape
from mechlab.mechanism.parts import Color, Shape

SIDES = {"sides": 0.0, "front": 0.12}
"""Height [m] of the plane of each linkage: that of both side knives, which is in phase with the shaft, and that of the front knife."""


@dataclass(frozen=True)
class Knives:
    """Knives and main shaft, of this drive and of that with a clutch; the sizes are all ours: the source prints none."""

    lag: float = parameter(2.7, "rad", "crank of the front knife behind that of the side knives")
    throw: float = parameter(0.1, "m", "throw of the knives' cranks", low=0, strict=True)
    rod: float = parameter(0.35, "m", "connecting rods", low=0, strict=True)
    stack: float = parameter(0.12, "m", "height of the stack of paper", low=0, strict=True)
    cutting_force: float = parameter(5000.0, "N", "force on each knife in the stack", low=0)
    knife_mass: float = parameter(30.0, "kg", "each knife with its beam", low=0, strict=True)
    flywheel: float = parameter(50.0, "kg m2", "flywheel on the main shaft", low=0, strict=True)
    stall: float = parameter(3000.0, "N m", "stall torque of the motor", low=0)
    no_load: float = parameter(6.0, "rad/s", "no-load speed of the motor", low=0, strict=True)

    @property
    def knife(self) -> Knife:
        """One of the equal slider-cranks."""
        return Knife(self.throw, self.rod, self.stack)


@dataclass(frozen=True)
class Parameters(Knives):
    """The linkages besides; their sizes are ours too."""

    crank: float = parameter(0.1, "m", "eccentricity of the driving gears", low=0, strict=True)
    bar: float = parameter(0.4, "m", "coupler and rocker: the output turns once in a turn", low=0, strict=True)
    frame: float = parameter(0.4, "m", "main shaft to output shaft", low=0, strict=True)
    idler_radius: float = parameter(0.2, "m", "pitch radius of the idlers", low=0, strict=True)
    mount: float = parameter(2.83, "rad", "angle of the pins on the output gears: the cut falls into their slow part")

    @property
    def linkage(self) -> GearLinkage:
        """One of the equal linkages; raises for sizes that do not turn."""
        return GearLinkage(self.crank, self.bar, self.bar, self.idler_radius, self.frame)

    def behind(self, side: str) -> float:
        """Angle of a linkage's crank on the main shaft [rad]."""
        return -self.lag if side == "front" else 0.0


def _disc(color: Color, radius: float, name: str, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Shape:
    return shape("disc", Placement(at), color, name, radius=radius, thickness=0.02, bore=0.02)


def build(p: Parameters) -> Mechanism:
    """The main shaft, and on each side coupler, idler, rocker, output gear, rod and knife: 13 bodies, one freedom."""
    g, knife, start, wheel = p.linkage, p.knife, 1.0, Inertia.axial
    ra, rc, rd = (as_fraction(x, "knife_drive") for x in (p.bar - p.idler_radius, p.idler_radius, p.bar - p.idler_radius))
    turn, guess = rc / rd, {"shaft": start}
    b = Builder("knife_drive", gravity=(0.0, 0.0, 0.0), summary="two gear linkages drive the knives of a three-knife cutter")
    gears = [_disc(BRASS, float(ra), f"gear_{s}", (p.crank * math.cos(a), p.crank * math.sin(a), z))
             for s, z in SIDES.items() for a in (p.behind(s),)]  # fmt: skip
    b.body("shaft", revolute("shaft"), inertia=wheel(200.0, p.flywheel, 0.5 * p.flywheel), shapes=gears)
    for s, z in SIDES.items():
        phi = start + p.behind(s)
        psi, chi, _ = (float(x) for x in angles(g, phi))
        pin, out, set_at = float(pin_angle(g, phi, p.mount)), f"output_{s}", p.mount + p.behind(s)
        lean = -math.acos(-p.throw * math.cos(pin) / p.rod)
        seat, tip = (p.crank * math.cos(p.behind(s)), p.crank * math.sin(p.behind(s)), z), (p.bar, 0.0, 0.0)
        b.bar(f"coupler_{s}", revolute(f"coupler_{s}"), length=p.bar, mass=8.0, parent="shaft", at=seat, color=ORANGE)
        b.body(f"idler_{s}", revolute(f"idler_{s}"), parent=f"coupler_{s}", at=tip, inertia=wheel(4.0, 0.08, 0.04),
               shapes=[_disc(STEEL, float(rc), "idler")])  # fmt: skip
        b.bar(f"rocker_{s}", revolute(f"rocker_{s}"), length=p.bar, mass=8.0, at=(p.frame, 0.0, z), color=TEAL)
        b.body(out, revolute(out), at=(p.frame, 0.0, z), inertia=wheel(4.0, 0.08, 0.04), shapes=[_disc(RED, float(rd), "output")])
        b.bar(f"rod_{s}", revolute(f"rod_{s}"), length=p.rod, mass=6.0, parent=out,
              at=(p.throw * math.cos(set_at), p.throw * math.sin(set_at), 0.0), color=STEEL)  # fmt: skip
        b.body(f"knife_{s}", prismatic(f"knife_{s}", "y"), at=(p.frame, 0.0, z), inertia=Inertia.box(p.knife_mass, 0.4, 0.1, 0.02),
               shapes=[shape("box", Placement((0.0, -0.05, 0.0)), BLUE, "knife", x=0.4, y=0.1, z=0.02)])  # fmt: skip
        b.loop(f"joint_{s}", f"coupler_{s}", f"rocker_{s}", tip, tip).loop(f"hinge_{s}", f"rod_{s}", f"knife_{s}", (p.rod, 0.0, 0.0))
        b.relation(f"idler_mesh_{s}", **{f"idler_{s}": 1, f"coupler_{s}": -ra / rc})
        b.relation(f"output_mesh_{s}", **{out: 1, "shaft": turn, f"coupler_{s}": turn, f"idler_{s}": turn, f"rocker_{s}": -1 - turn})
        swing, place = psi - start, float(knife.place(pin)[0])
        guess |= {f"coupler_{s}": swing, f"idler_{s}": float(ra / rc) * swing, f"rocker_{s}": chi, out: pin - set_at,
                  f"rod_{s}": lean - pin + set_at, f"knife_{s}": place}  # fmt: skip
    return b.drive("shaft").assemble(guess, hold=["shaft"])
