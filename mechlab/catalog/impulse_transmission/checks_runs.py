"""Checks of runs of the transmission: turning points, periodic orbits, sticking, ends against the reference, portraits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic.impulse import (
    Impulse,
    accelerations,
    constant_speed_acceleration,
    harmonic_motion,
    motor_rate,
    motor_torque_at,
    periodic_orbit,
    slope,
    unidirectional,
)
from mechlab.analytic.impulse.regime import motion
from mechlab.catalog.impulse_transmission.build import Parameters, build, voltage
from mechlab.catalog.impulse_transmission.scenes import end, hybrid_run, mujoco_run, of_scene, simulate
from mechlab.errors import NoSolution
from mechlab.experiment.entry import Check, CheckResult
from mechlab.integrate import integrate_adaptive
from mechlab.kit.portrait import flow
from mechlab.mechanism.geometry import Array

SPEED = 150.0


def _turning_points() -> tuple[list[float], list[float]]:
    """(measured, expected): half-phases of one-way rotation, integrated from one standstill to the next."""
    i = replace(Impulse(), M0=18.0, M1=750.0)
    found = unidirectional(i, SPEED)
    psi, measured = float(found.psi_a), []
    for load, time in ((i.M0 + i.M1, float(found.forward_time)), (i.M0 - i.M1, float(found.return_time))):

        def half(_: float, y: Array, load: float = load) -> Array:
            accel = float(constant_speed_acceleration(i, SPEED, y[0], y[1], load))
            return np.array([i.q * (SPEED - y[1]), accel])

        psi, rate = integrate_adaptive(half, 0.0, [psi, 0.0], time, rtol=1e-12, atol=1e-12).y[-1]
        measured += [float(psi), float(rate)]
    a, b = float(found.psi_a), float(found.psi_b)
    return [*measured, float(found.sine)], [b, 0.0, a + 2.0 * np.pi, 0.0, float(np.sin(0.5 * (a + b)))]


def _orbit() -> tuple[list[float], list[float]]:
    """(measured, expected): period, sine amplitudes and return to the start of the orbit of figure 7; rates of the
    harmonics against central differences."""
    i = Impulse(M0=0.0, M1=0.0, c=500.0)
    orbit, period = periodic_orbit(i, SPEED), 2.0 * np.pi / (i.q * SPEED)
    t = np.linspace(0.0, period, 201)
    beta = motion(i, SPEED, orbit.start, period, t)[0]
    sines = [2.0 * float(np.mean((beta * np.sin(m * i.q * SPEED * t))[:-1])) for m in (1, 2, 3)]
    home = motion(i, SPEED, orbit.start, period)[:, -1]
    step, at = 1e-6 / SPEED, np.array([0.0, 0.3, 0.7]) * period
    slopes = (harmonic_motion(i, SPEED, at + step)[0] - harmonic_motion(i, SPEED, at - step)[0]) / (2.0 * step)
    measured = [orbit.period, *(1e2 * orbit.sines), *orbit.start, *harmonic_motion(i, SPEED, at)[1]]
    return measured, [period, *(1e2 * np.array(sines)), *home, *slopes]


def _system(p: Parameters) -> tuple[list[float], list[float]]:
    """(measured, expected): the first-order system against accelerations under load and friction, and motor lag."""
    i = replace(p.impulse, tau=p.tau or 0.01)  # a static motor has no rate
    alpha, beta, u, v, motor = y = [0.4, -0.2, 210.0, -3.0, 120.0]
    first, second = (float(x) for x in accelerations(i, alpha, beta, u, v, motor, i.M0 - i.M1))
    expected = np.array([u, v, first, second, (float(motor_torque_at(i, u)) - motor) / i.tau])
    scale = np.maximum(1.0, np.abs(expected))
    return list(slope(i, y) / scale), list(expected / scale)


def i13(p: Parameters) -> CheckResult:
    """Turning points, orbit with harmonics, and first-order system, each against an independent computation."""
    pairs = (_turning_points(), _orbit(), _system(p))
    measured, expected = ([x for pair in pairs for x in pair[k]] for k in (0, 1))
    # Differences over 1e-6 of a radian: 1e-10 of rates of 10 rad/s in rounding; Newton ends at gaps of 1e-9 rad/s.
    note = (
        "psi [rad] and speed at the turning points, sine; period [s], 100 x amplitudes, start; rates; system, relative"
    )
    return CheckResult({"closed form": measured}, 1e-7, expected, note)


TURNING = Check(
    "I13", "turning points, orbit, harmonics and first-order system against the motion", i13, "DOP853 1e-12"
)


def i7_effort(p: Parameters) -> CheckResult:
    """Evaluations of the sticking scene, against a bound; with sign() friction 4e5 do not reach the end."""
    recording = hybrid_run(of_scene("sticking"), "sticking", 0.3)
    return CheckResult({"hybrid": float(recording.cost.evaluations)}, 5e4, 5e4, "evaluations, must lie below 1e5")


def i7_sticking(p: Parameters) -> CheckResult:
    """Sticking by Pinocchio's tree and by the closed form: state at the end."""
    q = of_scene("sticking")
    truth = simulate(q, np.array([0.0, 0.3]))[0][-1][[1, 3, 2, 4]]
    return CheckResult(
        {"analytic": truth, "hybrid": end(hybrid_run(q, "sticking", 0.3))}, 1e-6, None, "beta, beta', alpha', Md"
    )


