"""Checks of the planetary stage: Willis and Lagrange."""

from __future__ import annotations

from dataclasses import replace

from mechlab.analytic import planetary_stage as closed_form
from mechlab.catalog.epicyclic import FIDELITIES, final_rates, measured_speeds, reduced_masses
from mechlab.catalog.planetary_stage.build import build
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.catalog.planetary_stage.questions import QUESTIONS
from mechlab.catalog.planetary_stage.scenes import accelerations, scene
from mechlab.experiment.check import Check, Measured


def _speeds(p: Parameters) -> Measured:
    note = "all members from each pair of speeds, Willis against constraint Jacobians"
    return measured_speeds(p, QUESTIONS, (37.0, -5.0), 1e-9, note)


def _mass(p: Parameters) -> Measured:
    free = replace(p, ring="free")
    expected = closed_form.mass_matrix(free.stage)
    masses = reduced_masses({f: build(free, f) for f in FIDELITIES}, ("sun", "carrier"))
    said = {f: m / expected.max() for f, m in masses.items()}
    return Measured(said, 1e-12, expected / expected.max(), "mass matrix in (sun, carrier), ring free, relative")


def _run(p: Parameters) -> Measured:
    said = final_rates(lambda f: build(p, f), lambda f: scene(p, f), "sun")
    expected = float(accelerations(p).sun) * 0.5
    # Softness of MuJoCo's gear rows: slip 4e-7 rad at 1 N m, its rate well below 1e-4 rad/s; the minimal model has no rows.
    return Measured(said, 1e-4, expected, "sun speed after 0.5 s under constant torques [rad/s]")


CHECKS = (
    Check("P1", "speeds of all members from three witnesses", _speeds, "Willis equation"),
    Check("P2", "mass matrix of each fidelity against the closed form", _mass, "Lagrange"),
    Check("P3", "run under constant torques against the closed form", _run, "Lagrange"),
)
