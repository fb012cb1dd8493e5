"""Parts that make a joint visible: crosses and forks, balls and sockets, slides on round columns or on a profile rail."""

from __future__ import annotations

import math

import numpy as np

from mechlab.shapes.build import SMALL, Kind, Times, arc, count, extrude, gap, length, require, revolve, turned
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


def slider(x: float, y: float, length: float, bore: float, holes: int, spacing: float, corner: float) -> Mesh:
    """A carriage block centred at the origin, sliding along z, with 1 hole or 2 holes `spacing` apart along x."""
    require(holes in (0, 1, 2), f"slider: holes must be 0, 1 or 2, got {holes}.")
    require(
        2.0 * bore < y and 2.0 * bore + (spacing if holes == 2 else 0.0) < x,
        "slider: the holes do not fit into x and y.",
    )
    require(2.0 * corner < min(x, y), "slider: corner must be smaller than half of the shorter side.")
    require(holes < 2 or spacing > 2.0 * bore, "slider: spacing must be greater than the diameter of the holes.")
    places = {0: (), 1: (0.0,), 2: (-0.5 * spacing, 0.5 * spacing)}[holes]
    return extrude(
        rounded_rectangle(x, y, corner), [circle(bore, SMALL, (at, 0.0)) for at in places], -0.5 * length, 0.5 * length
    )


def guide(length: float, radius: float, spacing: float, foot: float) -> Mesh:
    """Round columns along z from 0 to length: one, or two `spacing` apart along x, end plates `foot` thick."""
    places = (-0.5 * spacing, 0.5 * spacing) if spacing else (0.0,)
    parts = [moved(turned(radius, 0.0, length, SMALL), (x, 0.0, 0.0)) for x in places]
    if foot:
        end = rounded_rectangle(spacing + 5.0 * radius, 5.0 * radius, 1.2 * radius)
        parts += [extrude(end, (), -foot, 0.0), extrude(end, (), length, length + foot)]
    return merge(parts)


def rail(length: float, width: float, height: float) -> Mesh:
    """A profile rail along z from 0 to length, foot at y = 0, waisted sides, head at y = height."""
    half, waist = 0.5 * width, 0.32 * width
    right = [
        (half, 0.0),
        (half, 0.35 * height),
        (waist, 0.52 * height),
        (waist, 0.66 * height),
        (half, 0.82 * height),
        (half, 0.94 * height),
        (half - 0.06 * height, height),
    ]
    outline = np.array(right + [(-x, y) for x, y in reversed(right)])
    return extrude(outline, (), 0.0, length)


def carriage(length: float, width: float, height: float, rail_width: float, rail_height: float) -> Mesh:
    """A block that rides on a rail along z, centred in z: the foot of its rail at y = 0, its top at y = height."""
    require(
        rail_width < 0.8 * width and rail_height < 0.9 * height, "carriage: the rail does not fit into the carriage."
    )
    half, low, c = 0.5 * width, 0.3 * rail_height, 0.05 * width
    slot, roof = 0.5 * rail_width * 1.06, rail_height * 1.05
    right = [(slot, low), (half, low), (half, height - c), (half - c, height)]
    left = [(-x, y) for x, y in reversed(right)]
    outline = np.array([*right, *left, (-slot, roof), (slot, roof)])
    return extrude(outline, (), -0.5 * length, 0.5 * length)


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
    Kind(
        "slider",
        "carriage block, centred, sliding along z on columns",
        slider,
        (
            length("x", "full side"),
            length("y", "full side"),
            length("length", "length along z"),
            length("bore", "radius of the through holes", Times(0.25, "y")),
            count("holes", "0, 1 or 2 through holes", 1),
            gap("spacing", "distance of two holes along x", Times(0.5, "x")),
            gap("corner", "corner radius", Times(0.15, "y")),
        ),
    ),
    Kind(
        "guide",
        "one or two round columns along z from 0 to length",
        guide,
        (
            length("length", "length of the columns"),
            length("radius", "radius of a column"),
            gap("spacing", "distance of two columns along x, 0 for one column"),
            gap("foot", "thickness of end plates beyond both ends, 0 for none"),
        ),
        solid=False,
    ),
    Kind(
        "rail",
        "profile rail along z from 0 to length, foot at y = 0",
        rail,
        (
            length("length", "length"),
            length("width", "width along x"),
            length("height", "height along y", Times(1.0, "width")),
        ),
    ),
    Kind(
        "carriage",
        "block on a profile rail, centred in z, foot of the rail at y = 0, top at y = height",
        carriage,
        (
            length("length", "length along z"),
            length("width", "width along x"),
            length("height", "top above the foot of the rail"),
            length("rail_width", "width of the rail", Times(0.4, "width")),
            length("rail_height", "height of the rail", Times(1.0, "rail_width")),
        ),
    ),
)
