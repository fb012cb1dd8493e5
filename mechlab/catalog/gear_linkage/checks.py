"""Checks of the three-gear four-bar: each compares witnesses that do not share code."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.build import build
from mechlab.catalog.gear_linkage.checks_regime import REGIME_CHECKS
from mechlab.catalog.gear_linkage.moving import MOVING
from mechlab.catalog.gear_linkage.parameters import NEAR_CHANGE_POINT, Parameters
from mechlab.catalog.gear_linkage.questions import MOTION
from mechlab.catalog.gear_linkage.scenes import constant_crank, coordinates, free_spin, near_change_point, reference
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings

GRID = (0.35, 1.4, 2.2, 3.6, 4.9, 5.8)


def _both(p: Parameters) -> tuple[closed_form.GearLinkage, closed_form.GearLinkage]:
    return p.linkage, replace(p.linkage, mode=-p.mode)


def _pose(p: Parameters) -> CheckResult:
    said: dict[str, list[Any]] = {"analytic": [], "pinocchio": [], "mujoco": []}
    for phi in GRID:
        given = {"crank_angle": phi, "crank_rate": 1.3, "crank_accel": -0.7}
        for witness, ask in MOTION.witnesses.items():
            values = ask(p, given).values
            said[witness].append([float(values[k]) for k in MOTION.answers[:6]])
    return CheckResult(said, 1e-8, note="output and idler at 6 crank angles: angles, rates, accelerations")


def _rolling(p: Parameters) -> CheckResult:
    phi = np.linspace(0.0, 2.0 * math.pi, 101)[:-1]
    formula, rolling = [], []
    for g in _both(p):
        x = closed_form.motion(g, phi)
        formula.append([x.idler_rate, x.output_rate])
        rolling.append(closed_form.rolling_rates(g, phi))
    return CheckResult(
        {"formula": np.array(formula), "rolling": np.array(rolling)}, 1e-8, note="idler and output rate, both modes"
    )


def _accelerations(p: Parameters) -> CheckResult:
    phi, h = np.linspace(0.0, 2.0 * math.pi, 101)[:-1], 1e-5
    formula, differences = [], []
    for g in _both(p):
        formula.append(closed_form.motion(g, phi).output_accel)
        ahead, behind = (closed_form.rolling_rates(g, phi + s * h)[1] for s in (1, -1))
        differences.append((ahead - behind) / (2.0 * h))
    scale = float(np.max(np.abs(formula)))
    # Central differences: truncation h^2 w''' / 6 and rounding 1e-16 / h, both below 1e-8 of the largest acceleration
    # unless a change point is near, where the third derivative grows as its fourth power.
    return CheckResult(
        {"formula": np.array(formula) / scale, "differences of rolling": np.array(differences) / scale},
        1e-7, note=f"output acceleration, both modes, relative to the largest, {scale:.3g}",
    )  # fmt: skip


def _mean(p: Parameters) -> CheckResult:
    said = {
        f"mode {g.mode:+d}": float(closed_form.motion(g, 2.0 * math.pi).output_angle) / (2.0 * math.pi)
        for g in _both(p)
    }
    return CheckResult(
        said, 1e-12 * max(1.0, p.linkage.ratio), p.linkage.ratio, "mean output rate over one turn is ra / rd"
    )


def _mass(p: Parameters) -> CheckResult:
    from mechlab.mechanism import TreeKinematics

    m = build(p, "minimal")
    tree = TreeKinematics(m)
    phi = np.array(GRID)
    q, v = coordinates(p, m, phi, np.ones_like(phi))
    found = [float(b @ tree.set(a).mass_matrix() @ b) for a, b in zip(q, v, strict=True)]
    expected = closed_form.reduced_inertia(p.linkage, p.masses, phi)[0]
    return CheckResult(
        {"G^T M G of the model": found}, 1e-12 * float(np.max(expected)), expected, "reduced inertia [kg m2]"
    )


def _driven(p: Parameters) -> CheckResult:
    from mechlab.engines.mujoco import run

    said = {}
    for name, settings in (
        ("RK4, 1 ms", Settings()),
        ("implicitfast, 0.1 ms", Settings(integrator="implicitfast", timestep=1e-4)),
    ):
        scene = replace(constant_crank(replace(p, speed=1.0), "minimal"), duration=3.7)
        recording = run(build(p, "minimal"), scene, settings)
        truth = closed_form.motion(p.linkage, recording.channel("crank_angle")).output_angle
        said[name] = float(np.max(np.abs(recording.channel("output_angle") - truth)))
    return CheckResult(
        said, 1e-5, 0.0, "output of a MuJoCo run against the closed form at the actual crank angle [rad]"
    )


def _free(p: Parameters) -> CheckResult:
    from mechlab.engines.mujoco import run as run_mujoco
    from mechlab.engines.pinocchio import run as run_pinocchio

    p = replace(p, speed=1.0)
    scene = free_spin(p, "minimal")
    expected = reference(p, scene).channel("output_angle")[-1]
    m = build(p, "minimal")
    said = {
        "mujoco": run_mujoco(m, scene, scene.settings).channel("output_angle")[-1],
        "pinocchio": run_pinocchio(m, scene, Settings(engine="pinocchio", timestep=4e-3)).channel("output_angle")[-1],
    }
    # Softness of MuJoCo's rows at 1 ms: phase 1.3e-5 rad after 18 rad, for the masses of the default parameters.
    return CheckResult(
        said, 1e-4, float(expected), "output angle after one turn let go, against the reduced equation [rad]"
    )


def _mode(p: Parameters) -> CheckResult:
    from mechlab.engines.mujoco import run

    near = Parameters(**NEAR_CHANGE_POINT, mode=p.mode)
    scene = near_change_point(near, "minimal")
    said = []
    for settings in (scene.settings, replace(scene.settings, integrator="RK4", timestep=2e-4)):
        recording = run(build(near, "minimal"), replace(scene, duration=4.0), settings)
        chi, psi = recording.channel("rocker_angle"), recording.channel("coupler_angle")
        # sin(rocker - coupler) has the sign of the mode; only the last sample may have lost it.
        wrong = np.count_nonzero(near.mode * np.sin(chi - psi)[:-1] < 0.0)
        said += [float(recording.health.finding("assembly_mode").severity == "error"), float(wrong)]
    note = "stopped (1) or not (0), and samples in the wrong mode: of a coarse run near the change point, of a fine one"
    return CheckResult({"mujoco": said}, 0.0, [1.0, 0.0, 0.0, 0.0], note)


def _synthesis(p: Parameters) -> CheckResult:
    g = p.linkage
    targets = {
        "reverse_angle": math.radians(2.0),
        "dwell_angle": math.radians(60.0),
        "dwell_angle_one_sided": math.radians(90.0),
    }
    said: list[float] = []
    for target, wanted in targets.items():
        found = closed_form.crank_for(target, wanted, g.coupler, g.rocker, g.idler_radius, g.frame, g.mode)
        if found.crank is None:
            raise MechlabError(f"gear_linkage: {target} of {wanted:.4g} rad is out of reach with these gears.")
        said.append(float(getattr(closed_form.regime(replace(g, crank=found.crank)), target)))
    # Near the momentary dwell the dwell angle is the cube root of the reverse angle: rounding 1e-15 there, 1e-9 here.
    return CheckResult(
        {"regime of the crank found": said}, 1e-8, list(targets.values()), "2 deg back, 60 and 90 deg dwell"
    )


CHECKS = (
    Check("L1", "output and idler from three witnesses", _pose, "closed form of the three-gear four-bar"),
    Check("L2", "rates against rolling at the pitch points, both modes", _rolling, "velocity of the pitch points"),
    Check("L3", "accelerations against differences of rolling, both modes", _accelerations, "central differences"),
    Check("L4", "mean output rate over a turn", _mean, "ra / rd"),
    Check("L5", "reduced inertia against the model", _mass, "Lagrange"),
    Check("L6", "driven run at the actual crank angle", _driven, "closed form"),
    Check("L7", "free run against the equation of the one freedom", _free, "Eksergian equation, DOP853"),
    Check("L8", "assembly mode near the change point", _mode, "sign of the triangle BCD"),
    Check("L9", "synthesis of the crank, checked by its regime", _synthesis, "root finding both ways"),
    MOVING,
    *REGIME_CHECKS,
)
