"""Checks of the Wolfrom train: Willis and Lagrange."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import wolfrom as closed_form
from mechlab.analytic.planetary_stage import conditions
from mechlab.catalog.wolfrom.build import build
from mechlab.catalog.wolfrom.moving import MOVING
from mechlab.catalog.wolfrom.parameters import Parameters
from mechlab.catalog.wolfrom.scenes import carrier_acceleration, inertia_at_sun, scene
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.epicyclic import FIDELITIES, distance, final_rates, reduced_masses
from mechlab.kit.witness import engine_answer


def _speeds(p: Parameters) -> CheckResult:
    w = closed_form.speeds(p.all_teeth)
    names = ("carrier_rate", "ring_rate", "planet_1_rate")
    expected = np.array([1.0, float(w.ring), float(w.planet) - 1.0]) / float(w.sun) * 100.0
    said = {}
    for fidelity in ("parts", "full"):
        for engine in ("pinocchio", "mujoco"):
            answer = engine_answer(engine, build(p, fidelity), {"sun_rate": 100.0}, names)
            said[f"{engine} {fidelity}"] = [answer.values[n] for n in names]
    return CheckResult(said, 1e-9, expected, "rates of carrier, output and planet in carrier at 100 rad/s of the sun")


def _mass(p: Parameters) -> CheckResult:
    expected = inertia_at_sun(p) * float(closed_form.speeds(p.all_teeth).sun) ** 2
    masses = reduced_masses({f: build(p, f) for f in FIDELITIES}, ("carrier",))
    said = {f: float(m[0, 0]) / expected for f, m in masses.items()}
    return CheckResult(said, 1e-12, 1.0, "inertia seen at the carrier, relative to the closed form")


def _run(p: Parameters) -> CheckResult:
    said = final_rates(lambda f: build(p, f), lambda f: scene(p, f), "sun")
    expected = carrier_acceleration(p) * float(closed_form.speeds(p.all_teeth).sun) * 0.5
    relative = {k: x / expected for k, x in said.items()}
    # RK4 is exact for a constant acceleration; soft rows take at most one time constant (2 ms) to take up their slip.
    return CheckResult(relative, 1e-5, 1.0, f"sun speed after 0.5 s, relative to {expected:.6g} rad/s")


def _room(p: Parameters) -> CheckResult:
    """Distance of two planets as they stand, less their tip radii."""
    if p.planets == 1:
        return CheckResult({"drawn": np.zeros(0)}, 1e-9, np.zeros(0), "one planet has no neighbour")
    apart = distance(build(p, "full"), "planet_1", "planet_2")
    sun, planet, ring = p.teeth[:3]
    expected = conditions(sun, planet, ring, p.planets).neighbour_margin
    return CheckResult({"drawn": apart / p.module - planet - 2}, 1e-9, expected, "room between planets [modules]")


CHECKS = (
    Check("W1", "speeds of all members from two engines against Willis", _speeds, "Willis equation"),
    Check("W2", "inertia of each fidelity against the closed form", _mass, "Lagrange"),
    Check("W3", "run under constant torques against the closed form", _run, "Lagrange"),
    Check("W4", "room between the planets", _room, "chord of the planet axes"),
    *MOVING,
)
