"""Dyad RRR: two links between two moving pins."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.dyads import Dyad, divisor
from mechlab.analytic.assur.plane import Point, Scalar, dot, length, mode_sign


def rrr(first: Point, second: Point, l1: ArrayLike, l2: ArrayLike, mode: ArrayLike = 1) -> Dyad:
    """Inner joint B of links l1 = |B - first| and l2 = |B - second|; angles run first -> B and second -> B.

    d = C - A, x = (d^2 + l1^2 - l2^2)/(2 d^2), B = A + (x + i K y) d, y^2 = l1^2/d^2 - x^2. mode K = +1: B lies left of
    the way from first to second, which is the triangle A, B, C passed clockwise. Rates from r_A.(v_B - v_A) = 0 and
    r_C.(v_B - v_C) = 0. quality = K |r_A x r_C|/(l1 l2), the sine of the angle at B.
    """
    a, c = length(l1, "RRR: l1"), length(l2, "RRR: l2")
    sign = mode_sign(mode, "RRR")
    d = second.p - first.p
    d2 = dot(d, d)
    safe = np.where(d2 > 0.0, d2, 1.0) if np.min(d2, initial=1.0) <= 0.0 else d2
    inverse = 0.5 / safe
    x = (safe + (a - c) * (a + c)) * inverse
    # Heron's product keeps its digits where both links are nearly in line.
    f = np.sqrt(d2)
    heron = (a + c - f) * (a + c + f) * (f - (a - c)) * (f + (a - c))
    disc = heron / (4.0 * a * a * c * c)
    if np.min(heron, initial=1.0) < 0.0 or np.min(d2, initial=1.0) <= 0.0:
        heron = np.where((heron >= 0.0) & (d2 > 0.0), heron, np.nan)
        disc = np.where(d2 > 0.0, disc, -1.0)
    y = sign * np.sqrt(heron) * inverse
    turned = np.empty(np.shape(y), dtype=complex)
    turned.real, turned.imag = x, y
    r1 = turned * d
    r2 = r1 - d
    det = y * d2  # r1 x r2
    quality = det / (a * c)
    by = 1.0 / divisor(quality, det)
    u = second.v - first.v
    w1, w2 = dot(r2, u) * by, dot(r1, u) * by
    k1, k2 = w1 * w1, w2 * w2
    g = second.a - first.a + k1 * r1 - k2 * r2
    e1, e2 = dot(r2, g) * by, dot(r1, g) * by
    joint = Point(first.p + r1, first.v + 1j * w1 * r1, first.a + (1j * e1 - k1) * r1)
    gap = np.maximum(np.maximum(f - (a + c), np.abs(a - c) - f), 0.0)
    return Dyad("RRR", joint, (Scalar(np.angle(r1), w1, e1), Scalar(np.angle(r2), w2, e2)), (), quality, disc, gap)
