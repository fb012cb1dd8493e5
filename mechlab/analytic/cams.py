"""Motion laws of cams, and the contour of a disc cam with a roller follower that moves through its centre.

Laws s(u) rise from 0 to 1 over u from 0 to 1, with s' = 0 at both ends (Norton, Cam Design and Manufacturing Handbook, chapter 2):

    cycloidal    u - sin(2 pi u) / 2 pi                    s'' smooth, 0 at the ends
    poly345      10 u^3 - 15 u^4 + 6 u^5                   s'' = 0 at the ends
    poly4567     35 u^4 - 84 u^5 + 70 u^6 - 20 u^7         s'' = s''' = 0 at the ends
    harmonic     (1 - cos(pi u)) / 2                       s'' jumps at the ends, from and to a dwell
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Law = tuple[Array, Array, Array]
LAWS = ("cycloidal", "poly345", "poly4567", "harmonic")
_POLYNOMIALS = {"poly345": (0, 0, 0, 10, -15, 6), "poly4567": (0, 0, 0, 0, 35, -84, 70, -20)}
PEAKS = {
    "cycloidal": (2.0, 2.0 * np.pi, 0.25), "poly345": (1.875, 10.0 / 3.0**0.5, 0.5 - 3.0**0.5 / 6.0),
    "poly4567": (2.1875, 84.0 / 5.0**1.5, 0.5 - 5.0**0.5 / 10.0), "harmonic": (0.5 * np.pi, 0.5 * np.pi**2, 0.0),
}  # fmt: skip
"""s' of the laws in their middle, their largest s'', and where: the next derivative is 0 there; of the harmonic law at its ends."""


def rise_law(name: str, u: ArrayLike) -> Law:
    """s, s' and s'' of one of LAWS at u (n,) from 0 to 1. Raises KeyError for another name."""
    u = np.asarray(u, dtype=float)
    if name == "cycloidal":
        t = 2.0 * np.pi * u
        return u - np.sin(t) / (2.0 * np.pi), 1.0 - np.cos(t), 2.0 * np.pi * np.sin(t)
    if name == "harmonic":
        t = np.pi * u
        return 0.5 - 0.5 * np.cos(t), 0.5 * np.pi * np.sin(t), 0.5 * np.pi**2 * np.cos(t)
    s = Polynomial(_POLYNOMIALS[name])
    return s(u), s.deriv()(u), s.deriv(2)(u)


def rise_and_fall(name: str, turn: ArrayLike, lift: float, rise: float, top: float, fall: float) -> Law:
    """Lift [m], and its first and second derivatives by the turn of the cam (n,) [rad]: a rise, a dwell at the top, a fall with the same
    law, a dwell at the bottom for the rest of the turn; rise, top, fall [rad]."""
    x = np.mod(np.asarray(turn, dtype=float), 2.0 * np.pi)
    up, down = x <= rise, (x >= rise + top) & (x <= rise + top + fall)
    s, v, a = (np.where(x < rise + top, lift, 0.0), np.zeros(x.shape), np.zeros(x.shape))
    for where, u, sign, width in ((up, x / rise, 1.0, rise), (down, 1.0 - (x - rise - top) / fall, -1.0, fall)):
        f, g, h = rise_law(name, np.where(where, u, 0.0))
        s = np.where(where, lift * f, s)
        v = np.where(where, sign * lift / width * g, v)
        a = np.where(where, lift / width**2 * h, a)
    return s, v, a


def roller_contour(turn: ArrayLike, lift: ArrayLike, slope: ArrayLike, base: float, roller: float) -> Array:
    """(n, 2) contour of the disc cam [m] in its own axes, for a roller of radius `roller` whose centre stands at base + roller + lift on
    the axis +y when the cam has turned by `turn`: the envelope of the roller, inside of the path of its centre.

    In the cam the centre is at z = r e^(i (pi/2 - turn)), r = base + roller + lift; the contour is z - roller n, n the outward normal
    (r + i slope) e^(i (pi/2 - turn)) / |.|. The pressure angle has the tangent slope / r.
    """
    t, r, v = (np.asarray(x, dtype=float) for x in (turn, np.asarray(lift) + base + roller, slope))
    direction = np.exp(1j * (0.5 * np.pi - t))
    normal = (r + 1j * v) * direction / np.abs(r + 1j * v)
    z = r * direction - roller * normal
    return np.column_stack([z.real, z.imag])
