"""Stepped planets that are made alike: do both their gears mesh in every place?"""

from __future__ import annotations

import math

from mechlab.errors import MechlabError
from mechlab.kit.epicyclic import azimuth
from mechlab.shapes import external_phase, internal_phase

Teeth = tuple[int, int, int, int, int]
"""Sun, planet 1, held ring, planet 2, output ring."""


def planet_turn(teeth: Teeth, planets: int, k: int) -> float:
    """How far planet k is turned against planet 0 so that both its gears mesh [rad]; planets are made alike.

    Tries every tooth of the first mesh. Raises MechlabError when none fits the second: the planets cannot be alike.
    """
    sun, first, _, second, ring = teeth
    start, a = external_phase(sun, 0.0, first, 0.0), azimuth(k, planets)
    pitch = 2.0 * math.pi / ring
    zero = internal_phase(second, 0.0, ring, 0.0)
    for j in range(first):
        turn = external_phase(sun, 0.0, first, a) - start + 2.0 * math.pi * j / first
        gap = (internal_phase(second, turn, ring, a) - zero) / pitch
        if abs(gap - round(gap)) < 1e-6:
            return turn
    raise MechlabError(
        f"wolfrom: teeth = {teeth}: planet {k + 1} of {planets} alike planets fits the held ring but not the output ring; "
        "choose ring_1 - ring_2 a multiple of the number of planets (planet gears of equal teeth)."
    )
