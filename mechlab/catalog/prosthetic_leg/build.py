"""The leg: parameters, segments by anthropometric fractions, the Mechanism, and its scenes: a swing, a drop.

The sagittal plane is x forwards, z up of the world (x, y of the planar tree); angles are counter-clockwise seen from the
leg's right side (-Y): hip flexion and knee extension are positive. In the reference pose the leg hangs straight down.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Law, Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.parameters import parameter
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.floor import Floor
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import (
    GROUND,
    IDENTITY,
    Builder,
    Inertia,
    Joint,
    Mechanism,
    Placement,
    Shape,
    prismatic,
    revolute,
    shape,
)
from mechlab.mechanism.geometry import axis_rotation

CHOSEN = "ours; the source prints no numbers"


@dataclass(frozen=True)
class Parameters:
    """Body, springs of the slides, ankle."""

    body_mass: float = parameter(75.0, "kg", "mass of the person", low=0, strict=True, source=CHOSEN)
    body_height: float = parameter(1.75, "m", "height of the person", low=0.5, source=CHOSEN)
    C_hitch: float = parameter(2e4, "N/m", "spring of the hip hitch", low=0, source=CHOSEN)
    C_thigh: float = parameter(2e5, "N/m", "spring between the halves of the thigh", low=0, source=CHOSEN)
    C_shin: float = parameter(1.5e5, "N/m", "spring between the halves of the shin", low=0, source=CHOSEN)
    slider_damping: float = parameter(30.0, "N s/m", "damper of each of the three slides", low=0, source=CHOSEN)
    ankle_stiffness: float = parameter(20.0, "N m/rad", "spring of the ankle", low=0, source=CHOSEN)
    ankle_damping: float = parameter(0.5, "N m s/rad", "damper of the ankle", low=0, source=CHOSEN)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    stance_stiffness: float = parameter(
        0.0, "N/m", "stiffness of the straight leg from hip to ankle; 0: as the springs give it, else they are scaled to it", low=0,
        source=CHOSEN,
    )

    @property
    def fitted_springs(self) -> tuple[float, float, float]:
        """Stiffness of the springs of hitch, thigh and shin [N/m], scaled alike where `stance_stiffness` is stated: in series they have it.

        Raises MechlabError where one of them is 0: no scale then gives a stiffness.
        """
        springs = (self.C_hitch, self.C_thigh, self.C_shin)
        if self.stance_stiffness == 0.0:
            return springs
        if min(springs) <= 0.0:
            raise MechlabError("prosthetic_leg: stance_stiffness scales C_hitch, C_thigh and C_shin; expected all three above 0.")
        scale = self.stance_stiffness * sum(1.0 / c for c in springs)
        return springs[0] * scale, springs[1] * scale, springs[2] * scale


@dataclass(frozen=True)
class Segment:
    """A segment as a bar: length [m], mass [kg], centre of mass from its upper end [m], inertia about it [kg m2]."""

    length: float
    mass: float
    com: float
    inertia: float

    @property
    def halves(self) -> tuple[Segment, Segment]:
        """Two parts of half the mass at com -+ length/4 that together have the mass, centre and inertia of the segment.

        Raises MechlabError when the inertia is too small for that (gyration below length/4).
        """
        rest = 0.5 * (self.inertia - self.mass * (0.25 * self.length) ** 2)
        if rest <= 0.0:
            raise MechlabError("the segment cannot be split: its radius of gyration is below a quarter of its length")
        first, second = (Segment(self.length, 0.5 * self.mass, self.com + x * self.length, rest) for x in (-0.25, 0.25))
        return first, second


@dataclass(frozen=True)
class LegBody:
    """Segments of the leg. The foot's centre of mass stands `foot_forward` [m] in front of the
    ankle and `foot_drop` [m] below it; the ankle stands `sole` [m] above the floor."""

    trunk: Segment
    thigh: Segment
    shin: Segment
    foot: Segment
    foot_forward: float
    foot_drop: float
    sole: float
    hitch_mass: float = 1.0
    hitch_inertia: float = 0.002


HEEL = 0.05
"""Distance of the heel behind the ankle [m]."""


def body(p: Parameters) -> LegBody:
    """Masses and centres by Winter's fractions: thigh .100/.433/.323, leg .0465/.433/.302, foot .0145/.500/.475, trunk
    (head, arms, trunk) .678/-/.496 with its centre .374 of its length above the hip; lengths .245, .246, .152, .288 of
    the height, the ankle .039 above the sole.
    """
    mass, height = p.body_mass, p.body_height

    def part(length: float, share: float, com: float, gyration: float) -> Segment:
        long = length * height
        return Segment(long, share * mass, com * long, share * mass * (gyration * long) ** 2)

    foot = part(0.152, 0.0145, 0.5, 0.475)
    return LegBody(
        trunk=part(0.288, 0.678, 0.374, 0.496),
        thigh=part(0.245, 0.100, 0.433, 0.323),
        shin=part(0.246, 0.0465, 0.433, 0.302),
        foot=foot,
        foot_forward=0.5 * foot.length - HEEL,
        foot_drop=0.0195 * height,
        sole=0.039 * height,
    )


TRUNK = ("trunk_x", "trunk_z", "trunk")
LEG = ("hitch", "hip", "thigh", "knee", "shin", "ankle")
FREE = {"minimal": ("hitch", "hip", "knee", "ankle"), "parts": LEG, "full": (*TRUNK, *LEG)}
"""Fidelity -> its joints."""

TURN = "-y"
DOWN = Placement.of(axis_rotation((0.0, -1.0, 0.0), -0.5 * math.pi), (0.0, 0.0, 0.0))
BACK = Placement.of(axis_rotation((0.0, -1.0, 0.0), 0.5 * math.pi), (0.0, 0.0, 0.0))
ALONG_X = axis_rotation((0.0, 1.0, 0.0), 0.5 * math.pi)
STEEL, SOCKET = (0.62, 0.66, 0.71, 1.0), (0.16, 0.42, 0.75, 1.0)
SHOE, CLOTH = (0.90, 0.55, 0.13, 1.0), (0.45, 0.50, 0.56, 1.0)


def hip_height(p: Parameters) -> float:
    """Height of the hip above the floor when the foot of the straight leg just touches it [m]."""
    b = body(p)
    return b.thigh.length + b.shin.length + b.sole


def build(p: Parameters, fidelity: str) -> Mechanism:
    """The leg at a fidelity: an open tree of 4 freedoms (rigid thigh and shin), 6 (both split by slides), or 9 (the
    trunk moves too)."""
    if fidelity not in FREE:
        raise unknown("prosthetic_leg: fidelity", fidelity, FREE)
    return mechanism(p, FREE[fidelity])


@lru_cache(maxsize=64)
def mechanism(p: Parameters, free: tuple[str, ...]) -> Mechanism:
    """The leg with the joints in `free`; the others are held at zero. World origin: the hip in the reference pose."""
    b = _Leg(p, free)
    size, w = body(p), 0.06 * p.body_height
    slide = {"damping": p.slider_damping}
    c_hitch, c_thigh, c_shin = p.fitted_springs
    trunk = size.trunk
    torso = shape("rod", Placement.of(np.eye(3), (0.0, 1.7 * w, 0.05)), CLOTH, length=trunk.length, radius=0.9 * w)
    if set(free) & set(TRUNK):
        joints = (prismatic("trunk_x", "x"), prismatic("trunk_z", "z"), revolute("trunk", TURN))
        whole = Inertia.axial(trunk.mass, 0.3 * trunk.inertia, trunk.inertia, (0.0, 0.0, 1.0), (0.0, 0.0, trunk.com))
        b.part("torso", GROUND, joints, whole, [torso])
    else:
        b.ground(torso)
    carriage = Inertia.axial(size.hitch_mass, size.hitch_inertia, size.hitch_inertia, (1.0, 0.0, 0.0))
    block = shape("box", IDENTITY, STEEL, x=0.8 * w, y=0.5 * w, z=0.8 * w)
    host = "torso" if set(free) & set(TRUNK) else GROUND
    b.part("carriage", host, (prismatic("hitch", "z", stiffness=c_hitch, **slide),), carriage, [block])
    upper, lower = size.thigh.halves
    long, short = size.thigh.length, size.shin.length
    b.part("thigh_socket", "carriage", (revolute("hip", TURN),), _bar(upper),
           [_tube(0.0, 0.55 * long, 0.7 * w, SOCKET)], turned=DOWN)  # fmt: skip
    b.part("thigh_tube", "thigh_socket", (prismatic("thigh", "x", stiffness=c_thigh, **slide),), _bar(lower),
           [_tube(0.5 * long, 0.5 * long, 0.3 * w, STEEL)])  # fmt: skip
    upper, lower = size.shin.halves
    b.part("shin_tube", "thigh_tube", (revolute("knee", TURN),), _bar(upper),
           [_tube(0.0, 0.55 * short, 0.45 * w, SOCKET)], at=long)  # fmt: skip
    b.part("pylon", "shin_tube", (prismatic("shin", "x", stiffness=c_shin, **slide),), _bar(lower),
           [_tube(0.5 * short, 0.5 * short, 0.25 * w, STEEL)])  # fmt: skip
    ankle = revolute("ankle", TURN, stiffness=p.ankle_stiffness, damping=p.ankle_damping)
    b.part("foot", "pylon", (ankle,), _foot(size), [_shoe(size, w)], at=short, turned=BACK)
    b.frame("heel", "foot", (-HEEL, 0.0, -size.sole)).frame("toe", "foot", (size.foot.length - HEEL, 0.0, -size.sole))
    b.frame("ankle_point", "pylon", (short, 0.0, 0.0)).frame("knee_point", "thigh_tube", (long, 0.0, 0.0))
    return b.build()


class _Leg(Builder):
    """A Builder of parts along x whose joints are made only when they are free."""

    def __init__(self, p: Parameters, free: tuple[str, ...]) -> None:
        super().__init__("prosthetic_leg", gravity=(0.0, 0.0, -p.gravity), summary="above-knee prosthesis with slides")
        self.free = free

    def part(
        self,
        name: str,
        parent: str,
        joints: tuple[Joint, ...],
        inertia: Inertia,
        shapes: list[Shape],
        at: float = 0.0,
        turned: Placement = IDENTITY,
    ) -> None:
        """A body at `at` along its parent's x, with those of its joints that are free."""
        free = [j for j in joints if j.name in self.free]
        self.body(name, *free, parent=parent, at=(at, 0.0, 0.0), turned=turned, inertia=inertia, shapes=shapes)


