"""Geoms of MJCF as shapes, and as inertia where a body has no <inertial>."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

from mechlab.formats.mjcf_source import Source, along, fail, one, refuse
from mechlab.formats.xml_text import floats
from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.shape import Color, Shape, shape

SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


def solid(source: Source, geom: ET.Element) -> tuple[str, tuple[float, ...], Placement]:
    """Type, sizes (as MJCF: radii and half lengths) and placement of a primitive geom."""
    kind = geom.get("type", "sphere")
    sizes = floats(geom, "size") or ()
    if kind in SIZES and (not sizes or min(sizes[: SIZES[kind]]) <= 0.0):
        raise fail(geom, f"the sizes of a {kind} must be positive, got {geom.get('size')!r}.")
    ends = floats(geom, "fromto", 6)
    placement = source.placement(geom)
    if ends is not None:
        start, end = np.array(ends[:3]), np.array(ends[3:])
        placement = along(start, end)
        half = float(np.linalg.norm(end - start)) / 2.0
        sizes = (sizes[0], half) if kind in ("capsule", "cylinder") else (sizes[0], sizes[0], half)
    if len(sizes) < SIZES[kind]:
        raise fail(geom, f"a {kind} needs {SIZES[kind]} sizes.")
    return kind, sizes[: SIZES[kind]], placement


def geom_shape(source: Source, geom: ET.Element) -> Shape | None:
    """The shape of a geom, or None for what a Mechanism has no shape for (mesh, plane, ellipsoid)."""
    if geom.get("type", "sphere") not in SIZES:
        return None
    kind, s, placement = solid(source, geom)
    rgba = floats(geom, "rgba", 4) or (0.5, 0.5, 0.5, 1.0)
    color: Color = (rgba[0], rgba[1], rgba[2], rgba[3])
    if kind == "box":
        return shape("box", placement, color, x=2 * s[0], y=2 * s[1], z=2 * s[2])
    if kind == "sphere":
        return shape("sphere", placement, color, radius=s[0])
    if kind == "cylinder":
        return shape("cylinder", placement, color, radius=s[0], length=2 * s[1])
    if kind == "capsule":
        return shape("rod", placement @ Placement((0.0, 0.0, -s[1])), color, radius=s[0], length=2 * s[1])
    return None


def geom_inertia(source: Source, geom: ET.Element) -> Inertia:
    """Inertia of a primitive geom from its mass or density, in the body frame."""
    refuse(geom, "shellinertia", "fluidshape")
    kind = geom.get("type", "sphere")
    mass = one(geom, "mass", -1.0)
    if mass == 0.0 or (mass < 0.0 and one(geom, "density", 1000.0) == 0.0):
        return Inertia()
    if kind not in SIZES:
        raise fail(geom, f"the mass of a {kind} cannot be read from the text; give its body an <inertial>.")
    kind, s, placement = solid(source, geom)
    volume, moments = _uniform(kind, s)
    if mass < 0.0:
        mass = one(geom, "density", 1000.0) * volume
    xx, yy, zz = (mass * k for k in moments)
    return Inertia(mass, (0.0, 0.0, 0.0), (xx, yy, zz, 0.0, 0.0, 0.0)).at(placement.position, placement.rotation)


def _uniform(kind: str, s: tuple[float, ...]) -> tuple[float, tuple[float, float, float]]:
    """Volume and moments per mass of a uniform solid."""
    if kind in ("box", "ellipsoid"):
        a, b, c = s
        k = 3.0 if kind == "box" else 5.0
        volume = 8.0 * a * b * c if kind == "box" else 4.0 / 3.0 * math.pi * a * b * c
        return volume, ((b * b + c * c) / k, (a * a + c * c) / k, (a * a + b * b) / k)
    r = s[0]
    ball = 4.0 / 3.0 * math.pi * r * r * r
    if kind == "sphere":
        return ball, (0.4 * r * r,) * 3
    half = s[1]
    tube = 2.0 * math.pi * r * r * half
    across, axial = (3.0 * r * r + 4.0 * half * half) / 12.0, r * r / 2.0
    if kind == "cylinder":
        return tube, (across, across, axial)
    # a capsule: two half balls, whose centres lie 3 r / 8 outside the ends of the cylinder
    volume = tube + ball
    caps = 0.4 * r * r + half * half + 0.75 * r * half
    side = (tube * across + ball * caps) / volume
    return volume, (side, side, (tube * axial + ball * 0.4 * r * r) / volume)
