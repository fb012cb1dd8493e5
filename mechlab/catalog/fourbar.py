"""The planar four-bar: the tutorial entry. Copy this file to add a mechanism of your own.

Ground pivots A = (0, 0) and D = (ground, 0); crank pin B, joint C of coupler and rocker. The plane stands upright: x to
the right, y of the closed form is z of the world. Angles are counted from the ground line, counter-clockwise as seen
from the front (from -Y).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from mechlab.analytic import fourbar as closed_form
from mechlab.analytic.benchmarks.planar import FourbarCrank
from mechlab.experiment.entry import Entry, PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.kit.crank_entry import Crank, CrankPose
from mechlab.kit.crank_limits import gap_check, limits_check, remark, start_angle
from mechlab.kit.palette import BLUE, ORANGE, SLATE, TEAL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import axis_rotation


@dataclass(frozen=True)
class Parameters:
    """Lengths, mass, gravity and assembly mode of a four-bar."""

    crank: float = parameter(0.1, "m", "crank A-B", low=0, strict=True)
    coupler: float = parameter(0.3, "m", "coupler B-C", low=0, strict=True)
    rocker: float = parameter(0.25, "m", "rocker D-C", low=0, strict=True)
    ground: float = parameter(0.3, "m", "ground A-D", low=0, strict=True)
    mode: int = parameter(1, "", "+1: C left of the vector from B to D, -1: right", low=-1, high=1)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(2 * math.pi, "rad/s", "crank speed of the scenes", scene=True)
    torque: float = parameter(0.2, "N m", "crank torque of the scene constant-torque", scene=True)

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Crank, coupler, rocker, ground."""
        return self.crank, self.coupler, self.rocker, self.ground

    def radius(self, length: float) -> float:
        """Radius of a round bar of this length [m]; it is drawn four times as wide."""
        return 0.25 * (0.03 * max(self.lengths) + 0.05 * length)


def pose(p: Parameters, angle: Any, rate: Any = 0.0, accel: Any = 0.0) -> CrankPose:
    """Closed form: the motion of every joint and shaft, and the transmission angle at C, from that of the crank."""
    f = closed_form.solve(*p.lengths, angle, rate, accel, mode=p.mode)
    crank, coupler = (angle, rate, accel), (f.coupler_angle, f.coupler_rate, f.coupler_accel)
    joint = (coupler[0] - angle, coupler[1] - rate, coupler[2] - accel)
    rocker = (f.rocker_angle, f.rocker_rate, f.rocker_accel)
    values = {"crank_angle": crank, "coupler_joint": joint, "rocker_angle": rocker, "coupler_angle": coupler}
    return CrankPose(values, {"transmission_angle": f.transmission_angle}, f.assembles, f.gap, f.regular)


def ends(p: Parameters, found: CrankPose) -> dict[str, tuple[complex, complex]]:
    """Place and velocity of the pivots, the pins and the middle of the coupler, as x + i y."""
    (phi, w, _), (psi, swing, _) = found.values["crank_angle"], found.values["rocker_angle"]
    b, arm = cmath.rect(p.crank, phi), cmath.rect(p.rocker, psi)
    c, b_rate, c_rate = p.ground + arm, 1j * w * b, 1j * swing * arm
    middle = ((b + c) / 2, (b_rate + c_rate) / 2)
    return {"A": (0j, 0j), "B": (b, b_rate), "C": (c, c_rate), "D": (p.ground + 0j, 0j), "middle": middle}


def own(p: Parameters) -> Callable[[float, float, float], float]:
    """Equation of the one freedom (Eksergian); moment of a round bar about its middle: m (L^2 / 12 + r^2 / 4)."""
    crank, coupler, rocker = (p.mass_per_length * x * (x**2 / 12.0 + p.radius(x) ** 2 / 4.0) for x in p.lengths[:3])
    return FourbarCrank(*p.lengths, p.mode, p.mass_per_length, p.gravity, (crank, coupler, rocker)).acceleration


