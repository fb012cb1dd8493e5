"""Runs of the transmission against independent ends: steps, motor, sticking, portraits."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.analytic.impulse import Impulse, clutched, motor_rate, simulated_clutch, slope
from mechlab.catalog.impulse_transmission.build import Parameters, build
from mechlab.catalog.impulse_transmission.scenes import HYBRID, SCENES, of_scene, simulate
from mechlab.engines.protocol import engine
from mechlab.errors import NoSolution
from mechlab.experiment.entry import CheckResult
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings, preset
from mechlab.integrate import integrate_adaptive
from mechlab.kit.portrait import flow
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

LOADS = ((18.0, 750.0), (750.0, 0.0), (500.0, 100.0))
"""M0 and M1 [N m] under which the clutch to the housing is tried."""


def clutch_to_the_housing(p: Parameters) -> CheckResult:
    """Turning points, mean speed and mean torques of the cycle with a one-way clutch, at 150 rad/s."""
    rows = []
    for found in (clutched, simulated_clutch):
        cycles = [found(Impulse(M0=M0, M1=M1), 150.0) for M0, M1 in LOADS]
        rows.append([(c.psi_a, c.psi_b, c.mean_speed, c.motor_torque, c.holding_torque) for c in cycles])
    # the integration is accurate to 1e-11 of torques of 1e3 N m; 30 times that is allowed
    return CheckResult({"analytic": np.array(rows[0]), "DOP853 1e-11": np.array(rows[1])}, 3e-7)


ENDS = {
    ("fig2", 0.08): (0.844255524, 26.0880111, 152.2493379, 130.481103),
    ("fig4", 0.3): (-0.069692731, -25.7149253, 217.5751425, 144.387078),
}
"""(scene, time [s]) -> beta, beta', alpha', Md; DOP853 1e-10 with events, scipy 1.17, from the specification."""
STATE = "beta, beta', alpha', Md"


def _asked(scene: str, duration: float, fidelity: str = "minimal") -> tuple[Mechanism, Scene]:
    p = of_scene(scene)
    return build(p, fidelity), replace(SCENES[scene].make(p, fidelity), duration=duration)


@lru_cache(maxsize=16)
def run(scene: str, duration: float, settings: Settings, fidelity: str = "minimal") -> Recording:
    """A scene by an engine, for a duration [s]."""
    return engine(settings.engine).run(*_asked(scene, duration, fidelity), settings)


def end(scene: str, duration: float, settings: Settings) -> Array:
    """(4,) beta, beta', alpha', Md at the end of such a run."""
    recording = engine(settings.engine).at_times(*_asked(scene, duration), settings, [duration])
    return np.array([recording.channel(n)[-1] for n in ("beta", "beta_rate", "alpha_rate", "alpha_force")])


def true_end(scene: str, duration: float) -> Array:
    """The same by the closed form."""
    return simulate(of_scene(scene), np.array([0.0, duration]))[0][-1][[1, 3, 2, 4]]


def rough_ends(p: Parameters) -> CheckResult:
    """Ends of two figures by Pinocchio with events and by the closed form with events."""
    found = {"analytic": [true_end(*x) for x in ENDS], "hybrid": [end(*x, HYBRID) for x in ENDS]}
    return CheckResult(found, 1e-6, list(ENDS.values()), STATE)


def smooth_end(p: Parameters) -> CheckResult:
    """1 s of figure 7 by MuJoCo; the motor is a law inside the stages of RK4, so that the fourth order is kept."""
    # 0.97e-4 s does not divide the period.
    found = end("fig7", 1.0, preset("accurate", timestep=0.97e-4))
    return CheckResult({"mujoco minimal": found}, 1e-5, true_end("fig7", 1.0), f"{STATE} after 1 s")


def order_of_steps(p: Parameters) -> CheckResult:
    """Order of RK4 in MuJoCo with the motor, from two steps of beta after 0.2 s; at least 3.6."""
    truth = true_end("fig7", 0.2)[0]
    error = [abs(end("fig7", 0.2, preset("accurate", timestep=h))[0] - truth) for h in (0.97e-3, 0.485e-3)]
    note = f"errors {error[0]:.2g} and {error[1]:.2g} rad; an activation would give 1"
    return CheckResult({"mujoco RK4": float(np.log2(error[0] / error[1]))}, 0.4, 4.0, note)


def slip_of_meshes(p: Parameters) -> CheckResult:
    """Slip of the meshes of the full model; every planet a body."""
    recording = run("fig7", 0.05, preset("accurate", timestep=0.97e-4), "full")
    found = recording.health.finding("relation_residual")
    reached = 0.0 if recording.t[-1] > 0.0499 else float("inf")
    return CheckResult(
        {"mujoco full": found.value + reached}, 1e-6, 0.0, "largest residual of a relation [rad], 0.05 s"
    )


def motor_of_the_file(p: Parameters) -> CheckResult:
    """The DC motor of the model file, evaluated by MuJoCo, against the source's motor equation at 20 states."""
    if p.static_motor:
        raise NoSolution("tau = 0: the motor has no state.")
    from mechlab.engines.mujoco.drive import motor_states

    rng = np.random.default_rng(2)
    states = rng.uniform([-200.0, -200.0, -100.0], [200.0, 200.0, 200.0], (20, 3))
    current = states[:, 2]
    speed, rate, force = motor_states(build(p, "minimal"), p.voltage, states[:, :2], current)
    truth = np.column_stack([motor_rate(p.impulse, speed, current), current])
    scale = np.abs(truth).max(axis=0)
    found = np.column_stack([rate, force]) / scale
    return CheckResult({"mujoco dcmotor": found}, 1e-10, truth / scale, "dMd/dt and torque, relative")


