"""Platform of the delta, and the gears between the lower shafts and the central axis."""

from __future__ import annotations

import math

import numpy as np

from mechlab.catalog.delta6.looks.sizes import PLANET_LEVEL, SPUR_LEVEL, Shapes, at, columns, planet_sizes, spur_sizes
from mechlab.catalog.delta6.masses import vec
from mechlab.catalog.delta6.parameters import Delta6Parameters, Leg, legs
from mechlab.kit.palette import BLUE, BRASS, DARK, STEEL
from mechlab.mechanism import Placement, shape
from mechlab.shapes import external_phase


def platform(p: Delta6Parameters) -> Shapes:
    """Triangular plate above the gears, the central axis, the bosses of the plain rods."""
    z = p.platform_height - 0.006
    azimuths = {f"azimuth_{i + 1}": float(a) for i, a in enumerate(p.leg_azimuths)}
    out = [
        shape(
            "triangle_platform", at((0.0, 0.0, z)), BLUE, "plate", radius=p.platform_radius, height=0.008, **azimuths
        ),
        shape("cylinder", at((0.0, 0.0, 0.5 * z)), DARK, "axis", radius=0.005, length=z),
    ]
    for leg in legs(p):
        out.append(
            shape("link", at((leg.lower[0], leg.lower[1], z), columns(leg.tangent, np.cross([0, 0, 1.0], leg.tangent))), BLUE,
                  f"ear_{leg.index}", length=p.rod_spacing, width=0.018, thickness=0.008, bore=0.0045)
        )  # fmt: skip
    return tuple(out)


def shaft_placement(leg: Leg) -> Placement:
    """Where a lower shaft turns: at the lower cross, about the axis of its positive sense."""
    turned = np.diag([1.0, -1.0, -1.0]) if leg.index < 3 else np.eye(3)
    return at(vec(leg.lower), turned)


def spur(p: Delta6Parameters, i: int, in_shaft: bool = False) -> Shapes:
    """The gear on lower shaft i, a tooth towards the central axis; `in_shaft`: seen from `shaft_placement`."""
    a, _, module = spur_sizes(p, i)
    place = at((0.0, 0.0, SPUR_LEVEL[i - 1]))
    if in_shaft and i < 3:
        place = at((0.0, 0.0, -SPUR_LEVEL[i - 1]), np.diag([1.0, -1.0, -1.0]))
    azimuth = p.leg_azimuths[i - 1] + math.pi
    sizes = {"teeth": a, "module": module, "width": 0.007, "bore": 0.0045, "phase": azimuth}
    return (shape("spur_gear", place, BRASS, f"N{i}", **sizes),)


def idler_placement(p: Delta6Parameters) -> Placement:
    """The idler between the gear of shaft 3 and the gear of the carrier: halfway."""
    azimuth = p.leg_azimuths[2]
    level = p.platform_height + SPUR_LEVEL[2]
    return at((0.5 * p.platform_radius * math.cos(azimuth), 0.5 * p.platform_radius * math.sin(azimuth), level))


def idler(p: Delta6Parameters) -> Shapes:
    """Idler that gives shaft 3 and the carrier the same sense, 1:1. It has no mass and no coordinate of its own."""
    a, b, module = spur_sizes(p, 3)
    azimuth = p.leg_azimuths[2]
    phase = external_phase(b, azimuth, b, azimuth)
    return (
        shape("spur_gear", color=STEEL, name="idler", teeth=b, module=module, width=0.007, bore=0.004, phase=phase),
    )


def central(p: Delta6Parameters, i: int) -> Shapes:
    """The double gear Pr: one rim for the lower shaft, one for the planet."""
    a, b, module = spur_sizes(p, i)
    c, d, fine = planet_sizes(p)
    azimuth = p.leg_azimuths[i - 1]
    level = p.platform_height + SPUR_LEVEL[i - 1]
    side = 0.5 * math.pi if i == 1 else -0.5 * math.pi
    big = external_phase(a, azimuth + math.pi, b, azimuth + math.pi)
    height = level - PLANET_LEVEL[i - 1]
    return (
        shape(
            "spur_gear",
            at((0.0, 0.0, level)),
            STEEL,
            "outer_rim",
            teeth=b,
            module=module,
            width=0.006,
            bore=0.0075,
            phase=big,
            holes=6,
        ),
        shape(
            "spur_gear",
            at((0.0, 0.0, PLANET_LEVEL[i - 1])),
            STEEL,
            "inner_rim",
            teeth=c,
            module=fine,
            width=0.006,
            bore=0.0075,
            phase=side,
        ),
        shape(
            "tube",
            at((0.0, 0.0, PLANET_LEVEL[i - 1] + 0.5 * height)),
            STEEL,
            "sleeve",
            outer=0.0075 if i == 1 else 0.0095,
            inner=0.0055 if i == 1 else 0.0077,
            length=abs(height),
        ),
    )
