"""Checks of the series-planet gear: Willis, Lagrange, teeth in gaps."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.planetary_synthesis import neighbour_gaps
from mechlab.catalog.planetary.build import build
from mechlab.catalog.planetary.looks import phases
from mechlab.catalog.planetary.moving import MOVING
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.catalog.planetary.questions import QUESTIONS
from mechlab.catalog.planetary.scenes import acceleration, scene
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.epicyclic import FIDELITIES, distance, final_rates, measured_speeds, reduced_masses


def _speeds(p: Parameters) -> CheckResult:
    return measured_speeds(p, QUESTIONS, (7.0,), 1e-9 * float(p.ratio), "all members from the sun and from the carrier")


def _inertia(p: Parameters) -> CheckResult:
    masses = reduced_masses({f: build(p, f) for f in FIDELITIES}, ("carrier",))
    said = {f: float(m[0, 0]) / p.inertia for f, m in masses.items()}
    return CheckResult(said, 1e-12, 1.0, "inertia reduced to the carrier, relative to the closed form")


def _run(p: Parameters) -> CheckResult:
    said = final_rates(lambda f: build(p, f), lambda f: scene(p, f), "carrier")
    # Softness of MuJoCo's gear rows: slip below 1e-6 rad, its rate well below 1e-4 rad/s.
    return CheckResult(said, 1e-4, 0.5 * acceleration(p), "carrier speed after 0.5 s under constant torques [rad/s]")


def _teeth(p: Parameters) -> CheckResult:
    """Phase left over at gear 4 on every ray, in pitches: 0 when a tooth stands in a gap there."""
    pitch = 2.0 * math.pi / p.teeth[3]
    off = [(phases(p, k)[2] - phases(p, 0)[2]) / pitch for k in range(p.planets)]
    said = {"drawn": max(abs(x - round(x)) for x in off)}
    return CheckResult(said, 1e-9, 0.0, "gear 4 meshes with planet 3 on every ray [pitches]")


def _room(p: Parameters) -> CheckResult:
    """Distances of the planets as they stand, less their tip radii (z + 2 half modules each)."""
    if p.planets == 1:
        return CheckResult({"drawn": np.zeros(0)}, 1e-9, np.zeros(0), "one planet has no neighbour")
    m, (z1, z2, z3, _) = build(p, "full"), p.teeth
    pairs = (
        ("planet_2_1", "planet_2_2", z2 + z2),
        ("planet_3_1", "planet_3_2", z3 + z3),
        ("planet_2_1", "planet_3_2", z2 + z3),
    )
    said = [distance(m, a, b) / (0.5 * p.module) - z - 4 for a, b, z in pairs]
    expected = neighbour_gaps(z1, z2, z3, p.planets)
    return CheckResult({"drawn": said}, 1e-9, expected, "room between neighbouring planets [half modules]")


CHECKS = (
    Check("S1", "speeds of all members from three witnesses", _speeds, "Willis equation"),
    Check("S2", "reduced inertia of each fidelity against the closed form", _inertia, "Lagrange"),
    Check("S3", "run under constant torques against the closed form", _run, "Lagrange"),
    Check("S4", "teeth in phase on every ray", _teeth, "assembly condition (z1 + z4) / planets whole"),
    Check("S5", "room between the planets", _room, "law of cosines"),
    *MOVING,
)
