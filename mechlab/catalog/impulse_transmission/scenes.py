"""The figures of the source, one-way rotation and sticking as scenes, and their motion by the closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.impulse import ConstantSpeed, Impulse, WithMotor, harmonic_motion, unidirectional
from mechlab.catalog.impulse_transmission.build import NAME, Parameters, build, coordinates
from mechlab.catalog.impulse_transmission.torque import STEP, clutch_laws
from mechlab.errors import MechlabError, Untrustworthy
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.held_rates import HeldRates
from mechlab.experiment.laws import Constant, DcMotor, Law
from mechlab.experiment.recording import Cost, Finding, Health, Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings, preset
from mechlab.integrate import integrate_hybrid
from mechlab.mechanism.geometry import Array

SMOOTH_STEPS = {"minimal": 2.5e-4, "full": 1e-4}
"""Timestep [s] without dry friction: 1e-3 leaves 4e-5 rad in figure 7, and 2.5e-4 leaves 9e-5 rad with rows for the gears."""
HYBRID = Settings(engine="hybrid", integrator="DOP853", tolerance=1e-11, preset="hybrid")


def laws(p: Parameters) -> tuple[Law, ...]:
    """The motor with its lag, and the constant load. The dry friction is a property of the output shaft."""
    w = p.winding
    motor = DcMotor("alpha", p.voltage, w.constant, w.resistance, p.tau * w.resistance, p.motor_torque_0)
    if p.static_motor and p.tau > 0:
        motor = motor.static()
    return (motor, Constant("beta", -p.M0)) if p.M0 else (motor,)


def settings(p: Parameters, fidelity: str) -> Settings:
    """The engine `hybrid` for dry friction; else RK4 with a step that resolves the motor (unstable above 2.8 tau)."""
    if p.M1 > 0:
        return HYBRID
    step = SMOOTH_STEPS[fidelity]
    return preset("accurate", timestep=step if p.static_motor else min(step, p.tau))


def _recipe(duration: float, text: str, **overrides: Any) -> SceneRecipe:
    def make(p: Parameters, fidelity: str) -> Scene:
        return Scene(
            "", fidelity, duration, laws(p), initial={"alpha": p.alpha_0, "beta": p.beta_0},
            initial_rates={"alpha": p.alpha_rate_0, "beta": p.beta_rate_0}, channels=("motor_torque",),
            needs=("poses", "drive_forces"), tolerance=1e-5, settings=settings(p, fidelity), text=text,
        )  # fmt: skip

    return SceneRecipe(make, "minimal", text, overrides)


SPEED = 150.0
"""Input speed of figures 2, 5 and 7 [rad/s]."""
FIGURE_7 = Impulse(M0=0.0, M1=0.0, c=500.0)

_FIG2 = {
    "J1": 5.0, "J2": 0.5, "nJ3": 0.32, "nm": 10.5, "a": 0.02, "b": 0.08, "h": 0.08, "M0": 0.0, "M1": 750.0, "Mn": 150.0,
    "no_load_speed": 157.0, "nominal_speed": 150.0, "tau": 0.038, "slip_per_torque": 0.0024, "c": 0.0, "alpha_0": 0.0,
    "beta_0": 0.0, "alpha_rate_0": 150.0, "beta_rate_0": 0.0, "motor_torque_0": 5.0,
}  # fmt: skip
_FIG4 = _FIG2 | {
    "J1": 14.0, "nJ3": 0.25, "nm": 8.0, "h": 0.083, "M0": 18.0, "no_load_speed": 220.0, "nominal_speed": 215.0,
    "alpha_0": 1.127, "beta_0": -0.204, "alpha_rate_0": 216.85, "beta_rate_0": 5.5, "motor_torque_0": 100.0,
}  # fmt: skip
_FIG5 = _FIG4 | {
    "M0": 0.0, "M1": 20.0, "Mn": 10.0, "no_load_speed": 157.0, "nominal_speed": 150.0, "alpha_0": 0.0, "beta_0": 0.0,
    "alpha_rate_0": 150.0, "beta_rate_0": 0.0, "motor_torque_0": 10.0,
}  # fmt: skip
_FIG7 = _FIG5 | {
    "M1": 0.0, "c": 500.0, "beta_rate_0": float(harmonic_motion(FIGURE_7, SPEED, 0.0)[1]),
}  # fmt: skip


def _one_way() -> dict[str, Any]:
    """Set (4), that of figure 5, under M0 = 2, M1 = 10 with a motor that keeps 150 rad/s; from the exact state at the start of a cycle."""
    found = unidirectional(Impulse(M0=2.0, M1=10.0), SPEED)
    torque, psi = float(found.mean_motor_torque), float(found.psi_a)
    return _FIG5 | {
        "M0": 2.0, "M1": 10.0, "Mn": torque, "slip_per_torque": None, "alpha_0": psi / Impulse().q, "motor_torque_0": torque,
    }  # fmt: skip


SWAPPED = "the other reading of the torque order"
SCENES = {
    "fig2": _recipe(0.45, "figures 2 and 3: start at 150 rad/s", **_FIG2),
    "fig2-swapped": _recipe(
        0.45, f"figures 2 and 3, M1 and Mn exchanged: {SWAPPED}", **_FIG2 | {"M1": 150.0, "Mn": 750.0}
    ),
    "fig4": _recipe(0.3, "figure 4: friction and load, the printed state", **_FIG4),
    "fig4-swapped": _recipe(0.3, f"figure 4, M1 and Mn exchanged: {SWAPPED}", **_FIG4 | {"M1": 150.0, "Mn": 750.0}),
    "fig5": _recipe(1.0, "figure 5: weak friction, one-way rotation with ripple", **_FIG5),
    "fig5-swapped": _recipe(1.0, f"figure 5, M1 and Mn exchanged: {SWAPPED}", **_FIG5 | {"M1": 10.0, "Mn": 20.0}),
    "fig7": _recipe(1.0, "figure 7: set (4) of figure 5 on a spring, no friction", **_FIG7),
    "unidirectional": _recipe(1.0, "one-way rotation from the exact state of the cycle", **_one_way()),
    "sticking": _recipe(0.3, "figure 4 with friction strong enough to stick", **_FIG4 | {"M1": 3000.0}),
}


def _clutched(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "", fidelity, 0.2, clutch_laws(p), initial={"alpha": p.alpha_0, "beta": p.beta_0},
        initial_rates={"alpha": p.nominal_speed, "beta": 0.0}, channels=("motor_torque",), needs=("poses", "drive_forces"), tolerance=1e-3,
        settings=Settings(timestep=STEP), text=CLUTCHED,
    )  # fmt: skip


CLUTCHED = "input held at its nominal speed, a one-way clutch from the output shaft to the housing, constant load"
SCENES["housing-clutch"] = SceneRecipe(_clutched, "minimal", CLUTCHED, _FIG5 | {"M0": 750.0, "M1": 0.0})


def simulate(p: Parameters, times: Array, tolerance: float = 1e-12) -> tuple[Array, Health, Cost]:
    """(n, 5) states (alpha, beta, alpha', beta', Md) at times (n,) by the closed-form equations and located events."""
    problem = WithMotor(p.impulse, p.static_motor)
    done = integrate_hybrid(problem, p.start, times, rtol=tolerance, atol=1e-2 * tolerance)
    if not done.complete:
        raise Untrustworthy(f"{NAME}: the closed form stopped at {done.last_t:g} s: {done.ending.value}.")
    y = done.y
    if p.static_motor:
        y = y.copy()
        y[:, 4] = p.Mn - (y[:, 2] - p.nominal_speed) / p.impulse.speed_per_torque
    still = float(done.stuck_time.sum())
    text = f"dry friction was followed through {len(done.events)} events; beta stood still for {still:.6g} s"
    finding = Finding("friction", float(len(done.events)), 0.0, "events", "ok", text)
    return y, Health((finding,)), Cost(0.0, done.steps, done.evaluations)


def reference(p: Parameters, scene: Scene) -> Recording:
    """The scene by Lagrange's equations in closed form, at a tolerance of 1e-12. Takes the initial state from p.

    Raises MechlabError for a scene with held rates: its closed form gives mean values, not the motion.
    """
    if any(isinstance(law, HeldRates) for law in scene.laws):
        raise MechlabError(
            f"{NAME}: there is no closed form of the motion with a one-way clutch; take the engine mujoco, pinocchio or hybrid, or "
            "ask for the mean values: mechlab solve impulse_transmission clutch_at_speed=150 M0=750 M1=0."
        )
    t = np.linspace(0.0, scene.duration, 401)
    y, health, cost = simulate(p, t)
    m = build(p, "minimal")
    q, v = (coordinates(p, "minimal", y[:, k], y[:, k + 1]) for k in (0, 2))
    channels, units = basic_channels(m, q, v)
    channels["alpha_force"], units["alpha_force"] = y[:, 4], "N m"
    return Recording(
        m, t, q, v, channels, units, health, cost, replace(HYBRID, engine="analytic", tolerance=1e-12), scene.name,
        fidelity="minimal",
    )  # fmt: skip


def of_scene(name: str) -> Parameters:
    """Parameters of a scene."""
    return Parameters(**SCENES[name].overrides)


def at_constant_speed(p: Parameters, duration: float, tolerance: float = 1e-8) -> tuple[Array, Array, Array]:
    """Times [s], beta and beta' (n,) when the input keeps its initial speed, with dry friction, densely up to `duration` [s]."""
    i, w = p.impulse, p.alpha_rate_0
    # psi runs over the event integration; the time that belongs to it is a state
    psi = i.q * (p.alpha_0 - p.beta_0) + np.linspace(0.0, 1.2 * i.q * w * duration, 3201)
    done = integrate_hybrid(ConstantSpeed(i, w), [p.beta_0, p.beta_rate_0, 0.0, 0.0], psi, rtol=tolerance, atol=1e-2 * tolerance)
    last = int(np.searchsorted(done.y[:, 2], duration)) + 1
    beta, rate, t = done.y[:last, :3].T
    return t, beta, rate
