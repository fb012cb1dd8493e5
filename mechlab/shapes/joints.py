"""Parts that make a joint visible: universal-joint crosses and forks, balls and sockets."""

from __future__ import annotations

import math

import numpy as np

from mechlab.shapes.build import SMALL, arc, extrude, require, revolve, turned
from mechlab.shapes.kind import Kind, Times, gap, length
from mechlab.shapes.polygon import circle, rounded_rectangle
from mechlab.shapes.solid import Mesh, along_x, along_y, merge, moved

HALF = 0.5 * math.pi


def cross(span: float, radius: float, hub: float) -> Mesh:
    """A universal-joint cross: two pins of full length `span` along x and y round a hub at the origin."""
    pin = turned(radius, -0.5 * span, 0.5 * span, SMALL, 0.15 * radius)
    return merge([revolve(arc(hub, 0.0, -HALF, HALF, 10), SMALL), along_x(pin), along_y(pin)])


def fork(span: float, pin: float, depth: float, thickness: float, shaft: float, stub: float) -> Mesh:
    """A cardan yoke: two ears, holes about the x axis through the origin, bridge at z = -depth, stub along -z."""
    eye = 1.9 * pin
    require(depth > eye, f"fork: depth must be greater than the eye radius {eye:g} m.")
    require(2.0 * thickness < span, "fork: thickness must be smaller than half of the span.")
    turn = np.linspace(0.0, math.pi, 17)
    head = eye * np.column_stack([np.cos(turn), np.sin(turn)])
    wide, low = 1.15 * eye, -depth - thickness
    outline = np.concatenate([head, np.array([(-wide, low), (wide, low)])])
    ear = along_x(extrude(outline, [circle(pin, SMALL)], 0.5 * span - thickness, 0.5 * span))
    other = moved(ear, (thickness - span, 0.0, 0.0))
    bridge = extrude(rounded_rectangle(span - thickness, 1.8 * wide, 0.0), (), low + 0.1 * thickness, -depth)
    neck = revolve(
        [
            (0.0, low - stub),
            (shaft, low - stub),
            (shaft, low - 0.8 * thickness),
            (min(1.5 * shaft, wide), low),
            (0.0, low + 0.5 * thickness),
        ],
        SMALL,
    )
    return merge([ear, other, bridge, neck])


def ball(radius: float, stud: float, stud_length: float) -> Mesh:
    """A ball centred at the origin with a stud along -z down to z = -stud_length."""
    require(stud < 0.95 * radius, "ball: the stud must be thinner than the ball.")
    sphere = revolve(arc(radius, 0.0, -HALF, HALF, 12), SMALL)
    if not stud_length or not stud:
        return sphere
    require(stud_length > radius, "ball: stud_length must be greater than radius.")
    start = -math.acos(stud / radius)
    body = [(0.0, -stud_length), (stud, -stud_length), *arc(radius, 0.0, start, HALF, 11)]
    return revolve(body, SMALL)


def socket(radius: float, wall: float) -> Mesh:
    """The cup of a ball joint: a half sphere shell round a ball of `radius` at the origin, open towards +z."""
    outer, lip = radius + wall, 0.3
    inside = arc(1.02 * radius, 0.0, lip, -HALF, 8)
    return revolve(arc(outer, 0.0, -HALF, lip, 9) + inside, SMALL)


KINDS = (
    Kind(
        "cross",
        "universal-joint cross, pins along x and y through the origin",
        cross,
        (
            length("span", "full length of each pin"),
            length("radius", "radius of the pins"),
            length("hub", "radius of the centre", Times(1.7, "radius")),
        ),
        solid=False,
    ),
    Kind(
        "fork",
        "cardan yoke, pin holes about x through the origin, stub shaft along -z",
        fork,
        (
            length("span", "distance of the outer faces of the ears"),
            length("pin", "radius of the pin holes"),
            length("depth", "from the pin axis to the bridge", Times(0.75, "span")),
            length("thickness", "thickness of ears and bridge", Times(0.16, "span")),
            length("shaft", "radius of the stub shaft", Times(1.3, "pin")),
            length("stub", "length of the stub shaft", Times(1.0, "span")),
        ),
        solid=False,
    ),
    Kind(
        "ball",
        "ball at the origin, its stud along -z",
        ball,
        (
            length("radius", "radius of the ball"),
            gap("stud", "radius of the stud", Times(0.45, "radius")),
            gap("stud_length", "from the centre to the end of the stud, 0 for none"),
        ),
    ),
    Kind(
        "socket",
        "cup of a ball joint round the origin, open towards +z",
        socket,
        (length("radius", "radius of the ball"), length("wall", "thickness of the cup", Times(0.3, "radius"))),
    ),
)