def _tube(start: float, length: float, radius: float, color: tuple[float, float, float, float]) -> Shape:
    return shape("rod", Placement.of(ALONG_X, (start, 0.0, 0.0)), color, length=length, radius=radius)


def _bar(s: Segment) -> Inertia:
    """A bar along x; in the plane only its moment across matters."""
    return Inertia.axial(s.mass, 0.1 * s.inertia, s.inertia, (1.0, 0.0, 0.0), (s.com, 0.0, 0.0))


def _foot(size: LegBody) -> Inertia:
    foot, com = size.foot, (size.foot_forward, 0.0, -size.foot_drop)
    return Inertia.axial(foot.mass, 0.1 * foot.inertia, foot.inertia, (1.0, 0.0, 0.0), com)


def _shoe(size: LegBody, w: float) -> Shape:
    place = Placement.of(np.eye(3), (size.foot_forward, 0.0, -0.75 * size.sole))
    return shape("box", place, SHOE, x=size.foot.length, y=0.8 * w, z=0.5 * size.sole)


SWING_TIME = 0.45
SWING_START = {"hip": math.radians(-20.0), "knee": math.radians(-50.0)}
SWING_RATES = {"hip": 3.0, "knee": -4.0}
DROP = 0.02
"""Height of the drop [m]."""

