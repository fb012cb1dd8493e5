"""What the parts of the delta look like. Shapes carry no mass; tooth counts are for the eye, the nearest whole numbers."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.catalog.delta6.masses import PLANET_OFFSET, vec
from mechlab.catalog.delta6.parameters import Delta6Parameters, Leg, legs
from mechlab.kit.palette import BLUE, BRASS, DARK, ORANGE, PALE, RED, STEEL, TEAL
from mechlab.mechanism import Placement, Shape, shape
from mechlab.mechanism.geometry import Array, axis_rotation, frame_along
from mechlab.shapes import external_phase

Shapes = tuple[Shape, ...]

FLOOR = -0.17
"""Height of the base plate below the home head centre [m]."""
GUIDE_ARM = 0.05
"""How far the guide columns stand outside the shaft axis [m]."""
SPUR_LEVEL = (-0.014, -0.024, -0.034)
"""Heights of the three lower gears below the lower crosses [m]."""
PLANET_LEVEL = (0.017, 0.024)
"""Heights of the planets above the head centre [m]."""
BEVEL_PITCH, BEVEL_TEETH = 0.012, 18
"""Pitch radius [m] and teeth of the bevels Nz and of the outer bevels Pz."""
OUTER_PITCH = 0.017
"""Pitch radius of the inner bevels Pz [m]."""
ALONG_X = np.column_stack([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Rotation that puts the z axis of a shape along X."""


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, rotation: Array | None = None) -> Placement:
    """A placement; not turned by default."""
    return Placement.of(np.eye(3) if rotation is None else rotation, (x, y, z))


def columns(x: Array, y: Array) -> Array:
    """Rotation whose first two columns are the orthonormal x and y."""
    return np.column_stack([x, y, np.cross(x, y)])


def ground(p: Delta6Parameters) -> Shapes:
    """Base plate, three pairs of guide columns, top ring."""
    top = p.slider_max - p.slider_height + 0.09
    reach = abs(p.platform_radius + p.radial_offset) + GUIDE_ARM
    base = shape("disc", at(z=FLOOR - 0.008), PALE, "base", radius=reach + 0.04, thickness=0.016, bore=0.1)
    ring = shape("ring", at(z=top), PALE, "top", outer=reach + 0.016, inner=reach - 0.016, thickness=0.012)
    guides = []
    for leg in legs(p):
        foot = leg.upper + GUIDE_ARM * leg.radial
        place = at(foot[0], foot[1], FLOOR, columns(leg.tangent, -leg.radial))
        size = {"length": top - FLOOR, "radius": 0.008, "spacing": 0.06}
        guides.append(shape("guide", place, STEEL, f"guide_{leg.index}", **size))
    return (base, ring, *guides)


def slider(p: Delta6Parameters, leg: Leg) -> Shapes:
    """Carriage on the two columns, with the arm and the motor over the shaft, and the post of the plain rod."""
    frame, z = columns(leg.tangent, -leg.radial), p.slider_height
    x, y, _ = leg.radial * GUIDE_ARM
    side_x, side_y, _ = p.rod_spacing * leg.tangent
    carriage = {"x": 0.1, "y": 0.034, "length": 0.07, "bore": 0.0085, "holes": 2, "spacing": 0.06}
    bar = {"x": p.rod_spacing + 0.02, "y": 0.014, "z": 0.014}
    return (
        shape("slider", at(x, y, z, frame), BLUE, "carriage", **carriage),
        shape("box", at(x * 0.45, y * 0.45, z, frame), BLUE, "arm", x=0.04, y=0.05, z=0.03),
        shape("cylinder", at(z=z + 0.035), DARK, "motor", radius=0.019, length=0.045, chamfer=0.003),
        shape("box", at(0.5 * side_x, 0.5 * side_y, z, frame), BLUE, "bar", **bar),
        shape("cylinder", at(side_x, side_y, 0.5 * z), BLUE, "post", radius=0.005, length=z),
    )


def _along(leg: Leg) -> Array:
    return frame_along(leg.span / np.linalg.norm(leg.span))


