"""Plain solids: blocks, turned parts, plates."""

from __future__ import annotations

import math

import numpy as np

from mechlab.shapes.build import SMALL, Kind, Times, arc, count, extrude, gap, hollow, length, require, revolve, turned
from mechlab.shapes.polygon import circle, rounded_rectangle
from mechlab.shapes.solid import Mesh, moved

HALF = 0.5 * math.pi


def box(x: float, y: float, z: float) -> Mesh:
    """A block centred at the origin."""
    return extrude(rounded_rectangle(x, y, 0.0), (), -0.5 * z, 0.5 * z)


def cylinder(radius: float, length: float, chamfer: float) -> Mesh:
    """A cylinder about z, centred at the origin."""
    require(chamfer < radius and 2.0 * chamfer < length, "cylinder: chamfer is too large for radius and length.")
    return turned(radius, -0.5 * length, 0.5 * length, chamfer=chamfer)


def floor(x: float, y: float) -> Mesh:
    """A sheet in the plane z = 0, centred; a side of 0 has no end and is drawn WIDE."""
    return moved(box(x or WIDE, y or WIDE, THIN), (0.0, 0.0, -0.5 * THIN))


def tube(outer: float, inner: float, length: float) -> Mesh:
    """A hollow cylinder about z, centred at the origin."""
    return hollow(outer, inner, -0.5 * length, 0.5 * length)


def sphere(radius: float) -> Mesh:
    """A sphere centred at the origin."""
    return revolve(arc(radius, 0.0, -HALF, HALF, 14), 28)


def cone(radius: float, length: float, tip: float) -> Mesh:
    """A cone about z, its base centred at the origin, its tip at z = length; `tip` radius above 0 truncates it."""
    top = [(tip, length)] if tip else []
    return revolve([(0.0, 0.0), (radius, 0.0), *top, (0.0, length)], 32)


def rod(length: float, radius: float) -> Mesh:
    """A rod along +z from the origin to z = length, with half spheres around both end points."""
    return revolve(arc(radius, 0.0, -HALF, 0.0, 4) + arc(radius, length, 0.0, HALF, 4), SMALL - 4)


def bolt_circle(number: int, radius: float, on: float) -> list[np.ndarray]:
    """Outlines of `number` round holes spread over a circle, the first one on +x."""
    turns = [2.0 * math.pi * k / number for k in range(number)]
    return [circle(radius, 16, (on * math.cos(t), on * math.sin(t))) for t in turns]


def disc(radius: float, thickness: float, bore: float, holes: int, hole: float) -> Mesh:
    """A round plate about z, centred at the origin, with an optional bore and a circle of holes."""
    require(bore < radius, f"disc: bore {bore:g} m must be smaller than radius {radius:g} m.")
    inside = ([circle(bore, SMALL)] if bore else []) + bolt_circle(holes, hole, 0.5 * (radius + bore))
    return extrude(circle(radius), inside, -0.5 * thickness, 0.5 * thickness)


def ring(outer: float, inner: float, thickness: float, holes: int, hole: float) -> Mesh:
    """A flat ring about z, centred at the origin, with an optional circle of bolt holes."""
    require(inner < outer, f"ring: inner {inner:g} m must be smaller than outer {outer:g} m.")
    inside = [circle(inner), *bolt_circle(holes, hole, 0.5 * (outer + inner))]
    return extrude(circle(outer, 64), inside, -0.5 * thickness, 0.5 * thickness)


def plate(x: float, y: float, thickness: float, corner: float, bore: float, hole: float) -> Mesh:
    """A rounded rectangular plate centred at the origin, with a bore and four corner holes if asked."""
    require(2.0 * corner < min(x, y), "plate: corner must be smaller than half of the shorter side.")
    inside = [circle(bore, 32)] if bore else []
    if hole:
        off = max(corner, 1.8 * hole)
        places = [(sx * (0.5 * x - off), sy * (0.5 * y - off)) for sx in (-1, 1) for sy in (-1, 1)]
        inside += [circle(hole, 16, at) for at in places]
    return extrude(rounded_rectangle(x, y, corner), inside, -0.5 * thickness, 0.5 * thickness)


WIDE, THIN = 20.0, 1e-3
"""Side of a sheet without end as it is drawn where no page draws it, and thickness of a sheet [m]."""

KINDS = (
    Kind("floor", "sheet in xy, its upper side at z = 0; 0: without end", floor, (gap("x", "full side"), gap("y", "full side"))),
    Kind("box", "block, centred", box, (length("x", "full side"), length("y", "full side"), length("z", "full side"))),
    Kind(
        "cylinder",
        "cylinder about z, centred",
        cylinder,
        (length("radius", "radius"), length("length", "length along z"), gap("chamfer", "broken rims")),
    ),
    Kind(
        "tube",
        "hollow cylinder about z, centred",
        tube,
        (length("outer", "outer radius"), length("inner", "inner radius"), length("length", "length along z")),
    ),
    Kind("sphere", "sphere, centred", sphere, (length("radius", "radius"),)),
    Kind(
        "cone",
        "cone about z, base at the origin, tip at z = length",
        cone,
        (
            length("radius", "radius of the base"),
            length("length", "height"),
            gap("tip", "radius of the tip, 0 for a point"),
        ),
    ),
    Kind(
        "rod",
        "round rod along z from 0 to length, half spheres around both end points",
        rod,
        (length("length", "distance of the end points"), length("radius", "radius")),
    ),
    Kind(
        "disc",
        "round plate about z, centred",
        disc,
        (
            length("radius", "radius"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the bore"),
            count("holes", "holes on a circle", 0),
            length("hole", "radius of those holes", Times(0.12, "radius")),
        ),
    ),
    Kind(
        "ring",
        "flat ring about z, centred",
        ring,
        (
            length("outer", "outer radius"),
            length("inner", "inner radius"),
            length("thickness", "thickness along z"),
            count("holes", "bolt holes", 0),
            length("hole", "radius of those holes", Times(0.5, "thickness")),
        ),
    ),
    Kind(
        "plate",
        "rounded rectangular plate in xy, centred",
        plate,
        (
            length("x", "full side"),
            length("y", "full side"),
            length("thickness", "thickness along z"),
            gap("corner", "corner radius"),
            gap("bore", "radius of a central hole"),
            gap("hole", "radius of four corner holes"),
        ),
    ),
)
