"""The Wolfrom train: a sun drives stepped planets; ring 1 is held, ring 2 is the output, the carrier is free.

Teeth z_s, z_p1, z_r1 (sun, first planet gear, held ring), z_p2, z_r2 (second planet gear, output ring). All rates are
absolute, about the common axis. Source: Wolfrom 1912; Mueller 1998, Die Umlaufgetriebe.
"""

from __future__ import annotations

from fractions import Fraction

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class WolfromSpeeds:
    """Rates of sun, ring 2 and planets (absolute) for a carrier rate of 1, exact."""

    sun: Fraction
    ring: Fraction
    planet: Fraction


def speeds(teeth: tuple[int, int, int, int, int]) -> WolfromSpeeds:
    """Willis twice: z_s (w_s - 1) = -z_r1 (0 - 1); w_p - 1 = -z_r1 / z_p1; z_r2 (w_r2 - 1) = z_p2 (w_p - 1)."""
    sun, planet_1, ring_1, planet_2, ring_2 = teeth
    spin = -Fraction(ring_1, planet_1)
    return WolfromSpeeds(1 + Fraction(ring_1, sun), 1 + spin * Fraction(planet_2, ring_2), 1 + spin)


def ratio(teeth: tuple[int, int, int, int, int]) -> Fraction:
    """w_sun / w_ring2 = (1 + z_r1 / z_s) / (1 - z_r1 z_p2 / (z_p1 z_r2)).

    Raises MechlabError when the output stands still (z_r1 z_p2 = z_p1 z_r2).
    """
    found = speeds(teeth)
    if found.ring == 0:
        raise MechlabError(
            f"teeth = {teeth}: the output ring stands still; ring_1 / planet_1 must differ from ring_2 / planet_2."
        )
    return found.sun / found.ring


def reflected_inertia(
    teeth: tuple[int, int, int, int, int],
    planets: int,
    sun: float,
    ring: float,
    carrier: float,
    planet: float,
    orbiting: float,
) -> float:
    """J of T = J w_sun^2 / 2 [kg m2]: J_s + [J_c + N (m R^2 + J_p w_p^2) + J_r w_r^2] / w_s^2, rates for w_c = 1.

    ring: the output ring 2; planet: one about its own axis; orbiting: m R^2 of one planet. All in kg m2.
    """
    w = speeds(teeth)
    held = carrier + planets * (orbiting + planet * float(w.planet) ** 2) + ring * float(w.ring) ** 2
    return sun + held / float(w.sun) ** 2
