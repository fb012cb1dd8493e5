"""Links: bars, cranks, arms and plates in the xy plane with joint axes along z; platforms, carriers and flanges."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from mechlab.mechanism.plate import plate_outline
from mechlab.shapes.build import (
    SMALL,
    Kind,
    Parameter,
    Times,
    angle,
    count,
    extrude,
    gap,
    hollow,
    length,
    require,
    revolve,
    turned,
)
from mechlab.shapes.polygon import around_circles, circle
from mechlab.shapes.simple import bolt_circle
from mechlab.shapes.solid import Mesh, along_x, merge, moved


def link(length: float, width: float, thickness: float, bore: float) -> Mesh:
    """A flat bar from its eye at the origin to its eye at (length, 0, 0), centred in z."""
    return arm(length, width, width, thickness, bore, bore)


def arm(length: float, width: float, tip_width: float, thickness: float, bore: float, tip_bore: float) -> Mesh:
    """A tapered flat bar from a wide eye at the origin to a slim eye at (length, 0, 0), centred in z."""
    require(2.0 * bore < width and 2.0 * tip_bore < tip_width, "link: a bore must be smaller than half of the width.")
    require(
        length > 0.5 * abs(width - tip_width), "link: one eye swallows the other; make length larger or width smaller."
    )
    outline = around_circles([(0.0, 0.0), (length, 0.0)], [0.5 * width, 0.5 * tip_width], 40)
    eyes = [circle(r, SMALL, (x, 0.0)) for r, x in ((bore, 0.0), (tip_bore, length)) if r > 0.0]
    require(length > bore + tip_bore, "link: the two bores overlap; make length larger.")
    return extrude(outline, eyes, -0.5 * thickness, 0.5 * thickness)


def crank(radius: float, width: float, thickness: float, bore: float, pin: float, pin_length: float) -> Mesh:
    """A crank web with a hub bore about z at the origin and a crank pin at (radius, 0) standing up in +z."""
    web = arm(radius, width, max(0.7 * width, 2.6 * pin), thickness, bore, 0.0)
    top = 0.5 * thickness + pin_length
    return merge([web, moved(turned(pin, 0.0, top, SMALL, 0.15 * pin), (radius, 0.0, 0.0))])


def bracket(height: float, width: float, thickness: float, bore: float, foot: float) -> Mesh:
    """A bearing block: bore about z at the origin, foot at y = -height, centred in z."""
    radius = 0.5 * width
    require(bore < radius, "bracket: bore must be smaller than half of the width.")
    plinth = min(0.25 * width, 0.5 * (height - radius))
    require(plinth > 0.0, "bracket: height must be greater than half of the width.")
    half, neck = 0.5 * foot, 0.62 * width
    t = np.linspace(-0.15, math.pi + 0.15, 25)
    head = radius * np.column_stack([np.cos(t), np.sin(t)])
    left = [(-neck, plinth - height), (-half, plinth - height), (-half, -height)]
    right = [(-x, y) for x, y in reversed(left)]
    outline = np.concatenate([head, np.array(left + right)])
    return extrude(outline, [circle(bore, SMALL)], -0.5 * thickness, 0.5 * thickness)


def slotted_link(
    length: float, width: float, thickness: float, bore: float, slot_low: float, slot_high: float, slot_width: float
) -> Mesh:
    """A flat bar in xy with its eye at the origin, to (length, 0, 0), and a slot for a pin or block from slot_low to slot_high."""
    require(slot_high > slot_low, "slotted_link: slot_high must be greater than slot_low.")
    require(slot_width < width and 2.0 * bore < width, "slotted_link: slot and bore must be narrower than the bar.")
    half, tip = 0.5 * width, 0.5 * slot_width
    outline = around_circles([(min(0.0, slot_low - tip), 0.0), (max(length, slot_high + tip), 0.0)], [half, half], 40)
    slot = around_circles([(slot_low, 0.0), (slot_high, 0.0)], [tip, tip], 40)
    eyes = [circle(bore, SMALL, (x, 0.0)) for x in (0.0, length) if bore and not slot_low - tip - bore < x < slot_high + tip + bore]
    return extrude(outline, [slot, *eyes], -0.5 * thickness, 0.5 * thickness)


def pointer(length: float, width: float, thickness: float, bore: float) -> Mesh:
    """A flat needle: hub about z at the origin, point at (length, 0, 0), centred in z."""
    require(0.0 <= bore < 0.5 * width, "pointer: bore must be smaller than half of the width.")
    outline = around_circles([(0.0, 0.0), (length - 0.01 * width, 0.0)], [0.5 * width, 0.01 * width], 48)
    return extrude(outline, [circle(bore, SMALL)] if bore else [], -0.5 * thickness, 0.5 * thickness)


MOST_PINS = 12


def plate_link(points: int, width: float, thickness: float, bore: float, **places: float) -> Mesh:
    """A flat plate round pins at (x_1, y_1), (x_2, y_2), ..., centred in z: their convex hull, its ends rounded by half
    the width, with a bore at each pin."""
    require(points <= MOST_PINS, f"plate_link: at most {MOST_PINS} points, got {points}.")
    require(2.0 * bore < width, "plate_link: bore must be smaller than half of the width.")
    pins = np.array([(places[f"x_{k}"], places[f"y_{k}"]) for k in range(1, points + 1)])
    apart = min(float(np.linalg.norm(a - b)) for a, b in combinations(pins, 2))
    require(apart > 2.0 * bore, "plate_link: two bores overlap; move the points apart.")
    eyes = [circle(bore, SMALL, (x, y)) for x, y in pins.tolist()] if bore else []
    return extrude(plate_outline(pins, 0.5 * width), eyes, -0.5 * thickness, 0.5 * thickness)


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
        "link",
        "flat bar in xy from its eye at the origin to its eye at (length, 0, 0)",
        link,
        (
            length("length", "distance of the eyes"),
            length("width", "width"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the pin holes", Times(0.25, "width")),
        ),
    ),
    Kind(
        "arm",
        "tapered flat bar in xy from a wide eye at the origin to a slim eye at (length, 0, 0)",
        arm,
        (
            length("length", "distance of the eyes"),
            length("width", "width at the origin"),
            length("tip_width", "width at the tip", Times(0.65, "width")),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the hole at the origin", Times(0.25, "width")),
            gap("tip_bore", "radius of the hole at the tip", Times(0.25, "tip_width")),
        ),
    ),
    Kind(
        "slotted_link",
        "flat bar in xy from its eye at the origin to (length, 0, 0), with a slot along x",
        slotted_link,
        (
            length("length", "distance of the eyes"),
            length("width", "width"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the pin holes", Times(0.15, "width")),
            Parameter("slot_low", "m", "where the pin in the slot begins along x", None),
            Parameter("slot_high", "m", "where the pin in the slot ends along x", None),
            length("slot_width", "width of the slot", Times(0.5, "width")),
        ),
    ),
    Kind(
        "crank",
        "crank web in xy, hub at the origin, pin at (radius, 0) towards +z",
        crank,
        (
            length("radius", "throw"),
            length("width", "width at the hub"),
            length("thickness", "thickness of the web along z"),
            gap("bore", "radius of the hub bore", Times(0.25, "width")),
            length("pin", "radius of the pin", Times(0.2, "width")),
            length("pin_length", "length of the pin above the web", Times(1.0, "thickness")),
        ),
        solid=False,
    ),
    Kind(
        "bracket",
        "bearing block, bore about z at the origin, foot at y = -height",
        bracket,
        (
            length("height", "from foot to axis"),
            length("width", "width of the head"),
            length("thickness", "thickness along z"),
            length("bore", "radius of the bore", Times(0.25, "width")),
            length("foot", "width of the foot", Times(2.0, "width")),
        ),
    ),
    Kind(
        "pointer",
        "flat needle in xy from a hub at the origin to a point at (length, 0, 0)",
        pointer,
        (
            length("length", "to the point"),
            length("width", "width of the hub"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the hub bore", Times(0.25, "width")),
        ),
    ),
    Kind(
        "plate_link",
        "flat plate in xy round pins at (x_1, y_1), (x_2, y_2), ...",
        plate_link,
        (
            count("points", "number of pins, 2 to 12", low=2),
            length("width", "twice the radius round a pin"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the pin holes", Times(0.25, "width")),
            *(
                Parameter(f"{axis}_{k}", "m", f"{axis} of pin {k}", None if k < 3 else 0.0)
                for k in range(1, MOST_PINS + 1)
                for axis in "xy"
            ),
        ),
    ),
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
