"""Checks A11 and A12: how far MuJoCo drifts off the closed form, and the drive forces of the reduced mechanisms."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import SERVO_LINEAR, SERVO_ROTARY, build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters, drive_names, legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SLIDERS, SOURCE, probe_motion, reach, without_stops
from mechlab.catalog.delta6.responses import forces, response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.laws import Servo
from mechlab.experiment.motion import Sine
from mechlab.experiment.scene import Scene, preset
from mechlab.kit.witness import room
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import holding_forces

SIX = (*CENTRE, *ANGLES)
TIMESTEP = 0.97e-3
"""Does not divide the period, so that errors of single steps do not cancel over it [s]."""
LIMITS = {"minimal": 5e-6, "parts": 1e-4}


def swing(p: Delta6Parameters, fidelity: str) -> Scene:
    """1 s in which servos swing all six drives at 1 Hz: O by about 0.05 m, less where the reach is short."""
    m = build(p, fidelity)
    weight = holding_forces(m, m.reference(), drive_names())
    stroke, w = min(0.05, 0.3 * reach(p)), 2.0 * math.pi
    laws = []
    for k, leg in enumerate(legs(p)):
        motion = Sine(stroke, w, 2.0 * math.pi * k / 3.0, leg.home + p.slider_height)
        laws.append(Servo(f"q{k + 1}", motion, *SERVO_LINEAR, feedforward=weight[f"q{k + 1}"]))
    for k, (size, phase) in enumerate(((1.0, 0.2), (0.8, 1.1), (0.4, 2.3))):
        laws.append(Servo(f"phi{k + 1}", Sine(size, w, phase), *SERVO_ROTARY, feedforward=weight[f"phi{k + 1}"]))
    values = {law.on: law.motion.at(0.0) for law in laws}
    return Scene(
        "swing", fidelity, 1.0, tuple(laws),
        initial={k: x for k, (x, _, _) in values.items()}, initial_rates={k: dx for k, (_, dx, _) in values.items()},
        text="all drives swing at 1 Hz",
    )  # fmt: skip


def a11(p: Delta6Parameters) -> CheckResult:
    """Largest distance of D from where the closed form puts it for the drives as they stand, over 1 s."""
    run = room("mujoco").run
    quantities, told = [], []
    p = without_stops(p)
    for fidelity, limit in LIMITS.items():
        recording = run(build(p, fidelity), swing(p, fidelity), preset("accurate", timestep=TIMESTEP))
        sliders, rotary = (np.column_stack([recording.channel(n) for n in names]) for names in (SLIDERS, ROTARY))
        tool = np.column_stack([recording.channel(f"D_{a}") for a in "xyz"])
        drift = np.linalg.norm(tool - closed.forward(p.geometry, sliders, rotary).tool, axis=1)
        complete = float(recording.t[-1])
        quantities.append(Quantity(f"drift of D in {fidelity} [m]", limit, {f"mujoco {fidelity}": drift.max()}, 0.0))
        quantities.append(Quantity(f"end of the run of {fidelity} [s]", 1e-9, {f"mujoco {fidelity}": complete}, 1.0))
        open_by = [
            f"{f.name} {f.value:.2g}" for f in recording.health.findings if f.name in ("loop_gap", "relation_residual")
        ]
        travel = np.ptp(tool, axis=0).max()
        told.append(f"{fidelity}: {', '.join(open_by)}, D travels {travel:.2g} m, trusted: {recording.health.trusted}")
    return graded(*quantities, note="; ".join(told))


TIMES = (0.03, 0.21, 0.38, 0.55, 0.77, 0.93)


def _drive_forces(w: Witness, p: Delta6Parameters, fidelity: str) -> Array:
    """(n, 6) forces of the drives on the probe motion, by inverse dynamics."""
    motion = probe_motion(p, TIMES)
    out = []
    for k, q in enumerate(coordinates(p, fidelity, motion.centre, motion.angles)):
        v = response(w.at(q), SIX) @ motion.rate[k]
        out.append(forces(w.at(q, v), SIX, motion.accel[k], drive_names()))
    return np.array(out)


def a12(p: Delta6Parameters) -> CheckResult:
    """Drive forces of the reduced mechanisms against `full`, relative to the largest linear and rotary one."""
    found: dict[str, dict[str, Array]] = {"minimal": {}, "parts": {}, "full": {}}
    for fidelity, said in found.items():
        for w in witnesses(build(p, fidelity)):
            said[w.name] = _drive_forces(w, p, fidelity)
    truth = found["full"]["numpy"]
    scale = np.repeat([np.abs(truth[:, :3]).max(), np.abs(truth[:, 3:]).max()], 3)
    # A rod turns with 1 / cos(bend) to cos(bend) of its shaft's speed; minimal lumps it at the mean speed.
    ripple = [
        float(np.ptp(closed.rod_speed_ratio(closed.cardan_bend(x.geometry, np.zeros(3))[0], [0.0, 0.5 * np.pi])))
        for x in (p, SOURCE)
    ]
    relative = {f: {k: v / scale for k, v in said.items()} for f, said in found.items()}
    return graded(
        Quantity("full, between the witnesses", 1e-9, relative["full"]),
        Quantity("minimal against full", 1e-3 * max(1.0, ripple[0] / ripple[1]), relative["minimal"], truth / scale),
        Quantity(
            "parts (rods half and half) against full",
            3e-2 * max(1.0, p.rod_mass / SOURCE.rod_mass),
            relative["parts"],
            truth / scale,
        ),
        note=f"largest forces {scale[0]:.3g} N and {scale[3]:.3g} N m",
    )


CHECKS = (
    Check("A11", "drift of MuJoCo off the closed form in 1 s, preset accurate, step 0.97 ms", a11,
          "closed-form forward position"),
    Check("A12", "drive forces of minimal and parts against full, by inverse dynamics", a12,
          "constrained equations of full"),
)  # fmt: skip