def rods(p: Delta6Parameters, leg: Leg) -> Shapes:
    """Both rods of a leg, for the fidelities in which they are one body."""
    beside = at(*vec(p.rod_spacing * leg.tangent), _along(leg))
    return (
        shape("rod", at(rotation=_along(leg)), ORANGE, "rod", length=p.rod_length, radius=0.006),
        shape("rod", beside, STEEL, "plain", length=p.rod_length, radius=0.005),
    )


def cardan_rod(p: Delta6Parameters, leg: Leg) -> Shapes:
    """The shaft between its two forks; the fork pins lie along fork_b."""
    u = leg.span / np.linalg.norm(leg.span)
    upper = columns(leg.fork_b, np.cross(-u, leg.fork_b))
    lower = columns(leg.fork_b, np.cross(u, leg.fork_b))
    middle = at(*vec(0.5 * leg.span), _along(leg))
    return (
        shape("cylinder", middle, ORANGE, "shaft", radius=0.006, length=p.rod_length - 0.05),
        shape("fork", at(rotation=upper), ORANGE, "upper_fork", span=0.02, pin=0.003),
        shape("fork", at(*vec(leg.span), lower), ORANGE, "lower_fork", span=0.02, pin=0.003),
    )


def plain_rod(p: Delta6Parameters, leg: Leg) -> Shapes:
    """The plain rod with its two balls."""
    return (
        shape("rod", at(rotation=_along(leg)), STEEL, "rod", length=p.rod_length, radius=0.0045),
        shape("sphere", at(), DARK, "upper_ball", radius=0.008),
        shape("sphere", at(*leg.span), DARK, "lower_ball", radius=0.008),
    )


def stub(p: Delta6Parameters, leg: Leg, upper: bool) -> Shapes:
    """Shaft stub with its fork; the pin holes lie along fork_a."""
    up = np.array([0.0, 0.0, 1.0 if upper else -1.0])
    frame = columns(leg.fork_a, np.cross(-up, leg.fork_a))
    long = p.slider_height if upper else 0.045
    return (
        shape("fork", at(rotation=frame), TEAL, "fork", span=0.02, pin=0.003),
        shape("cylinder", at(*(0.5 * (0.016 + long) * up)), TEAL, "stub", radius=0.0045, length=long - 0.016),
    )


def cross(leg: Leg) -> Shapes:
    """The cross with its four pins."""
    return (shape("cross", at(rotation=columns(leg.fork_a, leg.fork_b)), DARK, "cross", span=0.022, radius=0.0028),)


@lru_cache(maxsize=256)
def teeth(ratio: float, low: int = 60, high: int = 140) -> tuple[int, int]:
    """Whole numbers (a, b), a + b within limits, with b / a nearest to `ratio`."""
    numbers = ((a, round(a * ratio)) for a in range(12, high))
    pairs = [(a, b) for a, b in numbers if low <= a + b <= high and b >= 12]
    if not pairs:
        return (40, 40)
    return min(pairs, key=lambda ab: (round(abs(ab[1] / ab[0] - ratio), 6), ab[0]))


def spur_sizes(p: Delta6Parameters, i: int) -> tuple[int, int, float]:
    """Teeth of lower gear and central gear, and module, for the centre distance `platform_radius`."""
    a, b = teeth(float(p.k_spur)) if i < 3 else (24, 24)
    return a, b, 2.0 * p.platform_radius / (a + b) if i < 3 else 2.0 * p.platform_radius / (a + b + 48)


def planet_sizes(p: Delta6Parameters) -> tuple[int, int, float]:
    """Teeth of the inner rim and of the planet, and their module."""
    c, d = teeth(float(p.k_transfer / p.k_spur))
    return c, d, 2.0 * PLANET_OFFSET / (c + d)


