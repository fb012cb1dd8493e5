"""Checks of runs: reference ends, MuJoCo against the equations, portraits."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.impulse import motor_rate, slope
from mechlab.catalog.impulse_transmission.build import build, voltage
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.runs import end, hybrid_run, mujoco_run, of_scene
from mechlab.catalog.impulse_transmission.scenes import simulate
from mechlab.errors import NoSolution
from mechlab.experiment.entry import Check, CheckResult
from mechlab.integrate import integrate_adaptive
from mechlab.kit.portrait import flow
from mechlab.mechanism.geometry import Array

ENDS = {
    ("fig2", 0.08): (0.844255524, 26.0880111, 152.2493379, 130.481103),
    ("fig4", 0.3): (-0.069692731, -25.7149253, 217.5751425, 144.387078),
}
"""beta, beta', alpha', Md at the end; DOP853 1e-10 with events, scipy 1.17, from the specification."""


def i5(p: Parameters) -> CheckResult:
    """Ends of two figures by Pinocchio with events and by the closed form with events."""
    said: dict[str, list[Array]] = {"analytic": [], "hybrid": []}
    for scene, duration in ENDS:
        q = of_scene(scene)
        said["analytic"].append(simulate(q, np.array([0.0, duration]))[0][-1][[1, 3, 2, 4]])
        said["hybrid"].append(end(hybrid_run(q, scene, duration)))
    return CheckResult({k: np.array(v) for k, v in said.items()}, 1e-6, list(ENDS.values()), "beta, beta', alpha', Md")


def i6_minimal(p: Parameters) -> CheckResult:
    """1 s of figure 7 by MuJoCo; the motor is a law inside the stages of RK4, so that the fourth order is kept."""
    q = of_scene("fig7")
    truth = simulate(q, np.array([0.0, 1.0]))[0][-1][[1, 3, 2, 4]]
    # 0.97e-4 s does not divide the period.
    return CheckResult(
        {"mujoco minimal": end(mujoco_run(q, "fig7", 1.0, 0.97e-4))}, 1e-5, truth, "beta, beta', alpha', Md after 1 s"
    )


def i6_order(p: Parameters) -> CheckResult:
    """Order of RK4 in MuJoCo with the motor, from three steps of beta after 0.2 s; at least 3.8."""
    q = of_scene("fig7")
    truth = simulate(q, np.array([0.0, 0.2]))[0][-1][1]
    error = [abs(end(mujoco_run(q, "fig7", 0.2, h))[0] - truth) for h in (0.97e-3, 0.485e-3)]
    order = float(np.log2(error[0] / error[1]))
    return CheckResult(
        {"mujoco RK4": order}, 0.4, 4.0, f"errors {error[0]:.2g} and {error[1]:.2g} rad; an activation would give 1"
    )


def i6_full(p: Parameters) -> CheckResult:
    """Slip of the meshes of the full model; every planet a body."""
    recording = mujoco_run(of_scene("fig7"), "fig7", 0.05, 0.97e-4, "full")
    found = recording.health.finding("relation_residual")
    reached = 0.0 if recording.t[-1] > 0.0499 else float("inf")
    return CheckResult(
        {"mujoco full": found.value + reached}, 1e-6, 0.0, "largest residual of a relation [rad], 0.05 s"
    )


def i6_motor(p: Parameters) -> CheckResult:
    """The DC motor of the model file, evaluated by MuJoCo, against the source's motor equation at 20 states."""
    if p.static_motor:
        raise NoSolution("tau = 0: the motor has no state.")
    from mechlab.engines.mujoco.drive import motor_states

    rng = np.random.default_rng(2)
    states = []
    for _ in range(20):
        states.append([*rng.uniform(-200.0, 200.0, 2), rng.uniform(-100.0, 200.0)])
    rows = np.array(states)
    speed, act_dot, force = motor_states(build(p, "minimal"), voltage(p), rows[:, :2], rows[:, 2])
    truth = np.column_stack([motor_rate(p.impulse, speed, rows[:, 2]), rows[:, 2]])
    scale = np.abs(truth).max(axis=0)
    return CheckResult(
        {"mujoco dcmotor": np.column_stack([act_dot, force]) / scale},
        1e-10,
        truth / scale,
        "dMd/dt and torque, relative",
    )


def i11(p: Parameters) -> CheckResult:
    """Portraits of 0.5 s against DOP853: 1000 motions at once, five of them followed singly."""
    q = of_scene("fig7")
    rng = np.random.default_rng(4)
    start = rng.uniform([0.0, -0.1, 145.0, -20.0, 5.0], [1.0, 0.1, 155.0, 20.0, 15.0], (1000, 5))

    def f(t: float, y: Array) -> Array:
        return slope(q.impulse, y)

    _, y = flow(f, start, 0.5, 5e-4, 2)
    truth = [integrate_adaptive(f, 0.0, start[k], 0.5, rtol=1e-10, atol=1e-11).y[-1] for k in range(5)]
    scale = np.abs(truth).max(axis=0)
    return CheckResult(
        {"RK4, 0.5 ms": y[-1, :5] / scale}, 1e-5, np.array(truth) / scale, "all five states, relative to the largest"
    )


RUN_CHECKS = (
    Check(
        "I5", "ends of figures 2 and 4 with exact friction", i5, "specification, DOP853 1e-10 with events, scipy 1.17"
    ),
    Check("I6a", "MuJoCo, minimal, RK4 0.097 ms, 1 s of figure 7", i6_minimal, "Lagrange, DOP853 1e-12"),
    Check("I6b", "order of RK4 in MuJoCo with the motor", i6_order, "Lagrange, DOP853 1e-12"),
    Check("I6c", "MuJoCo, full: slip of the meshes", i6_full, "the relations"),
    Check("I6d", "the DC motor of the model file", i6_motor, "the source's motor equation"),
)
PORTRAIT_CHECK = Check("I11", "portraits of 0.5 s by vectorised RK4", i11, "DOP853 1e-10")
