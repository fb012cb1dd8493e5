"""What the parts of the delta look like.

Sizes and places that several groups of parts share. Shapes carry no mass; tooth counts are for the eye, the nearest whole numbers.

Ground, sliders, rods and crosses of the delta.

Platform of the delta, and the gears between the lower shafts and the central axis.

Head of the delta: planets, bevels, carrier, output link.
"""

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

SPUR_LEVEL = (-0.014, -0.024, -0.034)
"""Heights of the three lower gears below the lower crosses [m]."""
PLANET_LEVEL = (0.017, 0.024)
"""Heights of the planets above the head centre [m]."""
Shapes = tuple[Shape, ...]


def at(position: Array | tuple[float, float, float], rotation: Array | None = None) -> Placement:
    """A placement; not turned by default."""
    return Placement.of(np.eye(3) if rotation is None else rotation, position)


def columns(x: Array, y: Array) -> Array:
    """Rotation whose first two columns are the orthonormal x and y."""
    return np.column_stack([x, y, np.cross(x, y)])


@lru_cache(maxsize=256)
def teeth(ratio: float, low: int = 60, high: int = 140) -> tuple[int, int]:
    """Whole numbers (a, b), a + b within limits, with b / a nearest to `ratio`."""
    pairs = [
        (a, round(a * ratio)) for a in range(12, high) if low <= a + round(a * ratio) <= high and round(a * ratio) >= 12
    ]
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


FLOOR = -0.17
"""Height of the base plate below the home head centre [m]."""
GUIDE_ARM = 0.05
"""How far the guide columns stand outside the shaft axis [m]."""


def ground(p: Delta6Parameters) -> Shapes:
    """Base plate, three pairs of guide columns, top ring."""
    top = p.slider_max - p.slider_height + 0.09
    reach = abs(p.platform_radius + p.radial_offset) + GUIDE_ARM
    out = [shape("disc", at((0.0, 0.0, FLOOR - 0.008)), PALE, "base", radius=reach + 0.04, thickness=0.016, bore=0.1)]
    out.append(
        shape("ring", at((0.0, 0.0, top)), PALE, "top", outer=reach + 0.016, inner=reach - 0.016, thickness=0.012)
    )
    for leg in legs(p):
        frame = columns(leg.tangent, -leg.radial)
        foot = leg.upper + GUIDE_ARM * leg.radial
        out.append(
            shape(
                "guide",
                at((foot[0], foot[1], FLOOR), frame),
                STEEL,
                f"guide_{leg.index}",
                length=top - FLOOR,
                radius=0.008,
                spacing=0.06,
            )
        )
    return tuple(out)


def slider(p: Delta6Parameters, leg: Leg) -> Shapes:
    """Carriage on the two columns, with the arm and the motor over the shaft."""
    frame = columns(leg.tangent, -leg.radial)
    z = p.slider_height
    carriage = leg.radial * GUIDE_ARM
    return (
        shape(
            "slider",
            at((carriage[0], carriage[1], z), frame),
            BLUE,
            "carriage",
            x=0.1,
            y=0.034,
            length=0.07,
            bore=0.0085,
            holes=2,
            spacing=0.06,
        ),
        shape("box", at((carriage[0] * 0.45, carriage[1] * 0.45, z), frame), BLUE, "arm", x=0.04, y=0.05, z=0.03),
        shape("cylinder", at((0.0, 0.0, z + 0.035)), DARK, "motor", radius=0.019, length=0.045, chamfer=0.003),
        shape(
            "box",
            at(tuple(0.5 * p.rod_spacing * leg.tangent + np.array([0.0, 0.0, z])), frame),
            BLUE,
            "bar",
            x=p.rod_spacing + 0.02,
            y=0.014,
            z=0.014,
        ),
        shape(
            "cylinder",
            at(tuple(p.rod_spacing * leg.tangent + np.array([0.0, 0.0, 0.5 * z]))),
            BLUE,
            "post",
            radius=0.005,
            length=z,
        ),
    )


def _along(leg: Leg) -> Array:
    return frame_along(leg.span / np.linalg.norm(leg.span))


