"""Slides and what they run on: carriage blocks on round columns or on a profile rail, along z."""

from __future__ import annotations

import numpy as np

from mechlab.shapes.build import SMALL, extrude, require, turned
from mechlab.shapes.kind import Kind, Times, count, gap, length
from mechlab.shapes.polygon import circle, rounded_rectangle
from mechlab.shapes.solid import Mesh, merge, moved


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
