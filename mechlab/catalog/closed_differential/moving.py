"""The closed differential at a moving state in particles, and the checks on it."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import build
from mechlab.catalog.closed_differential.looks import GAP, WIDTH
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.kit.epicyclic import TURN, mesh_check, moving_check, wheel
from mechlab.kit.mass_check import NOTHING, State
from mechlab.mechanism.geometry import Array

SPEEDS = (1.3, -0.6)
"""Speeds of both carriers [rad/s]; those of the blocks where both carriers turn as one."""


def state(p: Parameters, fidelity: str) -> State | None:
    """Every member has turned by TURN x its speed. The mass of a carrier or block stands at the radius of the planet axes on
    H1 (a carrier's on its own); planets that are no bodies ride on it; in `parts` one planet a stage turns for all."""
    rays = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    if not (p.train.regular or rays):
        return None
    named = ("w_H1", "w_H2") if p.train.regular else ("w1", "w3")
    x = closed.speeds(p.train, **dict(zip(named, SPEEDS, strict=True)))
    rates = {"H1": float(x.w_H1), "H2": float(x.w_H2), "block_14": float(x.w1), "block_36": float(x.w3)}
    spins = {"planet_2": float(x.w2), "planet_5": float(x.w5)}
    parts, energy = NOTHING, 0.0
    for stage, kind, bare, mass, spin in ((1, "planet_2", p.J_H1, p.m2, p.J2), (2, "planet_5", p.J_H2, p.m5, p.J5)):
        carrier, radius = rates[f"H{stage}"], p.radii[stage - 1]
        moment = bare + (p.planets - rays) * mass * radius**2
        parts = parts + wheel(moment / radius**2, moment, carrier)
        own = spin * (p.planets if rays == 1 else 1)
        for k in range(rays):
            at = _seat(p, stage, k, TURN * carrier)
            parts = parts + wheel(mass, own, spins[kind], at, carrier)
            rates[f"{kind}_{k + 1}"] = spins[kind] - carrier
        rates[f"{kind}_spin"] = spins[kind]
        energy += 0.0 if rays else 0.5 * p.planets * spin * spins[kind] ** 2
    for block, moment in (("block_14", p.J14), ("block_36", p.J36)):
        if rays:
            parts = parts + wheel(moment / p.radii[0] ** 2, moment, rates[block])
        else:
            energy += 0.5 * moment * rates[block] ** 2
    rates["H2_on_H1"] = rates["H2"] - rates["H1"]
    return State({n: TURN * w for n, w in rates.items()}, rates, parts, {}, (0.0, 0.0, 0.0), 2, energy)


def _seat(p: Parameters, stage: int, k: int, turned: float) -> Array:
    """Where planet k stands: at the place nearest to equal spacing at which its teeth fit, in the plane of its stage."""
    sun, ring = (p.teeth[0], p.teeth[2]) if stage == 1 else (p.teeth[3], p.teeth[5])
    angle = 2.0 * math.pi * round(k * (sun + ring) / p.planets) / (sun + ring) + turned
    height = 0.0 if stage == 1 else (WIDTH + GAP) * p.module
    return np.array([p.radii[stage - 1] * math.cos(angle), p.radii[stage - 1] * math.sin(angle), height])


MOVING = (moving_check("D8", build, state), mesh_check("D9", build, meshes=4, wheels=2))
