"""Bevel gears, and parts along a helix: springs, screws and their nuts.

The teeth of a bevel gear are those of Tredgold's virtual spur gear, wrapped on the back cone and shrunk towards the
apex.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mechlab.shapes.build import SMALL, Kind, Times, angle, count, extrude, gap, helix, length, require, turned
from mechlab.shapes.gears import PHASE, TOOTHED
from mechlab.shapes.involute import Teeth, around, feet, teeth_of, tooth, tooth_faces
from mechlab.shapes.polygon import circle
from mechlab.shapes.solid import Mesh, Shell, merge

Array = NDArray[np.float64]


def virtual(teeth: Teeth, pitch_angle: float) -> Teeth:
    """The virtual spur gear of z / cos(delta) teeth that the back cone unrolls to (Tredgold 1822)."""
    return Teeth(teeth.number / math.cos(pitch_angle), teeth.module, teeth.pressure_angle, teeth.backlash)


def back_cone_outline(teeth: Teeth, pitch_angle: float, phase: float = 0.0) -> Array:
    """(n, 3) tooth outline on the back cone at the large end, apex of the pitch cone at the origin, axis +z.

    A point (r, t) of the virtual gear lies at distance r cos(delta) from the axis, azimuth t / cos(delta) and height
    R / cos(delta) - r sin(delta), where R = m z / (2 sin(delta)) is the cone distance.
    """
    slope, rise = math.cos(pitch_angle), math.sin(pitch_angle)
    r, t = around(*tooth(virtual(teeth, pitch_angle)), int(teeth.number), phase, 1.0 / slope)
    r, t = r.ravel(), t.ravel()
    z = teeth.pitch / (rise * slope) - r * rise
    return np.column_stack([r * slope * np.cos(t), r * slope * np.sin(t), z])


def bevel_gear(
    teeth: int,
    module: float,
    pitch_angle: float,
    width: float,
    bore: float,
    hub: float,
    hub_length: float,
    pressure_angle: float,
    backlash: float,
    phase: float,
) -> Mesh:
    """A straight bevel gear about z, apex at the origin, its teeth towards +z, `module` at the large end."""
    require(0.03 < pitch_angle < 1.54, f"bevel_gear: pitch_angle must lie within 0.03..1.54 rad, got {pitch_angle:g}.")
    profile = teeth_of(teeth, module, pressure_angle, backlash)
    distance = profile.pitch / math.sin(pitch_angle)
    require(width < 0.6 * distance, f"bevel_gear: width must be below 0.6 of the cone distance {distance:g} m.")
    shrink = 1.0 - width / distance
    outline = back_cone_outline(profile, pitch_angle, phase)
    shell = Shell()
    heel, toe = shell.loop(outline), shell.loop(outline * shrink)
    shell.band(toe, heel)
    shell.faces(tooth_faces(heel, teeth))
    shell.faces(tooth_faces(toe, teeth)[:, ::-1])
    ring, small = feet(heel, teeth), feet(toe, teeth)
    foot = outline[ring]
    root, back = float(np.hypot(*foot[0, :2])), float(foot[0, 2])
    require(
        bore < 0.9 * root * shrink, f"bevel_gear: bore must be below {0.9 * root * shrink:g} m, the root at the toe."
    )
    hub = min(max(hub, 0.4 * root * shrink), 0.85 * root)
    thick = back + 0.8 * module * math.sin(pitch_angle)
    rear = shell.loop(foot[:, :2] * (1.0 - 0.4 * module / root), thick)
    shell.band(ring, rear)
    front = back * shrink
    axle = []
    end = thick + hub_length
    if bore:
        axle = [shell.loop(circle(bore, SMALL), front), shell.loop(circle(bore, SMALL), end)]
        shell.band(axle[1], axle[0])
    shell.cap(small, axle[:1], up=False)
    low, high = shell.loop(circle(hub, SMALL), thick), shell.loop(circle(hub, SMALL), end)
    shell.cap(rear, [low], up=True)
    shell.band(low, high)
    shell.cap(high, axle[1:], up=True)
    return shell.mesh()


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
        "bevel_gear",
        "straight bevel gear about z, apex at the origin, teeth on the cone towards +z",
        bevel_gear,
        (
            count("teeth", "number of teeth", low=8),
            length("module", "module at the large end"),
            angle("pitch_angle", "half angle of the pitch cone", None),
            length("width", "face width along the cone"),
            gap("bore", "radius of the bore, 0 for none"),
            gap("hub", "radius of the hub behind the teeth", Times(1.8, "bore")),
            length("hub_length", "length of the hub behind the teeth", Times(0.5, "width")),
            *TOOTHED,
            PHASE,
        ),
    ),
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
