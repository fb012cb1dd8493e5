"""Spur gears, internal gears and racks: extruded involute outlines."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mechlab.shapes.build import SMALL, Kind, Parameter, Times, angle, count, extrude, gap, length, require
from mechlab.shapes.involute import feet, internal_outline, rack_outline, spur_outline, teeth_of, tooth_faces
from mechlab.shapes.polygon import circle
from mechlab.shapes.solid import Mesh, Shell

Array = NDArray[np.float64]
ALPHA = math.radians(20.0)


def windows(inner: float, outer: float, holes: int, spokes: int, phase: float) -> list[Array]:
    """Openings in a web between two radii: round holes, or the windows that `spokes` leave between them."""
    require(not (holes and spokes), "gear: give holes or spokes, not both.")
    number = max(holes, spokes)
    span, middle = outer - inner, 0.5 * (inner + outer)
    if not number:
        return []
    require(span > 0.1 * outer, "gear: no room for holes or spokes between bore and rim; make the bore smaller.")
    starts = phase + 2.0 * math.pi * (np.arange(number) + 0.5) / number
    if holes:
        radius = min(0.36 * span, 0.72 * middle * math.sin(math.pi / max(number, 2)))
        return [circle(radius, SMALL, (middle * math.cos(t), middle * math.sin(t))) for t in starts.tolist()]
    low, high, half = inner + 0.16 * span, outer - 0.10 * span, 0.11 * span
    shape = []
    for r, step in ((high, 1.0), (low, -1.0)):
        reach = math.pi / number - math.asin(min(0.9, half / r))
        require(reach > 0.02, "gear: too many spokes for this size.")
        t = step * np.linspace(-reach, reach, 9)
        shape.append(np.column_stack([r * np.cos(t), r * np.sin(t)]))
    outline = np.concatenate(shape)
    turns = [np.array([[math.cos(t), -math.sin(t)], [math.sin(t), math.cos(t)]]) for t in starts.tolist()]
    return [outline @ turn.T for turn in turns]


def spur_gear(
    teeth: int,
    module: float,
    width: float,
    bore: float,
    web: float,
    hub: float,
    pressure_angle: float,
    backlash: float,
    profile_shift: float,
    phase: float,
    holes: int,
    spokes: int,
) -> Mesh:
    """An external involute gear about z, centred at the origin, the web between hub and rim thinner if asked."""
    profile = teeth_of(teeth, module, pressure_angle, backlash, profile_shift)
    rim = profile.root - 1.2 * module
    inner = max(hub, bore) if bore else 0.0
    require(bore < profile.root, f"spur_gear: bore {bore:g} m must be smaller than the root radius {profile.root:g} m.")
    require(web <= width, "spur_gear: web must not be thicker than width.")
    recessed = web < width
    require(
        not recessed or inner < 0.9 * rim, "spur_gear: no room for a recessed web; leave web out or make hub smaller."
    )
    shell = Shell()
    outline = spur_outline(profile, phase)
    openings = windows(inner, rim, holes, spokes, phase)
    sides = []
    for sign in (-1.0, 1.0):
        edge, up = shell.loop(outline, 0.5 * sign * width), sign > 0.0
        faces = tooth_faces(edge, teeth)
        shell.faces(faces if up else faces[:, ::-1])
        holes_here = [shell.loop(w, 0.5 * sign * web) for w in openings]
        axle = [shell.loop(circle(bore, SMALL), 0.5 * sign * width)] if bore else []
        if not recessed:
            shell.cap(feet(edge, teeth), axle + holes_here, up)
        else:
            top, floor = (shell.loop(circle(rim), 0.5 * sign * h) for h in (width, web))
            shell.cap(feet(edge, teeth), [top], up)
            shell.band(*((top, floor) if up else (floor, top)))
            island = []
            if inner:
                foot, crown = (shell.loop(circle(inner, SMALL), 0.5 * sign * h) for h in (web, width))
                shell.band(*((foot, crown) if up else (crown, foot)))
                shell.cap(crown, axle, up)
                island = [foot]
            shell.cap(floor, holes_here + island, up)
        sides.append((edge, holes_here + axle))
    (low_edge, low_holes), (high_edge, high_holes) = sides
    shell.band(low_edge, high_edge)
    for low, high in zip(low_holes, high_holes, strict=True):
        shell.band(high, low)
    return shell.mesh()


def internal_gear(
    teeth: int,
    module: float,
    width: float,
    rim: float,
    pressure_angle: float,
    backlash: float,
    profile_shift: float,
    phase: float,
) -> Mesh:
    """A ring about z, centred at the origin, with involute teeth inside."""
    profile = teeth_of(teeth, module, pressure_angle, backlash, profile_shift)
    inside = internal_outline(profile, phase)
    outer = circle(float(np.linalg.norm(inside, axis=1).max()) + rim, 96)
    shell = Shell()
    (low_rim, low), (high_rim, high) = (
        (shell.loop(outer, z), shell.loop(inside, z)) for z in (-0.5 * width, 0.5 * width)
    )
    shell.band(low_rim, high_rim)
    shell.band(high, low)
    for edge, loop, up in ((low_rim, low, False), (high_rim, high, True)):
        shell.cap(edge, [feet(loop, teeth)], up)
        faces = tooth_faces(loop, teeth)
        shell.faces(faces[:, ::-1] if up else faces)  # these teeth point inwards
    return shell.mesh()


TOOTHED = (
    angle("pressure_angle", "pressure angle at the pitch circle", ALPHA),
    Parameter("backlash", "module", "taken off the tooth thickness pi m / 2", 0.04, 0.0),
)
SHIFT = Parameter("profile_shift", "module", "profile shift", 0.0)
PHASE = angle("phase", "angle from +x to the centre of a tooth")


def rack(
    teeth: int, module: float, width: float, height: float, pressure_angle: float, backlash: float, phase: float
) -> Mesh:
    """A toothed bar along x with its teeth towards +y, centred in z."""
    outline = rack_outline(teeth, module, height, pressure_angle, backlash, phase)
    return extrude(outline, (), -0.5 * width, 0.5 * width)


KINDS = (
    Kind(
        "spur_gear",
        "external involute gear about z, centred",
        spur_gear,
        (
            count("teeth", "number of teeth", low=5),
            length("module", "pitch diameter over teeth"),
            length("width", "face width along z"),
            gap("bore", "radius of the bore, 0 for none"),
            length("web", "thickness of the web between hub and rim", Times(1.0, "width")),
            gap("hub", "radius of the hub when the web is thin", Times(1.7, "bore")),
            *TOOTHED,
            SHIFT,
            PHASE,
            count("holes", "round holes in the web", 0),
            count("spokes", "spokes of the web", 0),
        ),
    ),
    Kind(
        "internal_gear",
        "ring gear about z, centred, teeth inside",
        internal_gear,
        (
            count("teeth", "number of teeth", low=16),
            length("module", "pitch diameter over teeth"),
            length("width", "face width along z"),
            length("rim", "ring outside the tooth roots", Times(3.0, "module")),
            *TOOTHED,
            SHIFT,
            PHASE,
        ),
    ),
    Kind(
        "rack",
        "toothed bar along x, teeth to +y, pitch line y = 0, centred in z",
        rack,
        (
            count("teeth", "number of teeth", low=1),
            length("module", "pitch over pi"),
            length("width", "width along z"),
            length("height", "bar below the tooth roots", Times(2.0, "module")),
            *TOOTHED,
            Parameter("phase", "pitch", "x of a tooth centre; with 0 an odd number of teeth is centred", 0.0),
        ),
    ),
)
