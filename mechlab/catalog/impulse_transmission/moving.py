"""The transmission at a moving state in particles, and the check on it."""

from __future__ import annotations

import cmath
import math

import numpy as np

from mechlab.catalog.impulse_transmission.build import build
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import mass_check
from mechlab.kit.benchmark_parts import in_plane
from mechlab.kit.mass_check import NOTHING, Particles, State, solid, spread_of
from mechlab.mechanism.geometry import axis_rotation

ANGLES, RATES = (0.9, 0.35), (1.7, -0.6)
"""Angles [rad] and rates [rad/s] of input and output."""


def state(p: Parameters, fidelity: str) -> State:
    """In `minimal` one planet stands for all and both shafts are massless rotors; in `full` a shaft is a flat disc as wide as
    the orbit of the planets."""
    (alpha, beta), (u, v) = ANGLES, RATES
    orbit, q = p.a + p.b, float(p.q)
    theta, dtheta = ((p.a * x + p.b * y) / orbit for x, y in (ANGLES, RATES))
    psi, dpsi = q * (alpha - beta), q * (u - v)
    count = 1 if fidelity == "minimal" else p.planets
    values = {"alpha": alpha, "beta": beta, "theta": theta, "psi": psi}
    rates = {"alpha": u, "beta": v, "theta": dtheta, "psi": dpsi}
    values |= {f"planet_{k + 1}": psi for k in range(p.planets)}
    rates |= {f"planet_{k + 1}": dpsi for k in range(p.planets)}
    particles, poses = NOTHING, {"carrier": (axis_rotation((0.0, 0.0, 1.0), theta), np.zeros(3))}
    for k in range(count):
        ray = theta + 2.0 * math.pi * k / count
        axis, arm = cmath.rect(orbit, ray), cmath.rect(p.h, ray + psi)
        speed = 1j * (dtheta * axis + (dtheta + dpsi) * arm)
        mass, moment = p.nm / count, max(0.0, p.nJ3 - p.nm * p.h**2) / count
        particles = particles + _flat(mass, moment, axis + arm, speed, dtheta + dpsi)
        name = "planet" if fidelity == "minimal" else f"planet_{k + 1}"
        poses[name] = (axis_rotation((0.0, 0.0, 1.0), ray + psi), np.array(in_plane(axis)))
    rotors = 0.0
    for moment, rate in ((p.J1, u), (p.J2, v)):
        if fidelity == "full":
            particles = particles + _flat(2.0 * moment / orbit**2, moment, 0j, 0j, rate)
        else:
            rotors += 0.5 * moment * rate**2
    return State(values, rates, particles, {}, (0.0, 0.0, 0.0), 2, rotors, stored=p.c * beta * v, poses=poses)


def _flat(mass: float, moment: float, centre: complex, velocity: complex, rate: float) -> Particles:
    spread = spread_of(mass, (0.5 * moment, 0.5 * moment, moment))
    return solid(mass, in_plane(centre), spread, velocity=in_plane(velocity), turn=(0.0, 0.0, rate))


def _moving(p: Parameters) -> CheckResult:
    return mass_check.compare([(build(p, f), state(p, f)) for f in ("minimal", "full")])


MOVING = Check("I12", mass_check.TEXT, _moving, mass_check.SOURCE)
