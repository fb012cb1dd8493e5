"""Phases of gears that mesh.

The phase of a gear is the angle from the +x axis of its frame to the centre of a tooth, about +z. With p the
pitches from that tooth to the pitch point, counted about each gear's own axis, teeth fit when
    external, bevel:  p_a + p_b = 1/2 (mod 1)        internal:  p_a - p_b = 1/2 (mod 1).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError

TURN = 2.0 * math.pi


def _pitches(teeth: int, phase: float, contact: float) -> float:
    return (contact - phase) * teeth / TURN


def _wrapped(phase: float, teeth: int) -> float:
    """The phase in (-half a pitch, half a pitch]: phases a pitch apart are the same gear."""
    pitch = TURN / teeth
    return phase - pitch * math.ceil(phase / pitch - 0.5)


def external_phase(teeth_a: int, phase_a: float, teeth_b: int, direction: float = 0.0) -> float:
    """Phase [rad] of external gear b that meshes with external gear a, axes and x directions parallel.

    `direction` [rad] is the angle of the line from the centre of a to the centre of b, from +x.
    """
    fraction = 0.5 - _pitches(teeth_a, phase_a, direction)
    return _wrapped(direction + math.pi - TURN / teeth_b * fraction, teeth_b)


def internal_phase(teeth_a: int, phase_a: float, teeth_b: int, direction: float = 0.0) -> float:
    """Phase [rad] of gear b that meshes with a, one of them an internal gear (either one), axes and x parallel.

    `direction` [rad] is the angle of the line from the centre of the internal gear to the centre of the pinion.
    """
    fraction = _pitches(teeth_a, phase_a, direction) - 0.5
    return _wrapped(direction - TURN / teeth_b * fraction, teeth_b)


def rack_phase(teeth: int, module: float, travel: float = 0.0) -> float:
    """Phase [rad] of a pinion on a rack, its centre at (x, m z / 2) in the frame of the rack and its x parallel.

    `travel` [m] is x less the position of any rack tooth centre.
    """
    return _wrapped(-0.5 * math.pi - TURN / teeth * (0.5 + travel / (math.pi * module)), teeth)


def pitch_angles(teeth_a: int, teeth_b: int, shaft_angle: float = 0.5 * math.pi) -> tuple[float, float]:
    """Pitch cone angles [rad] of a bevel pair: tan(delta_a) = sin(S) / (z_b / z_a + cos(S)), delta_b = S - delta_a."""
    delta = math.atan2(math.sin(shaft_angle), teeth_b / teeth_a + math.cos(shaft_angle))
    return delta, shaft_angle - delta


def bevel_phase(teeth_a: int, phase_a: float, rotation_a: ArrayLike, teeth_b: int, rotation_b: ArrayLike) -> float:
    """Phase [rad] of bevel gear b that meshes with bevel gear a, apexes together.

    `rotation_a`, `rotation_b` (3, 3) turn each gear frame (axis +z, from the apex to the teeth) into a common frame.
    Raises MechlabError when the axes are parallel.
    """
    ra, rb = np.asarray(rotation_a, dtype=float), np.asarray(rotation_b, dtype=float)
    shaft = math.atan2(float(np.linalg.norm(np.cross(ra[:, 2], rb[:, 2]))), float(ra[:, 2] @ rb[:, 2]))
    if math.sin(shaft) < 1e-9:
        raise MechlabError("bevel_phase: the axes are parallel; use external_phase for such gears.")
    delta_a, delta_b = pitch_angles(teeth_a, teeth_b, shaft)
    contact = (math.sin(delta_b) * ra[:, 2] + math.sin(delta_a) * rb[:, 2]) / math.sin(shaft)
    in_a, in_b = ra.T @ contact, rb.T @ contact
    fraction = 0.5 - _pitches(teeth_a, phase_a, math.atan2(in_a[1], in_a[0]))
    return _wrapped(math.atan2(in_b[1], in_b[0]) - TURN / teeth_b * fraction, teeth_b)
