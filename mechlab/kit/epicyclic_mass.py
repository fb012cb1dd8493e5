"""Epicyclic trains as particles: the moving states that checks of masses, momenta, energy and power compare with.

What the planets weigh on the carrier and about their own axes is written here once more: the check must not take it from
the bodies that it checks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.experiment.entry import Check
from mechlab.kit.checks import moving_in_fidelities
from mechlab.kit.epicyclic_build import FIDELITIES, Planets
from mechlab.kit.mass_check import Particles, State, solid, spread_of
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism

TURN, RATE = 0.7, 1.3
"""Angle [rad] and rate [rad/s] of the carrier in the moving state of a train; the gear ratios give the other members."""


def wheel(
    mass: float, moment: float, rate: float, at: ArrayLike = (0.0, 0.0, 0.0), orbit_rate: float = 0.0
) -> Particles:
    """A flat part of revolution as particles: mass [kg], `moment` about its axis [kg m2], turning at `rate` [rad/s].

    Its axis is parallel to z through `at` (3,) [m], and orbits about z at `orbit_rate` [rad/s].
    """
    centre = np.asarray(at, dtype=float)
    velocity = orbit_rate * np.array([-centre[1], centre[0], 0.0])
    spread = spread_of(mass, (0.5 * moment, 0.5 * moment, moment))
    return solid(mass, centre, spread, velocity=velocity, turn=(0.0, 0.0, rate))


def moving_disc(moment: float, radius: float, rate: float) -> Particles:
    """A uniform flat disc about the z axis as particles; mass = 2 moment / radius^2."""
    return wheel(2.0 * moment / radius**2, moment, rate)


def moving_carrier(moment: float, radius: float, planets: Iterable[Planets], bodies: int) -> Particles:
    """A carrier of this moment [kg m2], turning at RATE: a flat disc, on which the planets that are no bodies ride."""
    riding = sum((len(x.angles) - bodies) * x.mass * x.orbit**2 for x in planets)
    return moving_disc(moment + riding, radius, RATE)


@dataclass(frozen=True)
class CentralWheel:
    """A gear about the z axis: its moment [kg m2], its radius [m], its turns for one turn of the carrier. It is a flat disc or,
    where it is no body, a shaft without mass."""

    moment: float
    radius: float
    turns: float
    is_body: bool


def train_state(
    carrier: Particles,
    wheels: Mapping[str, CentralWheel],
    planets: Mapping[Planets, float],
    bodies: int,
    freedoms: int = 1,
    joints: Mapping[str, float] | None = None,
) -> State:
    """The moving state of a train without gravity and springs, its carrier at TURN and RATE.

    planets: planets of a circle -> turns of each for one turn of the carrier; `bodies` of them are bodies, a single one stands
    for all, none: all are shafts. joints: turns of joints that are named otherwise.
    """
    turns = {"carrier": 1.0} | {name: x.turns for name, x in wheels.items()} | dict(joints or {})
    particles, rotors = carrier, 0.0
    for x in wheels.values():
        if x.is_body:
            particles = particles + moving_disc(x.moment, x.radius, x.turns * RATE)
        else:
            rotors += x.moment * x.turns**2
    for group, spin in planets.items():
        count = len(group.angles)
        moment = group.moment * (count if bodies == 1 else 1)
        parts = (wheel(group.mass, moment, spin * RATE, group.axis(k, TURN), RATE) for k in range(bodies))
        particles = sum(parts, particles)
        turns |= dict.fromkeys(group.names, spin - 1.0)
        if not bodies:
            turns |= {f"{name}_spin": spin for name in group.names}
            rotors += count * group.moment * spin**2
    angles, rates = ({n: x * c for n, c in turns.items()} for x in (TURN, RATE))
    return State(angles, rates, particles, {}, (0.0, 0.0, 0.0), freedoms, 0.5 * rotors * RATE**2)


def moving_check(name: str, build: Callable[[Any, str], Mechanism], state: Callable[[Any, str], State | None]) -> Check:
    """The check of a moving state as particles, in every fidelity."""
    return moving_in_fidelities(name, build, state, FIDELITIES)
