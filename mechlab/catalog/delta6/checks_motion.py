"""Checks A4, A8, A9, A11, A12: freedoms, mass matrix of the head, and runs of the engines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.head import error_flow, head_inertias, head_terms, tracked_errors
from mechlab.catalog.delta6.parameters import DRIVES, ROTARY, SLIDERS, SOURCE, Delta6Parameters
from mechlab.catalog.delta6.poses import (
    at_poses,
    coordinates,
    forces,
    moving,
    plants,
    random_poses,
    reach,
    trial_motion,
    without_stops,
)  # fmt: skip
from mechlab.catalog.delta6.scenes import head_tracking, swing
from mechlab.engines.protocol import StatePlant, available, engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import preset
from mechlab.kit.checked_quantities import CheckedQuantity, check_quantities
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import rank, structure

FREEDOMS = {"minimal": (15, 9, 9, 6, 0), "parts": (18, 12, 12, 6, 0), "full": (45, 36, 36, 9, 3)}
"""Coordinates, rows, rank, freedoms, freedoms that are left with all drives held."""


def a4(p: Delta6Parameters) -> CheckResult:
    """Mobility by rank at a generic pose, and the names of the local freedoms."""
    pose = random_poses(p, 1, seed=11)
    found = [at_poses(p, fidelity, *pose, _freedoms) for fidelity in FREEDOMS]
    counts = {name: np.concatenate([counted[name][0] for counted in found]) for name in found[0]}
    idle = structure(build(p, "full")).idle
    named = [float(f"spin of plain_{i}" in idle) for i in (1, 2, 3)]
    expected = sum(FREEDOMS.values(), ())
    spins = {"numpy": [*named, len(idle)]}
    return check_quantities(
        CheckedQuantity("coordinates, rows, rank, freedoms, local ones: minimal, parts, full", 0.5, counts, expected),
        CheckedQuantity("local freedoms are the spins of the plain rods", 0.5, spins, [1.0, 1.0, 1.0, 3.0]),
    )


def _freedoms(w: StatePlant) -> list[int]:
    m, jacobian = w.mechanism, w.jacobian()
    held = np.vstack([jacobian, *(m.row(n) for n in DRIVES)])
    return [m.nv, len(jacobian), rank(jacobian), m.nv - rank(jacobian), m.nv - rank(held)]


PRINTED_MASS = np.array([[2.613915, 0.0, 4.515541], [0.0, 3.048915, 0.0], [4.515541, 0.0, 11.056019]]) * 1e-3
PRINTED_BIAS = np.array([6.8836e-5, 4.61241e-4, 1.184085e-3])
BETAS = (0.0, 0.7, -1.1)
RATES = np.array([1.0, -2.0, 1.5])


def a8(p: Delta6Parameters) -> CheckResult:
    """Mass matrix and velocity terms of the head."""
    plus = closed.HeadInertias()
    mass, bias = closed.mass_matrix(SOURCE.geometry, plus, 0.7), closed.bias(plus, 0.7, RATES)
    head = head_inertias(p)
    expected = closed.mass_matrix(p.geometry, head, BETAS), closed.bias(head, np.array(BETAS), RATES)
    scales = [np.abs(x).max() for x in expected]
    terms: tuple[dict[str, Array], dict[str, Array]] = {}, {}
    for fidelity in ("minimal", "parts"):
        for name, w in plants(build(p, fidelity)).items():
            for k, found in enumerate(terms_at_betas(w, p, fidelity)):
                terms[k][f"{name} {fidelity}"] = found / scales[k]
    return check_quantities(
        CheckedQuantity(
            "M(0.7) of the specification, every mesh +1 [kg m2]", 5.1e-10, {"analytic": mass}, PRINTED_MASS
        ),
        CheckedQuantity("bias of the specification [N m]", 5.1e-9, {"analytic": bias}, PRINTED_BIAS),
        CheckedQuantity("M against the mechanisms, relative", 1e-12, terms[0], expected[0] / scales[0]),
        # weight and reactions of 10 N cancel in the velocity terms of 1e-3 N m: rounding of 1e-16 x 1e4
        CheckedQuantity("velocity terms against the mechanisms, relative", 1e-11, terms[1], expected[1] / scales[1]),
    )


def terms_at_betas(w: StatePlant, p: Delta6Parameters, fidelity: str) -> tuple[Array, Array]:
    """(3, 3, 3) mass matrix and (3, 3) velocity terms in alpha, beta, gamma at BETAS with O held."""
    poses = [coordinates(p, fidelity, np.zeros(3), [0.3, beta, -0.5])[0] for beta in BETAS]
    mass, bias, _ = zip(*(head_terms(w, q, RATES) for q in poses), strict=True)
    return np.array(mass), np.array(bias)


RUN = 0.4
"""Length of the runs of the engines [s]."""


def a9(p: Delta6Parameters) -> CheckResult:
    """Errors of the controlled head: closed form, matrix exponential, and the whole mechanism in the engines."""
    e, de = closed.SOURCE_START_ERRORS, closed.SOURCE_START_ERROR_RATES
    kv, kp = closed.SOURCE_VELOCITY_GAIN, closed.SOURCE_POSITION_GAIN
    printed = np.array([[0.006484, 0.000451, 0.039921], [0.000115, 0.000008, 0.000707]])
    law = closed.error_response(np.array([[1.0], [3.0]]), e, de, kv, kp)
    errors, rates = np.swapaxes([error_flow(kv, kp, t) @ np.vstack([e, de]) for t in (1.0, 3.0)], 0, 1)
    command = closed.command(closed.source_targets(0.0), closed.SOURCE_START_ANGLES, closed.SOURCE_START_RATES)
    own = closed.error_response(RUN, e, de, p.velocity_gain, p.position_gain).error
    free = without_stops(p)
    scene = replace(head_tracking(free, "minimal"), duration=RUN)
    tracked = {name: tracked_errors(name, free, scene)[0] for name in ("mujoco", "pinocchio") if not available(name)}
    # softness of MuJoCo's loops; RK4 of both runners: below 1e-8 rad measured
    runs = [CheckedQuantity(f"errors at {RUN:g} s, gains as given [rad]", 1e-5, tracked, own)] if tracked else []
    both = {"analytic": law.error, "exponential": errors}
    return check_quantities(
        CheckedQuantity("errors at 1 and 3 s, gains of the source [rad]", 5.1e-7, both, printed),
        # their rates, 0.1 rad/s and less: rounding of the exponential of a matrix whose roots differ by a factor of 100
        CheckedQuantity("their rates [rad/s]", 1e-12, {"analytic": law.error_rate, "exponential": rates}),
        CheckedQuantity("command at 0 s [rad/s2]", 1e-9, {"analytic": command}, [72.0, -202.0, 0.0]),
        *runs,
    )


TIMESTEP = 0.97e-3
"""Does not divide the period, so that errors of single steps do not cancel over it [s]."""
DRIFT = {"minimal": 5e-6, "parts": 1e-4}
"""Largest distance of D from where the closed form puts it [m]."""


def a11(p: Delta6Parameters) -> CheckResult:
    """Largest distance of D from where the closed form puts it for the drives of the recording, over 1 s."""
    run = engine("mujoco").run
    quantities, notes = [], []
    p = without_stops(p)
    for fidelity, limit in DRIFT.items():
        scene = swing(p, fidelity, min(0.05, 0.3 * reach(p)))
        recording = run(build(p, fidelity), scene, preset("accurate", timestep=TIMESTEP))
        sliders, rotary = (np.column_stack([recording.channel(n) for n in names]) for names in (SLIDERS, ROTARY))
        tool = np.column_stack([recording.channel(f"D_{a}") for a in "xyz"])
        drift = np.linalg.norm(tool - closed.forward(p.geometry, sliders, rotary).tool, axis=1)
        name, complete = f"mujoco {fidelity}", float(recording.t[-1])
        quantities.append(CheckedQuantity(f"drift of D in {fidelity} [m]", limit, {name: drift.max()}, 0.0))
        quantities.append(CheckedQuantity(f"end of the run of {fidelity} [s]", 1e-9, {name: complete}, 1.0))
        gaps = [f for f in recording.health.findings if f.name in ("loop_gap", "relation_residual")]
        gap_text = ", ".join(f"{f.name} {f.value:.2g}" for f in gaps)
        travel = np.ptp(tool, axis=0).max()
        notes.append(f"{fidelity}: {gap_text}, D travels {travel:.2g} m, trusted: {recording.health.trusted}")
    return check_quantities(*quantities, note="; ".join(notes))


TIMES = (0.03, 0.21, 0.38, 0.55, 0.77, 0.93)


def a12(p: Delta6Parameters) -> CheckResult:
    """Drive forces on the trial motion by inverse dynamics of the witnesses, the reduced mechanisms against `full`; relative
    to the largest force of a slider and the largest torque of a rotary drive."""
    motion = trial_motion(p, TIMES)
    found = {f: moving(p, f, motion, lambda w, accel: forces(w, accel, DRIVES)) for f in ("minimal", "parts", "full")}
    full = found["full"]["numpy"]
    scale = np.repeat([np.abs(full[:, :3]).max(), np.abs(full[:, 3:]).max()], 3)
    # A rod turns with 1 / cos(bend) to cos(bend) of its shaft's speed; minimal lumps it at the mean speed.
    ripple = [float(np.ptp(closed.rod_speed_ratio(x.home_bend, [0.0, 0.5 * np.pi]))) for x in (p, SOURCE)]
    relative = {f: {k: v / scale for k, v in forces_on.items()} for f, forces_on in found.items()}
    lumped = 1e-3 * max(1.0, ripple[0] / ripple[1])
    halved = 3e-2 * max(1.0, p.rod_mass / SOURCE.rod_mass)
    return check_quantities(
        CheckedQuantity("full, between the witnesses", 1e-9, relative["full"]),
        CheckedQuantity("minimal against full", lumped, relative["minimal"], full / scale),
        CheckedQuantity("parts (rods half and half) against full", halved, relative["parts"], full / scale),
        note=f"largest forces {scale[0]:.3g} N and {scale[3]:.3g} N m",
    )


CHECKS = (
    Check("A4", "degrees of freedom by rank: 6, 6, and 9 = 6 + 3 local", a4, "rank of the constraint Jacobian"),
    Check("A8", "mass matrix and velocity terms of the head", a8, "Lagrange; specification, check A8"),
    Check("A9", "error law of the control; the source's gains and initial errors", a9, "e'' + kv e' + kp e = 0"),
    Check("A11", "drift of MuJoCo off the closed form in 1 s, preset accurate, step 0.97 ms", a11,
          "closed-form forward position"),
    Check("A12", "drive forces of minimal and parts against full, by inverse dynamics", a12,
          "constrained equations of full"),
)  # fmt: skip
