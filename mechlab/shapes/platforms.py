"""Parts between several legs or shafts: triangular platforms, T-shaped carriers, output flanges."""

from __future__ import annotations

import math

import numpy as np

from mechlab.shapes.build import SMALL, extrude, hollow, revolve, turned
from mechlab.shapes.kind import Kind, Times, angle, gap, length
from mechlab.shapes.polygon import around_circles, circle
from mechlab.shapes.simple import bolt_circle
from mechlab.shapes.solid import Mesh, along_x, merge, moved


def triangle_platform(
    radius: float,
    height: float,
    boss: float,
    bore: float,
    azimuth: float,
    azimuth_1: float,
    azimuth_2: float,
    azimuth_3: float,
) -> Mesh:
    """A rounded triangular plate centred at the origin with bosses for three legs at `radius`, and a central hole."""
    turns = [azimuth + a for a in (azimuth_1, azimuth_2, azimuth_3)]
    corners = np.array([(radius * math.cos(t), radius * math.sin(t)) for t in turns])
    outline = around_circles(corners, [boss] * 3, 60)
    pins = [circle(0.65 * boss, SMALL, (x, y)) for x, y in corners.tolist()]
    plate = extrude(outline, pins + ([circle(bore)] if bore else []), -0.3 * height, 0.3 * height)
    legs = [
        moved(hollow(0.85 * boss, 0.45 * boss, -0.5 * height, 0.5 * height, SMALL), (x, y, 0.0)) for x, y in corners
    ]
    return merge([plate, *legs])


def t_carrier(stem: float, crossbar: float, radius: float) -> Mesh:
    """A T-shaped shaft: crossbar along x centred at the origin, stem along -z, and a hub where they meet."""
    bar = along_x(turned(radius, -0.5 * crossbar, 0.5 * crossbar, SMALL, 0.12 * radius))
    shaft = turned(radius, -stem, 0.0, SMALL, 0.12 * radius)
    hub = turned(1.6 * radius, -1.7 * radius, 1.7 * radius, 32, 0.2 * radius)
    return merge([hub, bar, shaft])


def flange(radius: float, thickness: float, reach: float, tool: float) -> Mesh:
    """An output flange: bolted disc below z = 0, and a tool that ends in a point at (0, 0, reach)."""
    plate = extrude(circle(radius), bolt_circle(6, 0.11 * radius, 0.74 * radius), -thickness, 0.0)
    shoulder = 0.62 * reach
    tip = revolve(
        [
            (0.0, -0.5 * thickness),
            (1.7 * tool, -0.5 * thickness),
            (1.7 * tool, 0.12 * reach),
            (tool, 0.2 * reach),
            (tool, shoulder),
            (0.0, reach),
        ],
        SMALL,
    )
    return merge([plate, tip])


KINDS = (
    Kind(
        "triangle_platform",
        "rounded triangular plate in xy with three leg bosses, centred",
        triangle_platform,
        (
            length("radius", "distance of the legs from z"),
            length("height", "height of the bosses along z"),
            length("boss", "corner radius", Times(0.18, "radius")),
            gap("bore", "radius of the central hole", Times(0.25, "radius")),
            angle("azimuth", "turns all three legs"),
            angle("azimuth_1", "leg 1", 0.0),
            angle("azimuth_2", "leg 2", 2.0 * math.pi / 3.0),
            angle("azimuth_3", "leg 3", 4.0 * math.pi / 3.0),
        ),
        solid=False,
    ),
    Kind(
        "t_carrier",
        "T-shaped shaft, crossbar along x through the origin, stem along -z",
        t_carrier,
        (
            length("stem", "length of the stem"),
            length("crossbar", "full length of the crossbar"),
            length("radius", "radius of both"),
        ),
        solid=False,
    ),
    Kind(
        "flange",
        "bolted disc below z = 0 with a tool whose point is at (0, 0, reach)",
        flange,
        (
            length("radius", "radius of the disc"),
            length("thickness", "thickness of the disc"),
            length("reach", "height of the tool point"),
            length("tool", "radius of the tool", Times(0.12, "radius")),
        ),
        solid=False,
    ),
)
