"""The five dyads (class II groups) in closed form, with assembly mode, transmission angle and gap.

RRR: two links between two moving pins. RRP: a rod and a slider on a moving guide. RPR: a slotted link through a moving pin.
PRP: a pin where two moving guides cross. RPP: a cross slide between a guide and a pin.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.plane import Complex, Flags, Guide, Point, Real, Scalar, cross, dot, length, mode_sign, unit
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass


class ChangePoint(MechlabError):
    """Two assembly modes meet at the drive position `at`: either may follow; none is chosen silently (exit code 3)."""

    exit_code = 3

    def __init__(self, message: str, at: float) -> None:
        super().__init__(message)
        self.at = at


@dataclass(frozen=True)
class Dyad:
    """Solution of a dyad, all arrays of one shape.

    joint: the inner joint (of RPR: the pin of the slider). angles: of its turning links; slides: along its guides.
    quality: sine of the transmission angle, signed; 0 at a dead centre, where rates do not exist and are NaN.
    discriminant: quality squared, negative where the group does not assemble; there its motion is NaN.
    gap [m]: how far the lengths are from meeting, 0 where they meet.
    """

    kind: str
    joint: Point
    angles: tuple[Scalar, ...]
    slides: tuple[Scalar, ...]
    quality: Real
    discriminant: Real
    gap: Real

    @property
    def assembles(self) -> Flags:
        """True where the dyad assembles."""
        return np.asarray(self.discriminant >= 0.0)

    @property
    def regular(self) -> Flags:
        """True where the dyad assembles away from a dead centre, so that rates exist."""
        return np.asarray(np.abs(self.quality) > DEAD)

    def require(self) -> Dyad:
        """The dyad itself; raises NoSolution where it does not assemble or rates do not exist, with the largest gap."""
        if not np.all(self.assembles):
            raise NoSolution(
                f"dyad {self.kind}: no assembly exists at {np.count_nonzero(~self.assembles)} of {self.assembles.size} "
                f"positions; the largest gap is {np.max(self.gap):.6g} m. Change the lengths or the range of the input."
            )
        if not np.all(self.regular):
            raise NoSolution(
                f"dyad {self.kind}: dead centre at {np.count_nonzero(~self.regular)} positions (sine of the transmission "
                f"angle below {DEAD:g}); rates do not exist there. Keep away from the limit positions."
            )
        return self


DEAD = 1e-9
"""Below this sine of the transmission angle the inputs do not determine the rates in double precision."""


def divisor(quality: Real, value: Real) -> Real:
    """`value` as a divisor: NaN at a dead centre, so that no rate is invented there."""
    if np.min(np.abs(quality), initial=1.0) > DEAD:
        return value
    return np.where(np.abs(quality) > DEAD, value, np.nan)


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


def rrr(first: Point, second: Point, l1: ArrayLike, l2: ArrayLike, mode: ArrayLike = 1) -> Dyad:
    """Inner joint B of links l1 = |B - first| and l2 = |B - second|; angles run first -> B and second -> B.

    A = first, C = second, d = C - A, x = (d^2 + l1^2 - l2^2)/(2 d^2), B = A + (x + i K y) d, y^2 = l1^2/d^2 - x^2.
    mode K = +1: B lies left of the line from A to C, so that the triangle A, B, C runs clockwise. Rates from
    r_A.(v_B - v_A) = 0 and r_C.(v_B - v_C) = 0. quality = K |r_A x r_C|/(l1 l2), the sine of the angle at B.
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
    distance = cross(w, u)
    disc = 1.0 - (distance / l) ** 2
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
    gap = np.maximum(np.abs(distance) - l, 0.0)
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
