"""Check A11: how far MuJoCo drifts off the closed form in a run."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import SERVO_LINEAR, SERVO_ROTARY, build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters, drive_names, legs
from mechlab.catalog.delta6.probes import ROTARY, SLIDERS, reach, without_stops
from mechlab.experiment.check import Check, Measured
from mechlab.experiment.laws import Servo
from mechlab.experiment.motion import Sine
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import preset
from mechlab.mechanism.statics import holding_forces

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


def a11(p: Delta6Parameters) -> Measured:
    """Largest distance of D from where the closed form puts it for the drives as they stand, over 1 s."""
    from mechlab.simulate import run

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


CHECKS = (
    Check(
        "A11",
        "drift of MuJoCo off the closed form in 1 s, preset accurate, step 0.97 ms",
        a11,
        "closed-form forward position",
    ),
)
