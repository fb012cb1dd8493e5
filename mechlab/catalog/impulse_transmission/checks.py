"""Checks of the transmission: equations, integral, regime, harmonics against independent computations, moving states."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np

from mechlab.analytic.impulse import (
    Impulse,
    accelerations,
    constant_speed_acceleration,
    first_integral,
    frictionless_mean_speed,
    harmonic_motion,
    periodic_orbit,
    unidirectional,
)
from mechlab.analytic.impulse.regime import motion
from mechlab.catalog.impulse_transmission.build import Parameters, build, full_coordinates, minimal_coordinates
from mechlab.catalog.impulse_transmission.checks_runs import PORTRAIT_CHECK, RUN_CHECKS, STICKING_CHECKS, TURNING
from mechlab.catalog.impulse_transmission.questions import TURNS, closed_cycle
from mechlab.engines.protocol import engine
from mechlab.errors import NoSolution
from mechlab.experiment.entry import Check, CheckResult
from mechlab.integrate import integrate_adaptive
from mechlab.kit import mass_check
from mechlab.kit.benchmark_parts import in_plane
from mechlab.kit.mass_check import NOTHING, Particles, State, solid, spread_of
from mechlab.mechanism.geometry import Array, axis_rotation

ANGLES, RATES = (0.9, 0.35), (1.7, -0.6)
"""Angles [rad] and rates [rad/s] of input and output."""


def state(p: Parameters, fidelity: str) -> State:
    """In `minimal` one planet stands for all and both shafts are massless rotors; in `full` a shaft is a flat disc as wide as
    the orbit of the planets."""
    (alpha, beta), (u, v) = ANGLES, RATES
    orbit, q = p.a + p.b, float(p.q)
    theta, dtheta = ((p.a * x + p.b * y) / orbit for x, y in (ANGLES, RATES))
    psi, dpsi = q * (alpha - beta), q * (u - v)
    count = 1 if fidelity == "minimal" else p.planets
    values = {"alpha": alpha, "beta": beta, "theta": theta, "psi": psi}
    rates = {"alpha": u, "beta": v, "theta": dtheta, "psi": dpsi}
    values |= {f"planet_{k + 1}": psi for k in range(p.planets)}
    rates |= {f"planet_{k + 1}": dpsi for k in range(p.planets)}
    particles, poses = NOTHING, {"carrier": (axis_rotation((0.0, 0.0, 1.0), theta), np.zeros(3))}
    for k in range(count):
        ray = theta + 2.0 * math.pi * k / count
        axis, arm = cmath.rect(orbit, ray), cmath.rect(p.h, ray + psi)
        speed = 1j * (dtheta * axis + (dtheta + dpsi) * arm)
        mass, moment = p.nm / count, max(0.0, p.nJ3 - p.nm * p.h**2) / count
        particles = particles + _flat(mass, moment, axis + arm, speed, dtheta + dpsi)
        name = "planet" if fidelity == "minimal" else f"planet_{k + 1}"
        poses[name] = (axis_rotation((0.0, 0.0, 1.0), ray + psi), np.array(in_plane(axis)))
    rotors = 0.0
    for moment, rate in ((p.J1, u), (p.J2, v)):
        if fidelity == "full":
            particles = particles + _flat(2.0 * moment / orbit**2, moment, 0j, 0j, rate)
        else:
            rotors += 0.5 * moment * rate**2
    return State(values, rates, particles, {}, (0.0, 0.0, 0.0), 2, rotors, stored=p.c * beta * v, poses=poses)


def _flat(mass: float, moment: float, centre: complex, velocity: complex, rate: float) -> Particles:
    spread = spread_of(mass, (0.5 * moment, 0.5 * moment, moment))
    return solid(mass, in_plane(centre), spread, velocity=in_plane(velocity), turn=(0.0, 0.0, rate))


def _moving(p: Parameters) -> CheckResult:
    return mass_check.compare([(build(p, f), state(p, f)) for f in ("minimal", "full")])


MOVING = Check("I12", mass_check.TEXT, _moving, mass_check.SOURCE)

SPEED = 150.0
TABLE = {
    (4.0 / 3.0, 0.0, 0.0): 1.590386, (4.0 / 3.0, 0.0, 20.0): 1.590180, (4.0 / 3.0, 0.0, 750.0): 1.300530,
    (4.0 / 3.0, 2.0, 10.0): -5.494296, (4.0 / 3.0, 18.0, 750.0): 0.500408, (0.8, 0.0, 0.0): 1.667801,
    (0.8, 0.0, 20.0): 1.666680, (0.8, 0.0, 750.0): 0.118886, (0.8, 2.0, 10.0): -3.990234, (0.8, 18.0, 750.0): 0.004055,
}  # fmt: skip
"""(q, M0, M1) -> mean speed at 150 rad/s of set (4); the two with q = 4/5 and M1 = 750 leave sticking out of account."""


def _engine_accelerations(p: Parameters, fidelity: str, states: Array) -> Array:
    """(n, 2) alpha'' and beta'' by Pinocchio's tree, at states (alpha, beta, alpha', beta', Md), resisting torque M0."""
    m = build(p, fidelity)
    place = minimal_coordinates if fidelity == "minimal" else full_coordinates
    rows = np.array([m.row("alpha"), m.row("beta")])
    out = []
    for y in states:
        q, v = (place(p, y[[i]], y[[i + 1]])[0] for i in (0, 2))
        a = engine("pinocchio").accelerations(m, q, v, np.array([y[4], -p.M0]) @ rows)
        out.append(rows @ a)
    return np.array(out)


