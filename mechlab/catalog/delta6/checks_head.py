"""Checks A8 and A9: mass matrix and velocity terms of the head, and the error law of its control."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6 import masses
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, SOURCE, without_stops
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.scenes import head_tracking
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.errors import EngineMissing
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings
from mechlab.kit.witness import room
from mechlab.mechanism.geometry import Array

SIX = (*CENTRE, *ANGLES)
PRINTED_MASS = np.array([[2.613915, 0.0, 4.515541], [0.0, 3.048915, 0.0], [4.515541, 0.0, 11.056019]]) * 1e-3
PRINTED_BIAS = np.array([6.8836e-5, 4.61241e-4, 1.184085e-3])
BETAS = (0.0, 0.7, -1.1)
RUN = 0.4
"""Length of the runs of the engines [s]."""
RATES = np.array([1.0, -2.0, 1.5])


def head_inertias(p: Delta6Parameters) -> closed.HeadInertias:
    """The head as built: the default inertias of the closed form, and what follows from the parameters. The meshes are
    real external ones, so that the planets turn against the carrier. Numbers of gears and output link are written out
    here, not taken from `masses`, so that a slip there is seen."""
    spur, output_across = 4e-5, 4e-5
    shaft = p.rotor_inertia + masses.shaft_spin(p) + spur
    across = output_across + p.output_mass * p.head_offset**2
    return closed.HeadInertias(output_transverse=across, input_gear=shaft, third_shaft=shaft, planet_sense=-1)


def _head(w: Witness, p: Delta6Parameters, fidelity: str) -> tuple[Array, Array]:
    """(3, 3, 3) mass matrix and (3, 3) velocity terms in alpha, beta, gamma at BETAS with O held."""
    mass, bias = [], []
    for beta in BETAS:
        q = coordinates(p, fidelity, np.zeros(3), [0.3, beta, -0.5])[0]
        moves = response(w.at(q), SIX)[:, 3:]
        resting = w.bias()
        mass.append(moves.T @ w.mass_matrix() @ moves)
        bias.append(moves.T @ (w.at(q, moves @ RATES).bias() - resting))
    return np.array(mass), np.array(bias)


def a8(p: Delta6Parameters) -> CheckResult:
    """Mass matrix and bias of the head."""
    plus = closed.HeadInertias()
    mass, bias = closed.mass_matrix(SOURCE.geometry, plus, 0.7), closed.bias(plus, 0.7, RATES)
    head = head_inertias(p)
    truth = closed.mass_matrix(p.geometry, head, BETAS), closed.bias(head, np.array(BETAS), RATES)
    said: tuple[dict[str, Array], dict[str, Array]] = {}, {}
    for fidelity in ("minimal", "parts"):
        for w in witnesses(build(p, fidelity)):
            found = _head(w, p, fidelity)
            for k in (0, 1):
                said[k][f"{w.name} {fidelity}"] = found[k] / np.abs(truth[k]).max()
    return graded(
        Quantity("M(0.7) of the specification, every mesh +1 [kg m2]", 5.1e-10, {"analytic": mass}, PRINTED_MASS),
        Quantity("bias of the specification [N m]", 5.1e-9, {"analytic": bias}, PRINTED_BIAS),
        Quantity("M against the mechanisms, relative", 1e-12, said[0], truth[0] / np.abs(truth[0]).max()),
        # weight and reactions of 10 N cancel in the velocity terms of 1e-3 N m: rounding of 1e-16 x 1e4
        Quantity("velocity terms against the mechanisms, relative", 1e-11, said[1], truth[1] / np.abs(truth[1]).max()),
    )


def a9(p: Delta6Parameters) -> CheckResult:
    """Errors of the controlled head: closed form, numerical integration, and the whole mechanism in MuJoCo."""
    start = closed.source_targets(0.0)
    e, de = closed.SOURCE_START_ANGLES - start.angles, closed.SOURCE_START_RATES - start.rates
    kv, kp = closed.SOURCE_VELOCITY_GAIN, closed.SOURCE_POSITION_GAIN
    printed = np.array([[0.006484, 0.000451, 0.039921], [0.000115, 0.000008, 0.000707]])
    law = closed.error_response(np.array([[1.0], [3.0]]), e, de, kv, kp)
    errors, rates = np.swapaxes(_errors(e, de, kv, kp, (1.0, 3.0)), 0, 1)
    asked = closed.command(start, closed.SOURCE_START_ANGLES, closed.SOURCE_START_RATES)
    own = closed.error_response(RUN, e, de, p.velocity_gain, p.position_gain).error
    tracked = _tracked(without_stops(p))
    # softness of MuJoCo's loops; RK4 of both runners: below 1e-8 rad measured
    runs = [Quantity(f"errors at {RUN:g} s, gains as given [rad]", 1e-5, tracked, own)] if tracked else []
    return graded(
        Quantity(
            "errors at 1 and 3 s, gains of the source [rad]",
            5.1e-7,
            {"analytic": law.error, "exponential": errors},
            printed,
        ),
        # their rates, 0.1 rad/s and less: rounding of the exponential of a matrix whose roots differ by a factor of 100
        Quantity("their rates [rad/s]", 1e-12, {"analytic": law.error_rate, "exponential": rates}),
        Quantity("command at 0 s [rad/s2]", 1e-9, {"analytic": asked}, [72.0, -202.0, 0.0]),
        *runs,
    )


def _errors(e: Array, de: Array, kv: float, kp: float, times: tuple[float, ...]) -> Array:
    """(n, 2, 3) solution e and e' of e'' + kv e' + kp e = 0 by the matrix exponential."""
    from scipy.linalg import expm

    system = np.array([[0.0, 1.0], [-kp, -kv]])
    return np.array([expm(system * t) @ np.vstack([e, de]) for t in times])


def _tracked(p: Delta6Parameters) -> dict[str, Array]:
    """(3,) errors of alpha, beta, gamma at the end of a run of the scene head-tracking, by each engine."""
    scene = replace(head_tracking(p, "minimal"), duration=RUN)
    wanted = closed.source_targets(RUN).angles
    # the fast root of the error law is near -kv: RK4 follows it up to kv h = 2.78
    settings = {"mujoco": Settings(timestep=min(0.97e-3, 0.5 / max(p.velocity_gain, 1.0)))}
    settings["pinocchio"] = Settings(engine="pinocchio", timestep=2.0 * settings["mujoco"].timestep)
    out = {}
    for engine, chosen in settings.items():
        try:
            recording = room(engine).run(build(p, "minimal"), scene, chosen)
        except EngineMissing:
            continue
        out[engine] = np.array([recording.channel(name)[-1] for name in ANGLES]) - wanted
    return out


CHECKS = (
    Check("A8", "mass matrix and velocity terms of the head", a8, "Lagrange; specification, check A8"),
    Check("A9", "error law of the control; the source's gains and initial errors", a9, "e'' + kv e' + kp e = 0"),
)  # fmt: skip
