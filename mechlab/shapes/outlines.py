"""Toothed outlines in the plane, and the faces that cover their teeth."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mechlab.shapes.involute import Teeth, ring_tooth, tooth

Array = NDArray[np.float64]


def teeth_of(number: float, module: float, pressure_angle: float, backlash: float, profile_shift: float = 0.0) -> Teeth:
    """Teeth from the parameters of a kind, where backlash and profile shift are multiples of the module."""
    return Teeth(number, module, pressure_angle, backlash * module, profile_shift * module)


def around(radii: Array, halves: Array, number: int, phase: float, stretch: float = 1.0) -> tuple[Array, Array]:
    """Radii and azimuths (number, 2 k) of all teeth: up the right flank, down the left one, counter-clockwise."""
    r = np.concatenate([radii, radii[::-1]])
    side = stretch * np.concatenate([-halves, halves[::-1]])
    azimuth = phase + 2.0 * math.pi * np.arange(number)[:, None] / number + side
    return np.broadcast_to(r, azimuth.shape), azimuth


def tooth_faces(loop: NDArray[np.int64], number: int) -> NDArray[np.int64]:
    """Triangles (m, 3) over every tooth of an outline loop (number * 2 k,): rungs from flank to flank."""
    rows = loop.reshape(number, -1)
    k = rows.shape[1]
    a, b = rows[:, : k // 2 - 1], rows[:, 1 : k // 2]
    c, d = rows[:, ::-1][:, 1 : k // 2], rows[:, ::-1][:, : k // 2 - 1]
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)


def feet(loop: NDArray[np.int64], number: int) -> NDArray[np.int64]:
    """The two root corners of every tooth of an outline loop: the border between teeth and gear body."""
    return loop.reshape(number, -1)[:, [0, -1]].ravel()


def spur_outline(teeth: Teeth, phase: float = 0.0) -> Array:
    """(n, 2) counter-clockwise outline of a spur gear, a tooth at angle `phase`; corners lie on the true profile."""
    r, t = around(*tooth(teeth), int(teeth.number), phase)
    return np.column_stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()])


def internal_outline(teeth: Teeth, phase: float = 0.0) -> Array:
    """(n, 2) counter-clockwise outline of the hole in an internal gear, a tooth centred at angle `phase`."""
    r, t = around(*ring_tooth(teeth), int(teeth.number), phase)
    return np.column_stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()])


def rack_outline(
    teeth: int, module: float, height: float, pressure_angle: float, backlash: float, phase: float
) -> Array:
    """(n, 2) counter-clockwise outline of a rack: teeth along x, pitch line y = 0, a tooth at x = `phase` pitches."""
    pitch, slope = math.pi * module, math.tan(pressure_angle)
    half = 0.25 * pitch - 0.5 * backlash * module
    tip, foot = half - module * slope, half + 1.25 * module * slope
    centers = pitch * (np.arange(teeth) - (teeth - 1) // 2 + phase)
    shape = np.array([[-foot, -1.25 * module], [-tip, module], [tip, module], [foot, -1.25 * module]])
    top = (shape + np.column_stack([centers, 0.0 * centers])[:, None, :]).reshape(-1, 2)
    ends = [(centers[0] - 0.5 * pitch, -1.0), (centers[-1] + 0.5 * pitch, 1.0)]
    low = -1.25 * module - height
    frame = [np.array([[x, -1.25 * module], [x, low]][:: -1 if s < 0 else 1]) for x, s in ends]
    return np.concatenate([frame[0], top, frame[1]])[::-1]