def rods(p: Delta6Parameters, leg: Leg) -> Shapes:
    """Both rods of a leg, for the fidelities in which they are one body."""
    return (
        shape("rod", at((0.0, 0.0, 0.0), _along(leg)), ORANGE, "rod", length=p.rod_length, radius=0.006),
        shape(
            "rod", at(vec(p.rod_spacing * leg.tangent), _along(leg)), STEEL, "plain", length=p.rod_length, radius=0.005
        ),
    )


def cardan_rod(p: Delta6Parameters, leg: Leg) -> Shapes:
    """The shaft between its two forks; the fork pins lie along fork_b."""
    u = leg.span / np.linalg.norm(leg.span)
    upper = columns(leg.fork_b, np.cross(-u, leg.fork_b))
    lower = columns(leg.fork_b, np.cross(u, leg.fork_b))
    return (
        shape(
            "cylinder",
            at(tuple(0.5 * leg.span), _along(leg)),
            ORANGE,
            "shaft",
            radius=0.006,
            length=p.rod_length - 0.05,
        ),
        shape("fork", at((0.0, 0.0, 0.0), upper), ORANGE, "upper_fork", span=0.02, pin=0.003),
        shape("fork", at(vec(leg.span), lower), ORANGE, "lower_fork", span=0.02, pin=0.003),
    )


def plain_rod(p: Delta6Parameters, leg: Leg) -> Shapes:
    """The plain rod with its two balls."""
    return (
        shape("rod", at((0.0, 0.0, 0.0), _along(leg)), STEEL, "rod", length=p.rod_length, radius=0.0045),
        shape("sphere", at((0.0, 0.0, 0.0)), DARK, "upper_ball", radius=0.008),
        shape("sphere", at(vec(leg.span)), DARK, "lower_ball", radius=0.008),
    )


def stub(p: Delta6Parameters, leg: Leg, upper: bool) -> Shapes:
    """Shaft stub with its fork; the pin holes lie along fork_a."""
    up = np.array([0.0, 0.0, 1.0 if upper else -1.0])
    frame = columns(leg.fork_a, np.cross(-up, leg.fork_a))
    long = p.slider_height if upper else 0.045
    return (
        shape("fork", at((0.0, 0.0, 0.0), frame), TEAL, "fork", span=0.02, pin=0.003),
        shape("cylinder", at(tuple(0.5 * (0.016 + long) * up)), TEAL, "stub", radius=0.0045, length=long - 0.016),
    )


def cross(leg: Leg) -> Shapes:
    """The cross with its four pins."""
    return (
        shape("cross", at((0.0, 0.0, 0.0), columns(leg.fork_a, leg.fork_b)), DARK, "cross", span=0.022, radius=0.0028),
    )


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


BEVEL_PITCH = 0.012
"""Pitch radius of the bevels Nz and of the outer bevels Pz [m]."""
OUTER_PITCH = 0.017
"""Pitch radius of the inner bevels Pz [m]."""


def planet(p: Delta6Parameters, i: int) -> Shapes:
    """Planet gear with its bevel Nz; its frame stands on the planet axis at the height of the head centre."""
    c, d, fine = planet_sizes(p)
    side = 0.5 * math.pi if i == 1 else -0.5 * math.pi
    phase = external_phase(c, side, d, side)
    z = PLANET_LEVEL[i - 1]
    return (
        shape(
            "spur_gear", at((0.0, 0.0, z)), BRASS, "planet", teeth=d, module=fine, width=0.006, bore=0.002, phase=phase
        ),
        _bevel("Nz", BRASS, np.eye(3), BEVEL_PITCH, 18, math.pi / 4, bore=0.002),
        shape(
            "cylinder",
            at((0.0, 0.0, 0.5 * (z + BEVEL_PITCH) + 0.004)),
            DARK,
            "pin",
            radius=0.002,
            length=z - BEVEL_PITCH + 0.016,
        ),
    )


