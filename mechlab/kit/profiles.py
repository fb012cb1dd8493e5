"""Closed laws of cams, Geneva wheels and oval gears as curves, sampled to quintic pieces with exact value, slope and second derivative
at the knots.

Sampling errors, largest over the turn (tests/kit/test_profiles.py): cams 1e-10 of the lift and 1e-5 of lift / rise^2 in the second
derivative, none for the law poly345, which is a quintic; Geneva wheels from 3 slots on 2e-11 rad and 4e-7 of the largest second derivative;
oval gears with an eccentricity up to 0.6 1e-10 rad. Where the second derivative jumps (the pin enters the slot, the harmonic law leaves
its dwell) a knot stands.
"""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.cams import LAWS, rise_law
from mechlab.analytic.geneva import engaged_from, slot_law
from mechlab.errors import MechlabError, unknown
from mechlab.mechanism import Curve, constant, hermite, joined

TURN = 2.0 * math.pi
PIECES = {"cycloidal": 48, "poly345": 1, "poly4567": 64, "harmonic": 24}
"""Pieces of a rise."""
SLOT_PIECES, OVAL_PIECES = 96, 160


def cam_curve(law: str, lift: float, rise: float, top: float, fall: float) -> Curve:
    """Lift of a cam by its turn: rise, dwell at the top, fall, dwell; see `mechlab.analytic.cams.rise_and_fall`.

    Raises MechlabError for an unknown law, and for a turn that is too short for its parts.
    """
    if law not in LAWS:
        raise unknown("cam: law", law, LAWS)
    if min(rise, fall) <= 0.0 or top < 0.0 or rise + top + fall > 2.0 * math.pi * (1.0 + 1e-12):
        raise MechlabError(
            f"cam: rise {rise:.4g}, top {top:.4g} and fall {fall:.4g} rad do not fit into a turn of {2.0 * math.pi:.4g} rad: shorten one."
        )
    u = np.linspace(0.0, 1.0, PIECES[law] + 1)
    s, v, a = rise_law(law, u)
    parts = [hermite(rise * u, lift * s, lift / rise * v, lift / rise**2 * a)]
    if top:
        parts.append(constant(parts[-1].knots[-1], rise + top, lift))
    start = parts[-1].knots[-1]
    parts.append(hermite(start + fall * u, lift * s[::-1], -lift / fall * v[::-1], lift / fall**2 * a[::-1]))
    if parts[-1].knots[-1] < 2.0 * math.pi * (1.0 - 1e-12):
        parts.append(constant(parts[-1].knots[-1], 2.0 * math.pi, 0.0))
    return joined(parts, periodic=True)


def geneva_curve(slots: int) -> Curve:
    """Angle of an external Geneva wheel by that of its crank; see `mechlab.analytic.geneva`. Raises MechlabError for fewer than 3 slots."""
    if slots < 3:
        raise MechlabError(f"Geneva wheel: expected at least 3 slots, got {slots}.")
    end, near = engaged_from(slots), -math.log(math.sin(math.pi / slots))
    a = _finer(end, near, SLOT_PIECES)
    b, v, w = slot_law(slots, a)
    return joined([hermite(a, -b, -v, -w), constant(end, 2.0 * math.pi - end, -float(b[-1]))], periodic=True)


def oval_curve(eccentricity: float) -> Curve:
    """Turn of an ellipse that rolls on an equal one, both about a focus, by the turn of this one: backwards, with
    tan(b / 2) = (1 + e) / (1 - e) tan(a / 2). Raises MechlabError for an eccentricity that is not from 0 to 0.9."""
    if not 0.0 <= eccentricity <= 0.9:
        raise MechlabError(f"oval gears: expected an eccentricity from 0 to 0.9, got {eccentricity!r}.")
    a = _finer(math.pi, -math.log(max(eccentricity, 0.05)), OVAL_PIECES)
    return hermite(a, *oval_law(eccentricity, a), periodic=True)


def in_a_second(name: str, law: tuple[np.ndarray, np.ndarray, np.ndarray]) -> dict[str, np.ndarray]:
    """The quantities of a joint that follows a law of the turn of another one, which turns once in 1 s."""
    return {name: law[0], f"{name}_rate": TURN * law[1], f"{name}_accel": TURN**2 * law[2]}


def _finer(end: float, near: float, pieces: int) -> np.ndarray:
    """Knots (pieces + 1,) from -end to end, finer about 0: for a law with poles at +- i near."""
    a = near * np.sinh(np.linspace(-1.0, 1.0, pieces + 1) * math.asinh(end / near))
    a[0], a[-1] = -end, end
    return np.asarray(a)


def oval_law(eccentricity: float, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Turn of the second ellipse and its derivatives by that of the first, (n,) [rad] from -pi to pi; 0 where the far end of the
    first touches the near end of the second. The ratio of the rates is r / (2 A - r), r the radius of the first."""
    e, a = eccentricity, np.asarray(turn, dtype=float)
    half = 0.5 * a
    b = 2.0 * np.arctan2((1.0 + e) * np.sin(half), (1.0 - e) * np.cos(half))
    d = 1.0 + e * e - 2.0 * e * np.cos(a)
    return -b, -(1.0 - e * e) / d, (1.0 - e * e) * 2.0 * e * np.sin(a) / d**2
