"""The one freedom of the three-gear four-bar: reduced inertia of the crank and the motion it has when it is let go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.gear_linkage.linkage import FloatArray, GearLinkage, motion


@dataclass(frozen=True)
class LinkageMasses:
    """Masses: uniform slender bars [kg/m] and uniform discs [kg/m2] for the three gears (gear a belongs to the crank)."""

    per_length: float
    per_area: float

    def disc(self, radius: float) -> tuple[float, float]:
        """Mass [kg] and moment about the axis [kg m2] of a gear of that pitch radius."""
        mass = self.per_area * np.pi * radius**2
        return float(mass), float(0.5 * mass * radius**2)


def reduced_inertia(g: GearLinkage, masses: LinkageMasses, crank_angle: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """J [kg m2] and dJ/d(crank angle): kinetic energy = J crank_rate^2 / 2. (...) -> (...), (...).

    J = J_crank + J_a + m_a crank^2 + (coupler and idler: m |v_G|^2 + J w^2) + J_rocker w_rocker^2 + J_d w_out^2, rates for
    a crank rate of 1.
    """
    phi = np.asarray(crank_angle, dtype=float)
    x = motion(g, phi)
    ra, rc, rd = g.radii
    (ma, ja), (mc, jc), (_, jd) = masses.disc(ra), masses.disc(rc), masses.disc(rd)
    m1, m2, m3 = (masses.per_length * length for length in (g.crank, g.coupler, g.rocker))
    inertia = np.full(phi.shape, m1 * g.crank**2 / 3.0 + ja + ma * g.crank**2)
    slope = np.zeros(phi.shape)
    turned, turned_rate = g.crank * _across(phi), g.crank * -_along(phi)
    for mass, moment, arm, w, e in (
        (m2, m2 * g.coupler**2 / 12.0, 0.5 * g.coupler, x.coupler_rate, x.coupler_accel),
        (mc, 0.0, g.coupler, x.coupler_rate, x.coupler_accel),
    ):
        v = turned + (arm * w)[..., None] * _across(x.coupler_angle)
        a = (
            turned_rate
            + (arm * e)[..., None] * _across(x.coupler_angle)
            - (arm * w**2)[..., None] * _along(x.coupler_angle)
        )
        inertia = inertia + mass * np.sum(v * v, axis=-1) + moment * w**2
        slope = slope + 2.0 * (mass * np.sum(v * a, axis=-1) + moment * w * e)
    for moment, w, e in (
        (jc, x.idler_rate, x.idler_accel),
        (m3 * g.rocker**2 / 3.0, x.rocker_rate, x.rocker_accel),
        (jd, x.output_rate, x.output_accel),
    ):
        inertia = inertia + moment * w**2
        slope = slope + 2.0 * moment * w * e
    return inertia, slope


def acceleration(
    g: GearLinkage, masses: LinkageMasses, crank_angle: ArrayLike, crank_rate: ArrayLike, torque: ArrayLike = 0.0
) -> FloatArray:
    """Crank acceleration [rad/s2] under a torque on the crank [N m]: J a + dJ/dphi w^2 / 2 = torque (Eksergian 1930)."""
    inertia, slope = reduced_inertia(g, masses, crank_angle)
    return np.asarray((np.asarray(torque, dtype=float) - 0.5 * slope * np.asarray(crank_rate) ** 2) / inertia)


def _along(angle: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _across(angle: FloatArray) -> FloatArray:
    return np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
