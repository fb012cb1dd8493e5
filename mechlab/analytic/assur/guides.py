"""Dyads with two sliding joints: PRP (a pin where two moving guides cross) and RPP (a cross slide carried by a pin)."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.assur.dyads import DEAD, Dyad, divisor
from mechlab.analytic.assur.plane import Complex, Guide, Point, Real, Scalar, cross, unit
from mechlab.errors import MechlabError


def prp(first: Guide, second: Guide) -> Dyad:
    """The pin where two moving guides cross: Q1 + h1 n1 + s1 u1 = Q2 + h2 n2 + s2 u2. One solution.

    slides: s1, s2; quality = u1 x u2, the sine of the angle between the guides.
    """
    u1, u2 = unit(first.angle.x), unit(second.angle.x)
    quality = cross(u1, u2)
    by = 1.0 / divisor(quality, quality)
    f1, f2 = first.at.p + first.offset * 1j * u1, second.at.p + second.offset * 1j * u2
    s1, s2 = _split(f2 - f1, u1, u2, by)
    b = f1 + s1 * u1
    v1, v2 = _carried(first, b), _carried(second, b)
    ds1, ds2 = _split(v2 - v1, u1, u2, by)
    a1, a2 = _bent(first, b, u1, ds1), _bent(second, b, u2, ds2)
    dds1, dds2 = _split(a2 - a1, u1, u2, by)
    joint = Point(b, v1 + ds1 * u1, a1 + dds1 * u1)
    slides = (Scalar(s1, ds1, dds1), Scalar(s2, ds2, dds2))
    return Dyad("PRP", joint, (), slides, quality, _disc(quality), np.zeros(np.shape(quality)))


def rpp(pin: Point, guide: Guide, angle: float) -> Dyad:
    """A cross slide between a guide and a pin: pin = Q + h n + s1 e(psi) + s2 e(psi + angle), `angle` a constant.

    slides: s1 along the guide, s2 along the cross slot. quality = sin(angle). Raises MechlabError for parallel slots.
    """
    if not abs(math.sin(angle)) > DEAD:
        raise MechlabError(f"RPP: the slots are parallel (angle {angle!r} rad); expected an angle away from 0 and pi.")
    psi = guide.angle
    u1, u2 = unit(psi.x), unit(psi.x + angle)
    quality = np.full(np.shape(u1 * pin.p), math.sin(angle))
    by = 1.0 / quality
    arm = pin.p - guide.at.p
    s1, s2 = _split(arm - guide.offset * 1j * u1, u1, u2, by)
    s2 = -s2
    rest = pin.v - guide.at.v - 1j * psi.v * arm
    ds1, ds2 = _split(rest, u1, u2, by)
    ds2 = -ds2
    slip = 2.0 * psi.v * 1j * (ds1 * u1 + ds2 * u2)
    rest = pin.a - guide.at.a - (1j * psi.a - psi.v**2) * arm - slip
    dds1, dds2 = _split(rest, u1, u2, by)
    slides = (Scalar(s1, ds1, dds1), Scalar(s2, ds2, -dds2))
    return Dyad("RPP", pin, (), slides, quality, quality**2, np.zeros(np.shape(quality)))


def _split(d: Complex, u1: Complex, u2: Complex, by: Real) -> tuple[Real, Real]:
    """s1, s2 of d = s1 u1 - s2 u2."""
    return cross(d, u2) * by, cross(d, u1) * by


def _carried(guide: Guide, b: Complex) -> Complex:
    return guide.at.v + 1j * guide.angle.v * (b - guide.at.p)


def _bent(guide: Guide, b: Complex, u: Complex, ds: Real) -> Complex:
    turn = guide.angle
    return guide.at.a + (1j * turn.a - turn.v**2) * (b - guide.at.p) + 2j * turn.v * ds * u


def _disc(quality: Real) -> Real:
    return np.where(np.abs(quality) > DEAD, quality**2, -1.0)