def _bevel(
    name: str,
    color: tuple[float, float, float, float],
    rotation: Array,
    radius: float,
    count: int,
    pitch: float,
    phase: float = 0.0,
    bore: float = 0.0036,
) -> Shape:
    return shape(
        "bevel_gear", at((0.0, 0.0, 0.0), rotation), color, name, teeth=count, module=2.0 * radius / count, pitch_angle=pitch,
        width=0.006, bore=bore, phase=phase,
    )  # fmt: skip


def _output_teeth(p: Delta6Parameters) -> tuple[int, int]:
    return teeth(float(p.k_bevel), 36, 60)


def bevel(p: Delta6Parameters, i: int) -> Shapes:
    """Double bevel Pz: outer rim towards the planet's bevel, inner rim towards the output gear; frame at the head centre."""
    y = 1.0 if i == 1 else -1.0
    a, b = _output_teeth(p)
    inner = math.atan2(a, b)
    to_side = axis_rotation((1.0, 0.0, 0.0), -y * math.pi / 2)
    to_centre = axis_rotation((1.0, 0.0, 0.0), y * math.pi / 2)
    outer = Placement.of(to_centre, (0.0, y * PLANET_OFFSET, 0.0))
    step = math.pi / 18.0
    first = _bevel("outer_rim", STEEL, to_centre, BEVEL_PITCH, 18, math.pi / 4, phase=step)
    return (
        Shape(first.kind, first.size, outer, first.color, first.name),
        _bevel("inner_rim", STEEL, to_side, OUTER_PITCH, a, inner),
        shape(
            "tube",
            Placement.of(to_side, (0.0, y * 0.0225, 0.0)),
            STEEL,
            "sleeve",
            outer=0.006,
            inner=0.004,
            length=0.011,
        ),
    )


def carrier(p: Delta6Parameters) -> Shapes:
    """Carrier of the head: bridge with the planet pins, two cheeks that hold the crossbar, gear of shaft 3."""
    a, b, module = spur_sizes(p, 3)
    level, azimuth = p.platform_height + SPUR_LEVEL[2], p.leg_azimuths[2]
    out = [
        shape("box", at((0.0, 0.0, 0.0305)), RED, "bridge", x=0.016, y=2 * PLANET_OFFSET + 0.03, z=0.004),
        shape(
            "spur_gear",
            at((0.0, 0.0, level)),
            RED,
            "gear",
            teeth=b,
            module=module,
            width=0.006,
            bore=0.0098,
            phase=azimuth,
        ),
    ]
    for y in (1.0, -1.0):
        out.append(shape("box", at((0.0, y * (PLANET_OFFSET + 0.013), 0.012)), RED, "cheek", x=0.014, y=0.005, z=0.041))
    return tuple(out)


def tee(p: Delta6Parameters) -> Shapes:
    """T-shaped carrier: crossbar along Y', stem along X'."""
    x_to_y = np.column_stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    return (
        shape(
            "t_carrier",
            at((0.0, 0.0, 0.0), x_to_y),
            TEAL,
            "tee",
            stem=max(0.02, p.head_offset - 0.012),
            crossbar=2 * (PLANET_OFFSET + 0.014),
            radius=0.0035,
        ),
    )


def output(p: Delta6Parameters) -> Shapes:
    """Output link: bevel gear on the stem, flange, tool whose point is D."""
    a, b = _output_teeth(p)
    along_x = np.column_stack([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    radius = OUTER_PITCH * b / a
    return (
        _bevel("VZ", BRASS, along_x, radius, b, math.atan2(b, a), phase=math.pi / b),
        shape(
            "flange",
            at((p.head_offset - 0.014, 0.0, 0.0), along_x),
            RED,
            "tool",
            radius=0.013,
            thickness=0.006,
            reach=0.014,
        ),
        shape(
            "tube",
            at((0.5 * (OUTER_PITCH + p.head_offset - 0.014), 0.0, 0.0), along_x),
            BRASS,
            "sleeve",
            outer=0.0065,
            inner=0.004,
            length=max(0.004, p.head_offset - 0.018 - OUTER_PITCH),
        ),
    )