FLOOR_STIFFNESS, FLOOR_DAMPING = 1.5e5, 600.0


def _swing(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "swing", fidelity, SWING_TIME, (), dict(SWING_START), dict(SWING_RATES), tolerance=1e-6,
        settings=Settings(integrator="RK4", timestep=1e-3), text="the leg swings through under its own weight",
    )  # fmt: skip


HELD = {"trunk_x": (1e5, 2e3), "trunk": (5e4, 5e2), "hip": (5e3, 50.0), "knee": (5e3, 50.0)}
"""Stiffness and damping of the rails of the trunk and of the locks of hip and knee."""


def standing(p: Parameters, fidelity: str, floor: float) -> tuple[Law, ...]:
    """Rails hold the trunk upright, hip and knee are locked by stiff springs; the foot meets a floor at this height [m]."""
    held = [Servo(n, Hold(0.0), kp, kd) for n, (kp, kd) in HELD.items() if n in FREE[fidelity]]
    return (*held, Floor(("heel", "toe"), FREE[fidelity], floor, FLOOR_STIFFNESS, FLOOR_DAMPING))


def _stance(p: Parameters, fidelity: str) -> Scene:
    """The straight leg just touches the floor, and the body is let down on it."""
    return Scene(
        "stance", fidelity, 1.5, standing(p, fidelity, -hip_height(p)), tolerance=5e-4,
        settings=Settings(integrator="RK4", timestep=2.5e-4), text="the body is let down on the straight leg, which touches the floor",
    )  # fmt: skip


def _drop(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "stance-drop", fidelity, 0.6, standing(p, fidelity, -hip_height(p) - DROP), tolerance=5e-4,
        settings=Settings(integrator="RK4", timestep=1.25e-4), text="the leg falls 20 mm onto the floor with the body on it",
    )  # fmt: skip


SCENES = {
    "swing": SceneRecipe(_swing, "parts", "the swing of the leg, trunk fixed: 0.45 s from hip -20 deg, knee -50 deg"),
    "stance": SceneRecipe(_stance, "full", "the body let down on the straight leg; stance_stiffness fits the springs"),
    "stance-drop": SceneRecipe(_drop, "full", "a drop of 20 mm onto the straight leg, with the body on rails"),
}
