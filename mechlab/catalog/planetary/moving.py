"""The series-planet gear at a moving state in particles, and the checks on it."""

from __future__ import annotations

from mechlab.catalog.planetary.build import build
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.kit.epicyclic import RATE, mesh_check, moving_check, moving_disc, seats, train_state, wheel
from mechlab.kit.mass_check import NOTHING, State


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE. Planets that are no bodies ride on the carrier, a flat disc as wide as its outer circle; in
    `minimal` all wheels turn as shafts, in `parts` one ray turns for all."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    per_turn = {name: float(x) for name, x in p.rates.items()}
    radii = dict(zip((2, 3), p.radii, strict=True))
    masses, moments = {2: p.mass_2, 3: p.mass_3}, {2: p.J_planet_2, 3: p.J_planet_3}
    riding = (p.planets - rays) * sum(masses[n] * radii[n] ** 2 for n in (2, 3))
    parts = moving_disc(p.J_carrier + riding, radii[3], RATE)
    turns = {"carrier": 1.0, "sun": per_turn["sun"]}
    rotors = 0.0
    if rays:
        parts = parts + moving_disc(p.J_sun, 0.5 * p.module * p.teeth[0], per_turn["sun"] * RATE)
    else:
        rotors = p.J_sun * per_turn["sun"] ** 2
    for n in (2, 3):
        spin = per_turn[f"planet_{n}"]
        moment = moments[n] * (p.planets if rays == 1 else 1)
        places = seats(radii[n], p.planets)[:rays]
        parts = sum((wheel(masses[n], moment, spin * RATE, at, RATE) for at in places), NOTHING) + parts
        turns |= {f"planet_{n}_{k + 1}": spin - 1.0 for k in range(rays or p.planets)}
        if not rays:
            turns |= {f"planet_{n}_{k + 1}_spin": spin for k in range(p.planets)}
            rotors += p.planets * moments[n] * spin**2
    return train_state(turns, parts, rotors)


MOVING = (moving_check("S6", build, state), mesh_check("S7", build, meshes=3, wheels=2))
