"""The planetary stage at a moving state in particles, and the checks on it."""

from __future__ import annotations

from mechlab.analytic import planetary_stage as closed_form
from mechlab.catalog.planetary_stage.build import build
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.kit.epicyclic import RATE, mesh_check, moving_check, moving_disc, seats, train_state, wheel
from mechlab.kit.mass_check import NOTHING, State

RING = 0.4
"""Speed of a free ring over that of the carrier."""


def state(p: Parameters, fidelity: str) -> State:
    """Carrier at TURN and RATE, a free ring at RING of that. Planets that are no bodies ride on the carrier, a flat disc of
    the radius of their axes; in `parts` one planet turns for all."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    free = p.ring == "free"
    sun, planet, ring = p.teeth
    found = closed_form.speeds(sun, ring, carrier=1.0, ring=RING if free else 0.0, planet_teeth=planet)
    w = {"carrier": 1.0, "sun": float(found.sun), "planet": float(found.planet), "ring": float(found.ring)}
    parts = moving_disc(p.J_carrier + (p.planets - rays) * p.planet_mass * p.orbit**2, p.orbit, RATE)
    moment = p.J_planet * (p.planets if rays == 1 else 1)
    places = seats(p.orbit, p.planets)[:rays]
    parts = sum((wheel(p.planet_mass, moment, w["planet"] * RATE, at, RATE) for at in places), NOTHING) + parts
    turns = {n: w[n] for n in (("carrier", "sun", "ring") if free else ("carrier", "sun"))}
    turns |= {f"planet_{k + 1}": w["planet"] - 1.0 for k in range(rays or p.planets)}
    rotors = 0.0
    if rays or free:  # in `minimal` a free sun is the second body
        parts = parts + moving_disc(p.J_sun, 0.5 * p.module * sun, w["sun"] * RATE)
    else:
        rotors += p.J_sun * w["sun"] ** 2
    if rays and free:
        parts = parts + moving_disc(p.J_ring, 0.5 * p.module * ring, w["ring"] * RATE)
    if not rays:
        rotors += p.planets * p.J_planet * w["planet"] ** 2 + (p.J_ring * w["ring"] ** 2 if free else 0.0)
        turns |= {f"planet_{k + 1}_spin": w["planet"] for k in range(p.planets)} | {"sun_on_carrier": w["sun"] - 1.0}
    return train_state(turns, parts, rotors, freedoms=2 if free else 1)


MOVING = (moving_check("P6", build, state), mesh_check("P7", build, meshes=2, wheels=1))
