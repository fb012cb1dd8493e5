"""Head of the delta: planets, bevels, carrier, output link."""

from __future__ import annotations

import math

import numpy as np

from mechlab.catalog.delta6.looks.sizes import PLANET_LEVEL, SPUR_LEVEL, Shapes, at, planet_sizes, spur_sizes, teeth
from mechlab.catalog.delta6.masses import PLANET_OFFSET
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.kit.palette import BRASS, DARK, RED, STEEL, TEAL
from mechlab.mechanism import Placement, Shape, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.shapes import external_phase

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