def platform(p: Delta6Parameters) -> Shapes:
    """Triangular plate above the gears, the central axis, the bosses of the plain rods."""
    z = p.platform_height - 0.006
    plate = {"radius": p.platform_radius, "height": 0.008}
    plate |= {f"azimuth_{i + 1}": float(a) for i, a in enumerate(p.leg_azimuths)}
    ear = {"length": p.rod_spacing, "width": 0.018, "thickness": 0.008, "bore": 0.0045}
    ears = []
    for leg in legs(p):
        place = at(leg.lower[0], leg.lower[1], z, columns(leg.tangent, np.cross([0, 0, 1.0], leg.tangent)))
        ears.append(shape("link", place, BLUE, f"ear_{leg.index}", **ear))
    axis = shape("cylinder", at(z=0.5 * z), DARK, "axis", radius=0.005, length=z)
    return (shape("triangle_platform", at(z=z), BLUE, "plate", **plate), axis, *ears)


def shaft_placement(leg: Leg) -> Placement:
    """Where a lower shaft turns: at the lower cross, about the axis of its positive sense."""
    return at(*vec(leg.lower), np.diag([1.0, -1.0, -1.0]) if leg.index < 3 else None)


def spur(p: Delta6Parameters, i: int, in_shaft: bool = False) -> Shapes:
    """The gear on lower shaft i, a tooth towards the central axis; `in_shaft`: seen from `shaft_placement`."""
    a, _, module = spur_sizes(p, i)
    place = at(z=SPUR_LEVEL[i - 1])
    if in_shaft and i < 3:
        place = at(z=-SPUR_LEVEL[i - 1], rotation=np.diag([1.0, -1.0, -1.0]))
    phase = p.leg_azimuths[i - 1] + math.pi
    return (shape("spur_gear", place, BRASS, f"N{i}", teeth=a, module=module, width=0.007, bore=0.0045, phase=phase),)


def idler_placement(p: Delta6Parameters) -> Placement:
    """The idler between the gear of shaft 3 and the gear of the carrier: halfway."""
    azimuth, half = p.leg_azimuths[2], 0.5 * p.platform_radius
    return at(half * math.cos(azimuth), half * math.sin(azimuth), p.platform_height + SPUR_LEVEL[2])


def idler(p: Delta6Parameters) -> Shapes:
    """Idler that gives shaft 3 and the carrier the same sense, 1:1. It has no mass and no coordinate of its own."""
    _, b, module = spur_sizes(p, 3)
    phase = external_phase(b, p.leg_azimuths[2], b, p.leg_azimuths[2])
    size = {"teeth": b, "module": module, "width": 0.007, "bore": 0.004, "phase": phase}
    return (shape("spur_gear", at(), STEEL, "idler", **size),)


def central(p: Delta6Parameters, i: int) -> Shapes:
    """The double gear Pr: one rim for the lower shaft, one for the planet."""
    a, b, module = spur_sizes(p, i)
    c, _, fine = planet_sizes(p)
    towards = p.leg_azimuths[i - 1] + math.pi
    level, low = p.platform_height + SPUR_LEVEL[i - 1], PLANET_LEVEL[i - 1]
    rim = {"width": 0.006, "bore": 0.0075}
    outer = rim | {"teeth": b, "module": module, "phase": external_phase(a, towards, b, towards), "holes": 6}
    inner = rim | {"teeth": c, "module": fine, "phase": _side(i)}
    sleeve = {"outer": 0.0075 if i == 1 else 0.0095, "inner": 0.0055 if i == 1 else 0.0077, "length": abs(level - low)}
    return (
        shape("spur_gear", at(z=level), STEEL, "outer_rim", **outer),
        shape("spur_gear", at(z=low), STEEL, "inner_rim", **inner),
        shape("tube", at(z=low + 0.5 * (level - low)), STEEL, "sleeve", **sleeve),
    )


def _side(i: int) -> float:
    """Azimuth of planet i in the carrier [rad]."""
    return 0.5 * math.pi if i == 1 else -0.5 * math.pi


def _bevel(
    name: str, color: tuple[float, float, float, float], place: Placement, radius: float, count: int, pitch_angle: float,
    phase: float = 0.0, bore: float = 0.0036,
) -> Shape:  # fmt: skip
    size = {"teeth": count, "module": 2.0 * radius / count, "pitch_angle": pitch_angle, "width": 0.006}
    return shape("bevel_gear", place, color, name, **size, bore=bore, phase=phase)


