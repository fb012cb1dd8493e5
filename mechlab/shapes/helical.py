"""Parts along a helix: springs and screws, and the nut that belongs to them."""

from __future__ import annotations

import math

import numpy as np

from mechlab.shapes.build import SMALL, extrude, helix, require, turned
from mechlab.shapes.kind import Kind, count, length
from mechlab.shapes.polygon import circle
from mechlab.shapes.solid import Mesh, merge


def spring(radius: float, wire: float, length: float, coils: int) -> Mesh:
    """A helical spring about z from z = 0 to z = length, wire centres on the radius."""
    require(2.0 * wire < min(length, 2.0 * radius), "spring: wire is too thick for radius and length.")
    return helix(circle(wire, 13), radius, wire, (length - 2.0 * wire) / coils, coils, 16)


def screw(radius: float, length: float, pitch: float) -> Mesh:
    """A threaded spindle about z, centred at the origin: a core and a right-handed ridge."""
    depth = min(0.35 * pitch, 0.3 * radius)
    foot, crest, in_, out = 0.32 * pitch, 0.06 * pitch, -0.2 * depth, depth
    ridge = np.array([[in_, -foot], [out, -crest], [out, crest], [in_, foot]])
    turns = max(length / pitch - 1.5, 0.5)
    thread = helix(ridge, radius - depth, -0.5 * turns * pitch, pitch, turns, 16)
    return merge([turned(radius - depth, -0.5 * length, 0.5 * length, 32, 0.3 * depth), thread])


def nut(across: float, height: float, bore: float) -> Mesh:
    """A hexagon nut about z, centred at the origin, `across` its flats."""
    require(2.0 * bore < across, "nut: bore must be smaller than half of the width across flats.")
    return extrude(circle(across / math.sqrt(3.0), 6), [circle(bore, SMALL)], -0.5 * height, 0.5 * height)


KINDS = (
    Kind(
        "spring",
        "helical spring about z from 0 to length",
        spring,
        (
            length("radius", "radius of the coil"),
            length("wire", "radius of the wire"),
            length("length", "height"),
            count("coils", "number of turns", 6, low=1),
        ),
    ),
    Kind(
        "screw",
        "right-handed spindle about z, centred",
        screw,
        (length("radius", "outer radius"), length("length", "length along z"), length("pitch", "advance per turn")),
        solid=False,
    ),
    Kind(
        "nut",
        "hexagon nut about z, centred",
        nut,
        (
            length("across", "width across flats"),
            length("height", "height along z"),
            length("bore", "radius of the bore"),
        ),
    ),
)
