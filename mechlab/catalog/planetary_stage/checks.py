"""Checks of the planetary stage: Willis and Lagrange."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic import planetary_stage as closed_form
from mechlab.catalog.planetary_stage.build import build
from mechlab.catalog.planetary_stage.moving import MOVING
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.catalog.planetary_stage.questions import QUESTIONS
from mechlab.catalog.planetary_stage.scenes import accelerations, scene
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.epicyclic import FIDELITIES, distance, final_rates, measured_speeds, reduced_masses


def _speeds(p: Parameters) -> CheckResult:
    note = "all members from each pair of speeds, Willis against constraint Jacobians"
    return measured_speeds(p, QUESTIONS, (37.0, -5.0), 1e-9, note)


def _mass(p: Parameters) -> CheckResult:
    free = replace(p, ring="free")
    expected = closed_form.mass_matrix(free.stage)
    masses = reduced_masses({f: build(free, f) for f in FIDELITIES}, ("sun", "carrier"))
    said = {f: m / expected.max() for f, m in masses.items()}
    return CheckResult(said, 1e-12, expected / expected.max(), "mass matrix in (sun, carrier), ring free, relative")


def _run(p: Parameters) -> CheckResult:
    said = final_rates(lambda f: build(p, f), lambda f: scene(p, f), "sun")
    expected = float(accelerations(p).sun) * 0.5
    # Softness of MuJoCo's gear rows: slip 4e-7 rad at 1 N m, its rate well below 1e-4 rad/s; the minimal model has no rows.
    return CheckResult(said, 1e-4, expected, "sun speed after 0.5 s under constant torques [rad/s]")


def _room(p: Parameters) -> CheckResult:
    """Distance of two planets as they stand, less their tip radii."""
    if p.planets == 1:
        return CheckResult({"drawn": np.zeros(0)}, 1e-9, np.zeros(0), "one planet has no neighbour")
    apart = distance(build(p, "full"), "planet_1", "planet_2")
    sun, planet, ring = p.teeth
    expected = closed_form.conditions(sun, planet, ring, p.planets).neighbour_margin
    return CheckResult({"drawn": apart / p.module - planet - 2}, 1e-9, expected, "room between planets [modules]")


def _held(p: Parameters) -> CheckResult:
    """The torque that holds the ring, put on a free ring, keeps it still: and the sun goes as with the ring held."""
    held = closed_form.held_ring_accelerations(p.stage, p.sun_torque, p.carrier_torque)
    free = closed_form.free_accelerations(p.stage, p.sun_torque, p.carrier_torque, held.ring_torque)
    scale = max(abs(float(held.sun)), 1.0)
    said, expected = (
        [float(x) / scale for x in (a.ring, a.sun, a.carrier, a.planet, a.ring_torque)]
        for a in (free, replace(held, ring=np.zeros(())))
    )
    return CheckResult({"free ring": said}, 1e-12, expected, "ring, sun, carrier, planet, torque; relative")


CHECKS = (
    Check("P1", "speeds of all members from three witnesses", _speeds, "Willis equation"),
    Check("P2", "mass matrix of each fidelity against the closed form", _mass, "Lagrange"),
    Check("P3", "run under constant torques against the closed form", _run, "Lagrange"),
    Check("P4", "room between the planets", _room, "chord of the planet axes"),
    Check("P5", "torque that holds the ring", _held, "Lagrange with the ring free"),
    *MOVING,
)
