"""Checks A4, A5, A8, A9, A11, A12: freedoms and transmission, mass matrix of the head, and runs of the engines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.elements import cardan_chain, output_turns
from mechlab.catalog.delta6.head import error_flow, head_inertias, head_terms, tracked_errors
from mechlab.catalog.delta6.parameters import DRIVES, ROTARY, SLIDERS, SOURCE, Delta6Parameters
from mechlab.catalog.delta6.poses import (
    coordinates,
    forces,
    moving,
    plants,
    random_poses,
    reach,
    trial_motion,
    without_stops,
)
from mechlab.catalog.delta6.scenes import head_tracking, swing
from mechlab.engines.protocol import StatePlant, engine
from mechlab.errors import EngineMissing
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import preset
from mechlab.kit.checked_quantities import CheckedQuantity, check_quantities
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import rank, structure

# -- A4: freedoms ----------------------------------------------------------------------------------------------------------

FREEDOMS = {"minimal": (15, 9, 9, 6, 0), "parts": (18, 12, 12, 6, 0), "full": (45, 36, 36, 9, 3)}
"""Coordinates, rows, rank, freedoms, freedoms that are left with all drives held."""


def a4(p: Delta6Parameters) -> CheckResult:
    """Mobility by rank at a generic pose, and the names of the local freedoms."""
    centre, angles = random_poses(p, 1, seed=11)
    counts: dict[str, list[int]] = {}
    for fidelity in FREEDOMS:
        for name, w in plants(build(p, fidelity)).items():
            counts.setdefault(name, []).extend(_freedoms(w.set(coordinates(p, fidelity, centre, angles)[0])))
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


# -- A5: constant ratio of the cardan shafts -------------------------------------------------------------------------------


def a5(p: Delta6Parameters) -> CheckResult:
    """A double cardan turned once: forks in phase, 45 and 90 deg out of phase, at the bend of the home pose."""
    bend = _bend(p)
    inputs = np.radians(np.arange(0.0, 361.0, 30.0))
    k = math.cos(bend) ** 2
    in_phase: dict[str, float] = {}
    out_of_phase: dict[str, Array] = {"analytic": _misphased(inputs, bend, 0.25 * math.pi)}
    swings = {"analytic": math.degrees(float(closed.misphase_amplitude(bend, 0.5 * math.pi)))}
    chains = [plants(cardan_chain(p.rod_length, bend, x)) for x in (0.0, 0.25 * math.pi, 0.5 * math.pi)]
    for name in chains[0]:
        good, half, worst = (chain[name] for chain in chains)
        in_phase[name] = float(np.degrees(np.abs(output_turns(good, inputs) - inputs).max()))
        out_of_phase[name] = output_turns(half, inputs)
        swings[name] = _swing(worst, bend)
    expected = math.degrees(math.asin((1.0 - k) / (1.0 + k)))
    source = math.degrees(float(closed.misphase_amplitude(_bend(SOURCE), 0.5 * math.pi)))
    pins, step = inputs[:-1] + 0.1, 1e-5
    hooke = (_hooke(pins + step, bend) - _hooke(pins - step, bend)) / (2.0 * step)
    ratio = {"analytic": closed.rod_speed_ratio(bend, pins), "differences": hooke}
    # Newton closes the chains to 1e-13.
    return check_quantities(
        CheckedQuantity("forks in phase: output - input [deg]", 1e-8, in_phase, 0.0),
        CheckedQuantity("45 deg out of phase: output [rad]", 1e-10, out_of_phase),
        CheckedQuantity("90 deg out of phase: half the swing [deg]", 1e-8, swings, expected),
        # central differences: 1e-10 of a third derivative, rounding 1e-16 / 1e-5
        CheckedQuantity("speed of the rod over that of its shaft", 1e-8, ratio),
        CheckedQuantity("the same at the bend of the source, 38.045 deg [deg]", 1e-3, {"analytic": source}, 13.557),
        note=f"bend {math.degrees(bend):.4g} deg",
    )


def _bend(p: Delta6Parameters) -> float:
    return float(closed.cardan_bend(p.geometry, np.zeros(3))[0])


def _swing(w: StatePlant, bend: float) -> float:
    """Half the swing of output - input [deg] with the forks 90 deg out of phase, from the two inputs where it is extreme.

    From the normal to rod and shaft, output - input is atan(cos^2(bend) tan(psi)) - psi, extreme at tan(psi) = +-1/cos(bend).
    """
    extreme = 0.5 * math.pi - math.atan(1.0 / math.cos(bend))
    inputs = np.array([-extreme, extreme])
    error = output_turns(w, inputs) - inputs
    return math.degrees(abs(error[1] - error[0])) / 2.0


def _hooke(pin: Array, bend: float) -> Array:
    """Turn of the rod behind a Hooke joint; the driving pin stands `pin` from the normal to shaft and rod."""
    return np.asarray(np.unwrap(np.arctan2(np.cos(bend) * np.sin(pin), np.cos(pin))))


def _misphased(inputs: Array, bend: float, misphase: float) -> Array:
    """Closed form of the output; the fork pin of the reference pose stands at 90 deg to the normal of rod and shaft."""
    start = 0.5 * math.pi
    turn = closed.misphase_output(inputs + start, bend, -misphase) - closed.misphase_output(start, bend, -misphase)
    return np.asarray(turn)


# -- A8: dynamics of the head ----------------------------------------------------------------------------------------------

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


# -- A9: control of the head -----------------------------------------------------------------------------------------------

RUN = 0.4
"""Length of the runs of the engines [s]."""


def a9(p: Delta6Parameters) -> CheckResult:
    """Errors of the controlled head: closed form, matrix exponential, and the whole mechanism in the engines."""
    start = closed.source_targets(0.0)
    e, de = closed.SOURCE_START_ANGLES - start.angles, closed.SOURCE_START_RATES - start.rates
    kv, kp = closed.SOURCE_VELOCITY_GAIN, closed.SOURCE_POSITION_GAIN
    printed = np.array([[0.006484, 0.000451, 0.039921], [0.000115, 0.000008, 0.000707]])
    law = closed.error_response(np.array([[1.0], [3.0]]), e, de, kv, kp)
    errors, rates = np.swapaxes([error_flow(kv, kp, t) @ np.vstack([e, de]) for t in (1.0, 3.0)], 0, 1)
    command = closed.command(start, closed.SOURCE_START_ANGLES, closed.SOURCE_START_RATES)
    own = closed.error_response(RUN, e, de, p.velocity_gain, p.position_gain).error
    tracked = _tracked(without_stops(p))
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


def _tracked(p: Delta6Parameters) -> dict[str, Array]:
    """(3,) errors of alpha, beta, gamma at the end of a run of the scene head-tracking, by each engine."""
    scene = replace(head_tracking(p, "minimal"), duration=RUN)
    out = {}
    for name in ("mujoco", "pinocchio"):
        try:
            out[name] = tracked_errors(name, p, scene)[0]
        except EngineMissing:
            continue
    return out


# -- A11: drift of a run ---------------------------------------------------------------------------------------------------

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


# -- A12: drive forces of the reduced mechanisms ---------------------------------------------------------------------------

TIMES = (0.03, 0.21, 0.38, 0.55, 0.77, 0.93)


def a12(p: Delta6Parameters) -> CheckResult:
    """Drive forces on the trial motion by inverse dynamics of the witnesses, the reduced mechanisms against `full`; relative
    to the largest force of a slider and the largest torque of a rotary drive."""
    motion = trial_motion(p, TIMES)
    found = {f: moving(p, f, motion, lambda w, accel: forces(w, accel, DRIVES)) for f in ("minimal", "parts", "full")}
    full = found["full"]["numpy"]
    scale = np.repeat([np.abs(full[:, :3]).max(), np.abs(full[:, 3:]).max()], 3)
    # A rod turns with 1 / cos(bend) to cos(bend) of its shaft's speed; minimal lumps it at the mean speed.
    ripple = [
        float(np.ptp(closed.rod_speed_ratio(closed.cardan_bend(x.geometry, np.zeros(3))[0], [0.0, 0.5 * np.pi])))
        for x in (p, SOURCE)
    ]
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
    Check("A5", "the cardan shafts pass rotation on at a constant ratio, with their forks in phase only", a5,
          "specification, section 4"),
    Check("A8", "mass matrix and velocity terms of the head", a8, "Lagrange; specification, check A8"),
    Check("A9", "error law of the control; the source's gains and initial errors", a9, "e'' + kv e' + kp e = 0"),
    Check("A11", "drift of MuJoCo off the closed form in 1 s, preset accurate, step 0.97 ms", a11,
          "closed-form forward position"),
    Check("A12", "drive forces of minimal and parts against full, by inverse dynamics", a12,
          "constrained equations of full"),
)  # fmt: skip
