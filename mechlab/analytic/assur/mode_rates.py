"""Rates and accelerations of a class III or IV group in a given mode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.analytic.assur.plane import Complex, Flags, Real, Scalar, cross, dot
from mechlab.analytic.assur.two_loops import TwoLoops, closure_jacobian

SINGULAR = 1e-12


@dataclass(frozen=True)
class GroupMotion:
    """theta_t, theta_u with rates and accelerations; det J; links: the closing links z (2, ...), with rates as Scalars.

    Where |det J| is below 1e-12 of the fourth power of the group's size, two modes merge and rates are NaN.
    """

    theta_t: Scalar
    theta_u: Scalar
    det: Real
    z: Complex
    links: tuple[Scalar, Scalar]
    regular: Flags


def mode_rates(group: TwoLoops, theta_t: Real, theta_u: Real) -> GroupMotion:
    """J (w_t, w_u) = -Re conj(z) wd;  J (e_t, e_u) = -Re conj(z)(wdd - p t w_t^2 - q u w_u^2) - |zd|^2."""
    a, b, c, d, z = closure_jacobian(group, theta_t, theta_u)
    _, pt, qu = group.z(theta_t, theta_u)
    det = a * d - b * c
    regular = np.abs(det) > SINGULAR * group.scale**2
    by = 1.0 / np.where(regular, det, np.nan)
    f = -dot(z, group.wd)
    wt, wu = (d * f[0] - b * f[1]) * by, (a * f[1] - c * f[0]) * by
    zd = group.wd + 1j * (pt * wt + qu * wu)
    rest = group.wdd - pt * wt**2 - qu * wu**2
    g = -dot(z, rest) - dot(zd, zd)
    et, eu = (d * g[0] - b * g[1]) * by, (a * g[1] - c * g[0]) * by
    zdd = rest + 1j * (pt * et + qu * eu)
    square = group.l**2
    turn = [Scalar(np.angle(z[i]), cross(z[i], zd[i]) / square[i], cross(z[i], zdd[i]) / square[i]) for i in (0, 1)]
    t, u = np.broadcast_arrays(np.asarray(theta_t, dtype=float), np.asarray(theta_u, dtype=float))
    return GroupMotion(Scalar(t, wt, et), Scalar(u, wu, eu), det, z, (turn[0], turn[1]), np.asarray(regular))
