"""The leg as a Mechanism and, written down anew, as a tree of transition matrices.

The sagittal plane is x forwards, z up of the world (x, y of the planar tree); angles are counter-clockwise seen from the
leg's right side (-Y): hip flexion and knee extension are positive. In the reference pose the leg hangs straight down.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.parameters import HEEL, Body, Parameters, Segment, body
from mechlab.errors import unknown
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
    """The leg with the joints in `free`; the others are held at zero. The world's origin is the hip's first place."""
    b = _Leg(p, free)
    size, w = body(p), 0.06 * p.body_height
    slide = {"damping": p.slider_damping}
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
    b.part("carriage", host, (prismatic("hitch", "z", stiffness=p.C_hitch, **slide),), carriage, [block])
    upper, lower = size.thigh.halves
    long, short = size.thigh.length, size.shin.length
    b.part("thigh_socket", "carriage", (revolute("hip", TURN),), _bar(upper),
           [_tube(0.0, 0.55 * long, 0.7 * w, SOCKET)], turned=DOWN)  # fmt: skip
    b.part("thigh_tube", "thigh_socket", (prismatic("thigh", "x", stiffness=p.C_thigh, **slide),), _bar(lower),
           [_tube(0.5 * long, 0.5 * long, 0.3 * w, STEEL)])  # fmt: skip
    upper, lower = size.shin.halves
    b.part("shin_tube", "thigh_tube", (revolute("knee", TURN),), _bar(upper),
           [_tube(0.0, 0.55 * short, 0.45 * w, SOCKET)], at=long)  # fmt: skip
    b.part("pylon", "shin_tube", (prismatic("shin", "x", stiffness=p.C_shin, **slide),), _bar(lower),
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


def _foot(size: Body) -> Inertia:
    foot, com = size.foot, (size.foot_forward, 0.0, -size.foot_drop)
    return Inertia.axial(foot.mass, 0.1 * foot.inertia, foot.inertia, (1.0, 0.0, 0.0), com)


def _shoe(size: Body, w: float) -> Shape:
    place = Placement.of(np.eye(3), (size.foot_forward, 0.0, -0.75 * size.sole))
    return shape("box", place, SHOE, x=size.foot.length, y=0.8 * w, z=0.5 * size.sole)


def tree(p: Parameters, free: tuple[str, ...] = LEG) -> tm.Tree:
    """The same leg in planar transition matrices: x forwards, y up; thigh x down. Joints not in `free` are held at zero.

    Its coordinates are the joints in `free`, in the order trunk_x trunk_z trunk hitch hip thigh knee shin ankle.
    """
    b = body(p)
    thigh, shin = b.thigh.halves, b.shin.halves
    turn, up, along = tm.revolute(), tm.prismatic((0.0, 1.0)), tm.prismatic((1.0, 0.0))
    nothing, here, quarter = np.zeros((3, 3)), tm.placement((0.0, 0.0)), 0.5 * math.pi
    damping = p.slider_damping
    trunk = tm.planar_inertia(b.trunk.mass, (0.0, b.trunk.com), b.trunk.inertia)
    carriage = tm.planar_inertia(b.hitch_mass, (0.0, 0.0), b.hitch_inertia)
    foot = tm.planar_inertia(b.foot.mass, (b.foot_forward, -b.foot_drop), b.foot.inertia)
    bars = [tm.planar_inertia(s.mass, (s.com, 0.0), s.inertia) for s in (*thigh, *shin)]
    links = (
        tm.Link(-1, here, along, nothing),
        tm.Link(0, here, up, nothing),
        tm.Link(1, here, turn, trunk),
        tm.Link(2, here, up, carriage, p.C_hitch, 0.0, damping),
        tm.Link(3, tm.placement((0.0, 0.0), -quarter), turn, bars[0]),
        tm.Link(4, here, along, bars[1], p.C_thigh, 0.0, damping),
        tm.Link(5, tm.placement((b.thigh.length, 0.0)), turn, bars[2]),
        tm.Link(6, here, along, bars[3], p.C_shin, 0.0, damping),
        tm.Link(7, tm.placement((b.shin.length, 0.0), quarter), turn, foot, p.ankle_stiffness, 0.0, p.ankle_damping),
    )
    names = (*TRUNK, *LEG)
    return tm.Tree(links, (0.0, -p.gravity)).merged([k for k, n in enumerate(names) if n not in free])
