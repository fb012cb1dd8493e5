"""Teeth of epicyclic trains: what lets equal planets be put in at equal angles, and the phases at which their teeth mesh.

A phase [rad] is that of `mechlab.shapes`: the turn of a gear about its own axis. The sun stands at phase 0.
"""

from __future__ import annotations

import math

from mechlab.analytic.planetary_stage import conditions
from mechlab.errors import MechlabError
from mechlab.shapes import external_phase, internal_phase


def azimuth(k: int, planets: int) -> float:
    """Angle [rad] of the axis of planet k about the sun: 2 pi k / planets."""
    return 2.0 * math.pi * k / planets


def azimuths(planets: int) -> tuple[float, ...]:
    """Angles [rad] of the axes of all planets."""
    return tuple(azimuth(k, planets) for k in range(planets))


def require_common_axes(what: str, sun: int, planet: int, ring: int, planets: int, ring_name: str = "ring") -> None:
    """Raises MechlabError unless sun and ring hold the planets at one centre distance: ring = sun + 2 planet."""
    if not conditions(sun, planet, ring, planets).coaxial:
        raise MechlabError(f"{what}: the axes do not align; the {ring_name} needs {sun + 2 * planet} teeth.")


def require_equal_angles(what: str, planets: int, total: int, reason: str) -> None:
    """Raises MechlabError, which ends with the `reason`, unless `total` / planets is whole.

    total: teeth of the two central gears that the planets mesh with, so that each planet finds a tooth where it needs one.
    """
    if total % planets:
        raise MechlabError(f"{what}: {planets} planets cannot stand at equal angles: {reason}.")


def require_room(what: str, sun: int, planet: int, ring: int, planets: int) -> None:
    """Raises MechlabError where the tip circles of two neighbours overlap: (sun + planet) sin(pi / planets) < planet + 2."""
    if not conditions(sun, planet, ring, planets).neighbours:
        raise MechlabError(f"{what}: {planets} planets of {planet} teeth overlap; take fewer planets or smaller ones.")


def ring_phase(sun: int, planet: int, ring: int) -> float:
    """Phase [rad] of a ring about planets that mesh with a sun."""
    return internal_phase(planet, external_phase(sun, 0.0, planet, 0.0), ring, 0.0)


def stepped_planet_turn(what: str, teeth: tuple[int, int, int, int], planets: int, k: int) -> float:
    """Angle [rad] of stepped planet k relative to planet 0 at which both its gears mesh; all planets are alike.

    teeth: sun, gear 1 of the planet, which meshes with the sun and a held ring, gear 2 and its output ring. Tries every tooth
    of the first mesh. Raises MechlabError when none fits the second: no identical planets assemble.
    """
    sun, first, second, output = teeth
    start, a = external_phase(sun, 0.0, first, 0.0), azimuth(k, planets)
    pitch = 2.0 * math.pi / output
    zero = internal_phase(second, 0.0, output, 0.0)
    for j in range(first):
        turn = external_phase(sun, 0.0, first, a) - start + 2.0 * math.pi * j / first
        gap = (internal_phase(second, turn, output, a) - zero) / pitch
        if abs(gap - round(gap)) < 1e-6:
            return turn
    raise MechlabError(
        f"{what}: planet {k + 1} of {planets} alike planets fits the held ring but not the output ring; "
        "choose ring_1 - ring_2 a multiple of the number of planets (planet gears of equal teeth)."
    )