def planet(p: Delta6Parameters, i: int) -> Shapes:
    """Planet gear with its bevel Nz; its frame stands on the planet axis at the height of the head centre."""
    c, d, fine = planet_sizes(p)
    z = PLANET_LEVEL[i - 1]
    gear = {
        "teeth": d,
        "module": fine,
        "width": 0.006,
        "bore": 0.002,
        "phase": external_phase(c, _side(i), d, _side(i)),
    }
    pin = {"radius": 0.002, "length": z - BEVEL_PITCH + 0.016}
    return (
        shape("spur_gear", at(z=z), BRASS, "planet", **gear),
        _bevel("Nz", BRASS, at(), BEVEL_PITCH, BEVEL_TEETH, math.pi / 4, bore=0.002),
        shape("cylinder", at(z=0.5 * (z + BEVEL_PITCH) + 0.004), DARK, "pin", **pin),
    )


def _output_teeth(p: Delta6Parameters) -> tuple[int, int]:
    return teeth(float(p.k_bevel), 36, 60)


def bevel(p: Delta6Parameters, i: int) -> Shapes:
    """Double bevel Pz: outer rim towards the planet's bevel, inner rim towards the output gear; frame at the head centre."""
    y = 1.0 if i == 1 else -1.0
    a, b = _output_teeth(p)
    to_side, to_centre = (axis_rotation((1.0, 0.0, 0.0), s * y * math.pi / 2) for s in (-1.0, 1.0))
    half_tooth = math.pi / BEVEL_TEETH
    outer = at(y=y * PLANET_OFFSET, rotation=to_centre)
    return (
        _bevel("outer_rim", STEEL, outer, BEVEL_PITCH, BEVEL_TEETH, math.pi / 4, phase=half_tooth),
        _bevel("inner_rim", STEEL, at(rotation=to_side), OUTER_PITCH, a, math.atan2(a, b)),
        shape("tube", at(y=y * 0.0225, rotation=to_side), STEEL, "sleeve", outer=0.006, inner=0.004, length=0.011),
    )


def carrier(p: Delta6Parameters) -> Shapes:
    """Carrier of the head: bridge with the planet pins, two cheeks that hold the crossbar, gear of shaft 3."""
    _, b, module = spur_sizes(p, 3)
    gear = {"teeth": b, "module": module, "width": 0.006, "bore": 0.0098, "phase": p.leg_azimuths[2]}
    y = PLANET_OFFSET + 0.013
    return (
        shape("box", at(z=0.0305), RED, "bridge", x=0.016, y=2 * PLANET_OFFSET + 0.03, z=0.004),
        shape("spur_gear", at(z=p.platform_height + SPUR_LEVEL[2]), RED, "gear", **gear),
        *(shape("box", at(0.0, side * y, 0.012), RED, "cheek", x=0.014, y=0.005, z=0.041) for side in (1.0, -1.0)),
    )


def tee(p: Delta6Parameters) -> Shapes:
    """T-shaped carrier: crossbar along Y', stem along X'."""
    x_to_y = np.column_stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    size = {"stem": max(0.02, p.head_offset - 0.012), "crossbar": 2 * (PLANET_OFFSET + 0.014), "radius": 0.0035}
    return (shape("t_carrier", at(rotation=x_to_y), TEAL, "tee", **size),)


def output(p: Delta6Parameters) -> Shapes:
    """Output link: bevel gear on the stem, flange, tool whose point is D."""
    a, b = _output_teeth(p)
    radius, flange = OUTER_PITCH * b / a, p.head_offset - 0.014
    sleeve = {"outer": 0.0065, "inner": 0.004, "length": max(0.004, p.head_offset - 0.018 - OUTER_PITCH)}
    middle = at(x=0.5 * (OUTER_PITCH + p.head_offset - 0.014), rotation=ALONG_X)
    return (
        _bevel("VZ", BRASS, at(rotation=ALONG_X), radius, b, math.atan2(b, a), phase=math.pi / b),
        shape("flange", at(x=flange, rotation=ALONG_X), RED, "tool", radius=0.013, thickness=0.006, reach=0.014),
        shape("tube", middle, BRASS, "sleeve", **sleeve),
    )
