"""The Wolfrom train at a moving state in particles, and the checks on it."""

from __future__ import annotations

from mechlab.analytic import wolfrom as closed_form
from mechlab.catalog.wolfrom.build import build
from mechlab.catalog.wolfrom.parameters import Parameters
from mechlab.kit.epicyclic import RATE, mesh_check, moving_check, moving_disc, seats, train_state, wheel
from mechlab.kit.mass_check import State


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE, a flat disc of the radius of the planet axes. In `parts` one planet turns for all, the others
    ride on the carrier; in `minimal` all ride on it, with their mass, and all wheels turn as shafts, the planets on one."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    sun, _, ring, _, _ = p.all_teeth
    found = closed_form.speeds(p.all_teeth)
    w = {"sun": float(found.sun), "ring": float(found.ring)}
    spin = float(found.planet)
    turns = {"carrier": 1.0, **w} | {f"planet_{k + 1}": spin - 1.0 for k in range(rays or p.planets)}
    if not rays:
        rotors = p.J_sun * w["sun"] ** 2 + p.J_ring * w["ring"] ** 2 + p.planets * p.J_planet * spin**2
        turns["planet_1_spin"] = spin
        riding = p.planets * p.planet_mass
        carrier = wheel(2.0 * p.J_carrier / p.orbit**2 + riding, p.J_carrier + riding * p.orbit**2, RATE)
        return train_state(turns, carrier, rotors)
    parts = moving_disc(p.J_carrier + (p.planets - rays) * p.planet_mass * p.orbit**2, p.orbit, RATE)
    parts = parts + moving_disc(p.J_sun, 0.5 * p.module * sun, w["sun"] * RATE)
    parts = parts + moving_disc(p.J_ring, 0.5 * p.module * ring, w["ring"] * RATE)
    moment = p.J_planet * (p.planets if rays == 1 else 1)
    for at in seats(p.orbit, p.planets)[:rays]:
        parts = parts + wheel(p.planet_mass, moment, spin * RATE, at, RATE)
    return train_state(turns, parts)


MOVING = (moving_check("W5", build, state), mesh_check("W6", build, meshes=3, wheels=1))