def effort_of_sticking(p: Parameters) -> CheckResult:
    """Evaluations of the sticking scene, against a bound; with sign() friction 4e5 do not reach the end."""
    evaluations = float(run("sticking", 0.3, HYBRID).cost.evaluations)
    return CheckResult({"hybrid": evaluations}, 5e4, 5e4, "evaluations, must lie below 1e5")


def sticking(p: Parameters) -> CheckResult:
    """Sticking by Pinocchio's tree and by the closed form: state at the end."""
    found = {"analytic": true_end("sticking", 0.3), "hybrid": end("sticking", 0.3, HYBRID)}
    return CheckResult(found, 1e-6, None, STATE)


def smoothed_rate(p: Parameters, duration: float, width: float) -> float:
    """beta' at the end with M1 tanh(beta' / width) instead of dry friction, by DOP853 1e-9."""

    def f(t: float, y: Array) -> Array:
        return slope(p.impulse, y, width)

    done = integrate_adaptive(f, 0.0, p.start, duration, rtol=1e-9, atol=1e-11, most_evaluations=2_000_000, times=())
    if not done.complete:
        raise NoSolution(f"tanh friction of width {width:g}: {done.outcome.value}.")
    return float(done.y[-1][3])


def smoothed_sticking(p: Parameters) -> CheckResult:
    """Friction smoothed by tanh converges to the sticking solution with the first power of its width."""
    truth = true_end("sticking", 0.3)[1]
    error = [abs(smoothed_rate(of_scene("sticking"), 0.3, w) - truth) for w in (0.2, 0.1)]
    note = f"order in the width; errors of beta' {error[0]:.2g}, {error[1]:.2g} rad/s"
    return CheckResult({"tanh": float(np.log2(error[0] / error[1]))}, 0.25, 1.0, note)


def portraits(p: Parameters) -> CheckResult:
    """Portraits of 0.5 s against DOP853: 1000 motions at once, five of them followed singly."""
    impulse = of_scene("fig7").impulse
    start = np.random.default_rng(4).uniform([0.0, -0.1, 145.0, -20.0, 5.0], [1.0, 0.1, 155.0, 20.0, 15.0], (1000, 5))

    def f(t: float, y: Array) -> Array:
        return slope(impulse, y)

    found = flow(f, start, 0.5, 5e-4, 2)[1][-1, :5]
    truth = np.array([integrate_adaptive(f, 0.0, y, 0.5, rtol=1e-10, atol=1e-11, times=()).y[-1] for y in start[:5]])
    scale = np.abs(truth).max(axis=0)
    return CheckResult({"RK4, 0.5 ms": found / scale}, 1e-5, truth / scale, "all five states, relative to the largest")