def i1(p: Parameters) -> CheckResult:
    """100 random states, relative to the largest acceleration."""
    rng = np.random.default_rng(5)
    low = np.array([-3.0, -3.0, 50.0, -60.0, -200.0])
    states = rng.uniform(low, [3.0, 3.0, 250.0, 60.0, 200.0], (100, 5))
    alpha, beta, u, v, motor = states.T
    truth = np.column_stack(accelerations(p.impulse, alpha, beta, u, v, motor, p.M0))
    scale = np.abs(truth).max(axis=0)
    measured = {f"pinocchio {f}": _engine_accelerations(p, f, states) / scale for f in ("minimal", "full")}
    return CheckResult(
        measured, 1e-12, truth / scale, "alpha'' and beta'' with motor torque, load and spring, relative"
    )


def i2(p: Parameters) -> CheckResult:
    """Drift of the first integral along 1 s of the motion, relative."""
    i = replace(p.impulse, c=0.0, M0=0.0, M1=0.0)

    def f(t: float, y: Array) -> Array:
        return np.array([y[1], float(constant_speed_acceleration(i, SPEED, i.q * (SPEED * t - y[0]), y[1], 0.0))])

    done = integrate_adaptive(f, 0.0, [0.0, 0.0], 1.0, rtol=1e-10, atol=1e-12)
    value = first_integral(i, SPEED, i.q * (SPEED * done.t - done.y[:, 0]), SPEED - done.y[:, 1], 0.0)
    return CheckResult(
        {"DOP853 1e-10": np.ptp(value) / abs(value[0])}, 1e-9, 0.0, f"{len(done.t)} steps, no load, no friction"
    )


def i3_table(p: Parameters) -> CheckResult:
    """The formula against the numbers of the specification, to their last digit."""
    measured = []
    for q, M0, M1 in TABLE:
        i = replace(Impulse(), q=q)
        found = unidirectional(i, SPEED, M0, M1)
        measured.append(frictionless_mean_speed(i, SPEED) if M1 == 0.0 else float(found.without_sticking))
    return CheckResult(
        {"analytic": measured}, 1e-6, list(TABLE.values()), "ten cells; two of them ignore that the output would stick"
    )