def bars(p: Parameters) -> list[tuple[str, str, float, float]]:
    """Each bar: the names of its two end points, mass [kg], radius [m]."""
    spans = (("A", "B", p.crank), ("B", "C", p.coupler), ("D", "C", p.rocker))
    return [(a, b, p.mass_per_length * length, p.radius(length)) for a, b, length in spans]


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Three bars and one loop: 3 coordinates, 3 rows (one of them void), one freedom."""
    b = Builder("fourbar", gravity=(0.0, 0.0, -p.gravity), summary="planar four-bar linkage")
    layer = 0.045 * max(p.lengths)
    for name, joint, parent, x, length, color, lift in (
        ("crank", "crank_angle", "ground", 0.0, p.crank, BLUE, 0.0),
        ("coupler", "coupler_joint", "crank", p.crank, p.coupler, ORANGE, layer),
        ("rocker", "rocker_angle", "ground", p.ground, p.rocker, TEAL, 0.0),
    ):
        b.bar(name, revolute(joint, "-y"), length, parent=parent, at=(x, 0.0, 0.0), mass=p.mass_per_length * length,
              width=4.0 * p.radius(length), color=color, layer=lift)  # fmt: skip
    b.loop("pin", "coupler", "rocker", (p.coupler, 0.0, 0.0), (p.rocker, 0.0, 0.0))
    b.shaft("coupler_angle", {"crank_angle": 1, "coupler_joint": 1})
    b.frame("B", "crank", (p.crank, 0.0, 0.0)).frame("C", "rocker", (p.rocker, 0.0, 0.0))
    b.frame("middle", "coupler", (0.5 * p.coupler, 0.0, 0.0))
    b.drive("crank_angle", stiffness=200.0, damping=2.0)
    turned = axis_rotation((1.0, 0.0, 0.0), math.pi / 2)
    for x in (0.0, p.ground):
        b.ground(shape("bracket", Placement.of(turned, (x, 0.9 * layer, 0.0)), SLATE,
                       height=0.6 * p.crank + 0.1 * p.ground, width=1.1 * layer, thickness=0.6 * layer))  # fmt: skip
    at = {n: float(x) for n, (x, *_) in pose(p, start_angle(p.lengths)).values.items() if n != "coupler_angle"}
    return b.assemble(at, hold=["crank_angle"])


CRANK = Crank(
    build, pose, ("coupler_angle", "rocker_angle"), own, ends, bars, start=lambda p: start_angle(p.lengths),
    ranges=lambda p: closed_form.crank_limits(*p.lengths).ranges,
)  # fmt: skip
TEXT = "angles, rates and accelerations of coupler and rocker from those of the crank"
QUESTION = CRANK.question(TEXT, more=("transmission_angle",))
SCENES = CRANK.scenes("speed", "torque", stiffness=200.0, damping=2.0)

ENTRY = Entry(
    name="fourbar",
    title="Four-bar linkage",
    family="linkage",
    summary="Planar four-bar: crank, coupler, rocker; both assembly modes.",
    parameters=Parameters,
    build=build,
    fidelities={"kinematic": "closed form", "minimal": "three bars, one loop; exact dynamics"},
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="driven-crank",
    sliders=("crank", "coupler"),
    plots=(
        PlotRecipe("crank and rocker", ("crank_angle", "rocker_angle")),
        PlotRecipe("speed of the rocker", ("rocker_angle_rate",)),
        PlotRecipe("speed ratio, rocker to crank", ("rocker_angle_rate",), over="crank_angle_rate"),
    ),
    questions=(QUESTION,),
    checks=(
        CRANK.pose_check("F1", QUESTION, "closed form of the RRR dyad"),
        CRANK.run_check("F2", SCENES["free-run"].make, lambda p: p.speed, "Eksergian equation, DOP853"),
        limits_check("F3", lambda p: p.lengths),
        gap_check("F4", lambda p: p.lengths, lambda p: p.mode),
        CRANK.mass_check("F5"),
    ),
    reference=CRANK.reference,
    remarks=lambda p: (remark(p.lengths),),
    chain="RRRR",
    formulas="Dyad RRR: C = D + rocker (cos, sin)(rocker_angle), on the side `mode` of B to D; rates from the loop equation.",
    sources=("Freudenstein 1955", "Eksergian 1930"),
)  # fmt: skip
