"""Dyads with one sliding joint: RRP (rod and slider on a moving guide) and RPR (a slotted link through a moving pin)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.dyads import Dyad, divisor
from mechlab.analytic.assur.plane import Guide, Point, Scalar, cross, dot, length, mode_sign, unit


def rrp(pin: Point, guide: Guide, rod: ArrayLike, mode: ArrayLike = 1) -> Dyad:
    """Joint B of a rod from `pin` to a slider on a guide that may move: B = Q + h n + s u, |B - pin| = rod.

    s = -w.u + K sqrt(rod^2 - (w x u)^2), w = Q + h n - pin. mode K = +1: the slider that lies farther along the guide.
    angles: of the rod; slides: s. quality = r.u / rod, with r the rod.
    """
    l, sign = length(rod, "RRP: rod"), mode_sign(mode, "RRP")
    u = unit(guide.angle.x)
    n = 1j * u
    foot = guide.at.p + guide.offset * n
    w = foot - pin.p
    away = cross(w, u)
    disc = 1.0 - (away / l) ** 2
    root = sign * l * np.sqrt(np.where(disc >= 0.0, disc, np.nan))
    s = root - dot(w, u)
    b = foot + s * u
    arm, r = b - guide.at.p, b - pin.p
    quality = root / l
    by = 1.0 / divisor(quality, root)  # r.u is the root itself
    psi = guide.angle
    tv = guide.at.v + 1j * psi.v * arm
    ds = dot(r, pin.v - tv) * by
    v = tv + ds * u
    ta = guide.at.a + (1j * psi.a - psi.v**2) * arm + 2.0 * psi.v * ds * n
    rel = v - pin.v
    dds = (dot(r, pin.a - ta) - dot(rel, rel)) * by
    a = ta + dds * u
    turn = Scalar(np.angle(r), cross(r, rel) / l**2, cross(r, a - pin.a) / l**2)
    gap = np.maximum(np.abs(away) - l, 0.0)
    return Dyad("RRP", Point(b, v, a), (turn,), (Scalar(s, ds, dds),), quality, disc, gap)


def rpr(pivot: Point, pin: Point, offset: float = 0.0, mode: ArrayLike = 1) -> Dyad:
    """A link about `pivot` whose straight slot, `offset` to the left of its pivot, guides `pin`.

    pin = pivot + s e(th) + h n(th): s = K sqrt(d^2 - h^2), th = arg(d) - atan2(h, s), with the signed s. angles: th;
    slides: s. quality = s / |d|. mode K = +1: the pin lies ahead of the pivot.
    """
    sign = mode_sign(mode, "RPR")
    d = pin.p - pivot.p
    d2 = dot(d, d)
    f = np.sqrt(d2)
    safe = np.where(d2 > 0.0, d2, 1.0)
    disc = np.where(d2 > 0.0, 1.0 - offset**2 / safe, -1.0)
    s = sign * np.sqrt(np.where(disc >= 0.0, d2 - offset**2, np.nan))
    quality = s / np.sqrt(safe)
    by = 1.0 / divisor(quality, s)
    th = np.angle(d) - np.arctan2(offset, s)
    u = unit(th)
    n = 1j * u
    dd, ddd = pin.v - pivot.v, pin.a - pivot.a
    w = dot(n, dd) * by
    ds = dot(u, dd) + offset * w
    eps = (dot(n, ddd) - 2.0 * ds * w + offset * w**2) * by
    dds = dot(u, ddd) + s * w**2 + offset * eps
    gap = np.maximum(np.abs(offset) - f, 0.0)
    where = np.where(disc >= 0.0, pin.p, np.nan)
    return Dyad("RPR", Point(where, pin.v, pin.a), (Scalar(th, w, eps),), (Scalar(s, ds, dds),), quality, disc, gap)