def smoothed_end(p: Parameters, duration: float, width: float) -> Array:
    """(5,) state at the end with M1 tanh(beta' / width) instead of dry friction, by DOP853 1e-9."""

    def f(t: float, y: Array) -> Array:
        return slope(p.impulse, y, width)

    done = integrate_adaptive(f, 0.0, p.start, duration, rtol=1e-9, atol=1e-11, most_evaluations=2_000_000)
    if not done.complete:
        raise NoSolution(f"tanh friction of width {width:g}: {done.outcome.value}.")
    return np.asarray(done.y[-1])


def i7_tanh(p: Parameters) -> CheckResult:
    """Friction smoothed by tanh converges to the sticking solution with the first power of its width."""
    q = of_scene("sticking")
    truth = simulate(q, np.array([0.0, 0.3]))[0][-1]
    error = [abs(smoothed_end(q, 0.3, w)[3] - truth[3]) for w in (0.2, 0.1)]
    order = float(np.log2(error[0] / error[1]))
    return CheckResult(
        {"tanh": order}, 0.25, 1.0, f"order in the width; errors of beta' {error[0]:.2g}, {error[1]:.2g} rad/s"
    )


STICKING_CHECKS = (
    Check("I7a", "evaluations of the sticking scene", i7_effort, "specification: below 1e5"),
    Check("I7b", "sticking by the tree and by the closed form", i7_sticking, "each other"),
    Check("I7c", "smoothed friction comes to the sticking solution linearly", i7_tanh, "event simulation", slow=True),
)

ENDS = {
    ("fig2", 0.08): (0.844255524, 26.0880111, 152.2493379, 130.481103),
    ("fig4", 0.3): (-0.069692731, -25.7149253, 217.5751425, 144.387078),
}
"""beta, beta', alpha', Md at the end; DOP853 1e-10 with events, scipy 1.17, from the specification."""


def i5(p: Parameters) -> CheckResult:
    """Ends of two figures by Pinocchio with events and by the closed form with events."""
    measured: dict[str, list[Array]] = {"analytic": [], "hybrid": []}
    for scene, duration in ENDS:
        q = of_scene(scene)
        measured["analytic"].append(simulate(q, np.array([0.0, duration]))[0][-1][[1, 3, 2, 4]])
        measured["hybrid"].append(end(hybrid_run(q, scene, duration)))
    return CheckResult(
        {k: np.array(v) for k, v in measured.items()}, 1e-6, list(ENDS.values()), "beta, beta', alpha', Md"
    )


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