def i3_events(p: Parameters) -> CheckResult:
    """Mean speed, times and torque by simulation over whole cycles."""
    closed, simulated = [], []
    for q, M0, M1 in TABLE:
        i = replace(Impulse(), q=q, M0=M0, M1=M1)
        found = unidirectional(i, SPEED)
        if M1 == 0.0 or not found.exists:
            continue
        run = closed_cycle(i, SPEED)
        if run is None:
            raise NoSolution(f"no cycle closes for q = {q:g}, M0 = {M0:g}, M1 = {M1:g}.")
        closed.append(
            [
                float(found.mean_speed),
                float(found.forward_time),
                float(found.return_time),
                float(found.mean_motor_torque),
            ]
        )
        simulated.append(
            [run.angle / run.time, run.forward_time / TURNS, run.return_time / TURNS, run.torque_integral / run.time]
        )
    note = f"{len(closed)} sets: mean speed, forward and return time, mean motor torque over {TURNS} cycles"
    return CheckResult({"analytic": closed, "hybrid": simulated}, 1e-7, None, note)


def i3_sticking(p: Parameters) -> CheckResult:
    """Where the closed form says that the output sticks, the simulation sticks; and nowhere else."""
    measured: dict[str, list[float]] = {"analytic": [], "hybrid": []}
    for q, M0, M1 in TABLE:
        if M1 == 0.0:
            continue
        i = replace(Impulse(), q=q, M0=M0, M1=M1)
        run = closed_cycle(i, SPEED)
        measured["analytic"].append(float(not unidirectional(i, SPEED).exists))
        measured["hybrid"].append(float("nan") if run is None else float(run.stuck_psi > 0.0))
    return CheckResult(measured, 0.0, None, "1: sticks; set-valued friction, q = 4/5 with M1 = 750 is the case")


def _harmonic_error(kind: str) -> tuple[float, float]:
    """Largest error of beta and beta' over a period, relative to their amplitudes, against the orbit found by shooting."""
    i = Impulse(M0=0.0, M1=0.0, c=500.0)
    orbit = periodic_orbit(i, SPEED)
    t = np.linspace(0.0, orbit.period, 401)
    truth = motion(i, SPEED, orbit.start, orbit.period, t)
    near = np.array(harmonic_motion(i, SPEED, t, kind))
    error = np.abs(near - truth).max(axis=1) / np.abs(truth).max(axis=1)
    return float(error[0]), float(error[1])


def i4_consistent(p: Parameters) -> CheckResult:
    """The third-order formula against shooting."""
    return CheckResult(
        {"consistent harmonics": _harmonic_error("consistent")[0]}, 1e-3, 0.0, "relative error of beta, figure 7"
    )


def i4_printed(p: Parameters) -> CheckResult:
    """The printed formula: its error is known to two digits."""
    return CheckResult(
        {"printed harmonics": _harmonic_error("printed")[0]}, 5e-5, 0.0118, "relative error of beta, figure 7"
    )


SPEC = "specification of the transmission, part E"
CHECKS = (
    Check("I1", "accelerations of both fidelities against Lagrange's equations at 100 random states", i1, "Lagrange"),
    Check("I2", "first integral along 1 s at constant input speed", i2, "Lagrange"),
    Check("I3a", "table of mean speeds", i3_table, f"{SPEC}, DOP853 runs"),
    Check("I3b", "mean speed, half-phases and torque: closed form against event simulation", i3_events, "each other"),
    Check("I3c", "where the output sticks: closed form against event simulation", i3_sticking, "each other"),
    Check("I4a", "consistent harmonics against shooting", i4_consistent, "shooting, DOP853 1e-12"),
    Check("I4b", "error of the printed harmonics", i4_printed, f"{SPEC}: 1.18 %"),
    *RUN_CHECKS,
    *STICKING_CHECKS,
    PORTRAIT_CHECK,
    MOVING,
    TURNING,
)
