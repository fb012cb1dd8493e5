"""What the transmission looks like. The source prints no drawing to scale: radii follow the inertias and the offset h."""

from __future__ import annotations

import math

from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.kit.palette import BLUE, BRASS, DARK, RED, STEEL
from mechlab.mechanism import Placement, shape
from mechlab.mechanism.geometry import axis_rotation
from mechlab.mechanism.parts import Shape

X = (1.0, 0.0, 0.0)


def orbit(p: Parameters) -> float:
    """Radius of the planet axes [m]."""
    return p.a + p.b


def _planet_radius(p: Parameters) -> float:
    """As large as the neighbours allow."""
    room = orbit(p) * (math.sin(math.pi / p.planets) if p.planets > 1 else 1.0)
    return 0.9 * min(room, 0.7 * orbit(p))


def turn_of(p: Parameters, k: int) -> Placement:
    """Planet k turned so that its mass centre lies outwards at psi = 0."""
    return Placement.of(axis_rotation((0.0, 0.0, 1.0), 2.0 * math.pi * k / p.planets), (0.0, 0.0, 0.0))


def planet_placement(p: Parameters, k: int) -> Placement:
    """Axis of planet k on the carrier."""
    angle = 2.0 * math.pi * k / p.planets
    at = (orbit(p) * math.cos(angle), orbit(p) * math.sin(angle), 0.0)
    return Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), at)


def planet(p: Parameters) -> tuple[Shape, ...]:
    """A planet wheel with its eccentric weight, drawn inside the wheel."""
    r, w = _planet_radius(p), 0.25 * orbit(p)
    off = min(p.h, 0.55 * r)
    return (
        shape("disc", color=STEEL, name="planet", radius=r, thickness=w, bore=0.12 * r),
        shape("cylinder", Placement((off, 0.0, 0.0)), BRASS, "weight", radius=0.32 * r, length=1.5 * w),
    )


def carrier(p: Parameters) -> tuple[Shape, ...]:
    """Hub and one arm and pin for each planet, behind the planets."""
    k, w = orbit(p), 0.25 * orbit(p)
    out = [shape("disc", Placement((0.0, 0.0, -w)), RED, "hub", radius=0.25 * k, thickness=0.4 * w)]
    for i in range(p.planets):
        angle = 2.0 * math.pi * i / p.planets
        arm = Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), (0.0, 0.0, -w))
        size = {"length": k, "width": 0.2 * k, "thickness": 0.4 * w, "bore": 0.04 * k}
        out.append(shape("link", arm, RED, f"arm_{i + 1}", **size))
        at = (k * math.cos(angle), k * math.sin(angle), -0.3 * w)
        out.append(shape("cylinder", Placement(at), DARK, f"pin_{i + 1}", radius=0.04 * k, length=2.2 * w))
    return tuple(out)


def input_shaft(p: Parameters) -> tuple[Shape, ...]:
    """The driving shaft, behind, with a flywheel and a mark that shows its turn."""
    return _shaft(p, -1.0, BLUE, "input")


def output_shaft(p: Parameters) -> tuple[Shape, ...]:
    """The driven shaft (reactor), in front."""
    return _shaft(p, 1.0, BRASS, "output")


def _shaft(p: Parameters, side: float, color: tuple[float, float, float, float], name: str) -> tuple[Shape, ...]:
    k = orbit(p)
    return (
        shape(
            "disc",
            Placement((0.0, 0.0, 0.6 * side * k)),
            color,
            name,
            radius=0.5 * k,
            thickness=0.15 * k,
            bore=0.05 * k,
        ),
        shape("cylinder", Placement((0.0, 0.0, 0.9 * side * k)), color, "shaft", radius=0.12 * k, length=0.9 * k),
        shape("box", Placement((0.36 * k, 0.0, 0.68 * side * k)), DARK, "mark", x=0.2 * k, y=0.05 * k, z=0.04 * k),
    )


def frame(p: Parameters) -> tuple[Shape, ...]:
    """A bearing around each shaft."""
    k = orbit(p)
    return tuple(
        shape("tube", Placement((0.0, 0.0, z)), DARK, name, outer=0.22 * k, inner=0.14 * k, length=0.15 * k)
        for z, name in ((-1.2 * k, "bearing_1"), (1.2 * k, "bearing_2"))
    )
