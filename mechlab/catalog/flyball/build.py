"""The governor as a Mechanism."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.catalog.flyball.parameters import Parameters
from mechlab.kit import palette
from mechlab.mechanism import Builder, Mechanism, Placement, Spring, prismatic, revolute, shape
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.inertia import Inertia


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """A tree: shaft, slider and two arms on it; the reference pose is that of the start."""
    b = Builder("flyball", gravity=(0.0, 0.0, -p.gravity), summary="flyball governor, benchmark A05")
    thick = max(p.section, 0.015 * p.shaft_length)
    rod = p.density * p.shaft_length * p.section**2
    half = 0.5 * p.shaft_length
    post = [
        shape("cylinder", Placement((0.0, 0.0, half)), palette.SLATE, "post", radius=0.6 * thick, length=p.shaft_length)
    ]
    post.append(
        shape(
            "box", Placement((0.0, 0.0, p.shaft_length)), palette.SLATE, "yoke", x=2 * p.pivot, y=2 * thick, z=2 * thick
        )
    )
    upright = Inertia.box(rod, p.section, p.section, p.shaft_length, (0.0, 0.0, half))
    b.body("shaft", revolute("shaft_angle", "z"), inertia=upright, shapes=post)
    cube = Inertia.box(p.slider_mass, p.slider_size, p.slider_size, p.slider_size)
    e = p.slider_size
    b.body(
        "slider",
        prismatic("slider_height", "z", zero=p.start_height),
        parent="shaft",
        at=(0.0, 0.0, p.start_height),
        inertia=cube,
        shapes=[shape("box", color=palette.TEAL, name="slider", x=e, y=e, z=e)],
    )
    lowered = _lowered(p.start_angle)
    for name, side in (("right", 1.0), ("left", -1.0)):
        bar = Inertia.box(p.arm_mass, p.arm_length, p.section, p.section, (0.5 * p.arm_length, 0.0, 0.0))
        ball = Inertia.point(p.ball_mass, (p.arm_length, 0.0, 0.0))
        looks = [
            shape(
                "box",
                Placement((0.5 * p.arm_length, 0.0, 0.0)),
                palette.BLUE,
                f"{name}_bar",
                x=p.arm_length,
                y=thick,
                z=thick,
            ),
            shape(
                "sphere",
                Placement((p.arm_length, 0.0, 0.0)),
                palette.ORANGE,
                f"{name}_ball",
                radius=0.07 * p.arm_length,
            ),
        ]
        turn = lowered if side > 0 else np.diag([-1.0, -1.0, 1.0]) @ lowered
        b.body(
            f"{name}_arm",
            revolute(f"{name}_angle", "y", zero=p.start_angle),
            parent="shaft",
            at=(side * p.pivot, 0.0, p.shaft_length),
            turned=Placement.of(turn, (0.0, 0.0, 0.0)),
            inertia=bar + ball,
            shapes=looks,
        )
        b.spring(
            Spring(
                f"{name}_spring",
                "slider",
                f"{name}_arm",
                (side * p.pivot, 0.0, 0.0),
                (0.5 * p.arm_length, 0.0, 0.0),
                p.spring_stiffness,
                p.damping,
                p.spring_length,
            )
        )
        b.frame(f"{name}_ball", f"{name}_arm", (p.arm_length, 0.0, 0.0))
    b.frame("S", "slider")
    return b.build()


def _lowered(angle: float) -> Array:
    """Rotation about y that lowers +x by `angle`."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
