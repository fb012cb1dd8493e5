"""Checks of the transmission: equations, regime, harmonics, closed forms, each against an independent computation; `CHECKS`."""

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
    motor_torque_at,
    periodic_orbit,
    slope,
    unidirectional,
)
from mechlab.analytic.impulse.regime import motion
from mechlab.catalog.impulse_transmission.build import Parameters, build, coordinates
from mechlab.catalog.impulse_transmission.checks_runs import (
    clutch_to_the_housing,
    effort_of_sticking,
    motor_of_the_file,
    order_of_steps,
    portraits,
    rough_ends,
    slip_of_meshes,
    smooth_end,
    smoothed_sticking,
    sticking,
)
from mechlab.catalog.impulse_transmission.questions import ANSWERS, TURNS, Cycle, closed_cycle
from mechlab.catalog.impulse_transmission.scenes import FIGURE_7, SPEED
from mechlab.engines.protocol import engine
from mechlab.errors import NoSolution
from mechlab.experiment.entry import Check, CheckResult
from mechlab.integrate import integrate_adaptive
from mechlab.kit.benchmark_parts import in_plane
from mechlab.kit.checks import moving_in_fidelities
from mechlab.kit.mass_check import NOTHING, Particles, State, solid, spread_of
from mechlab.mechanism.geometry import Array, axis_rotation

FIDELITIES = ("minimal", "full")
TABLE = {
    (4.0 / 3.0, 0.0, 0.0): 1.590386, (4.0 / 3.0, 0.0, 20.0): 1.590180, (4.0 / 3.0, 0.0, 750.0): 1.300530,
    (4.0 / 3.0, 2.0, 10.0): -5.494296, (4.0 / 3.0, 18.0, 750.0): 0.500408, (0.8, 0.0, 0.0): 1.667801,
    (0.8, 0.0, 20.0): 1.666680, (0.8, 0.0, 750.0): 0.118886, (0.8, 2.0, 10.0): -3.990234, (0.8, 18.0, 750.0): 0.004055,
}  # fmt: skip
"""(q, M0, M1) -> mean speed at 150 rad/s of set (4), that of figure 5; the two with q = 4/5 and M1 = 750 leave sticking out of account."""
SETS = [replace(Impulse(), q=q, M0=M0, M1=M1) for q, M0, M1 in TABLE]


def equations(p: Parameters) -> CheckResult:
    """Accelerations at 100 random states with motor torque, load and spring, relative to the largest."""
    rng = np.random.default_rng(5)
    states = rng.uniform([-3.0, -3.0, 50.0, -60.0, -200.0], [3.0, 3.0, 250.0, 60.0, 200.0], (100, 5))
    alpha, beta, u, v, motor = states.T
    truth = np.column_stack(accelerations(p.impulse, alpha, beta, u, v, motor, p.M0))
    scale = np.abs(truth).max(axis=0)
    measured = {}
    for fidelity in FIDELITIES:
        m = build(p, fidelity)
        rows = np.array([m.row("alpha"), m.row("beta")])
        q, rates = coordinates(p, fidelity, alpha, beta), coordinates(p, fidelity, u, v)
        given = zip(q, rates, ([torque, -p.M0] @ rows for torque in motor), strict=True)
        found = [rows @ engine("pinocchio").accelerations(m, *state) for state in given]
        measured[f"pinocchio {fidelity}"] = np.array(found) / scale
    note = "alpha'' and beta'' with motor torque, load and spring, relative"
    return CheckResult(measured, 1e-12, truth / scale, note)


def integral(p: Parameters) -> CheckResult:
    """Drift of the first integral along 1 s of the motion, relative."""
    i = replace(p.impulse, c=0.0, M0=0.0, M1=0.0)

    def f(t: float, y: Array) -> Array:
        return np.array([y[1], float(constant_speed_acceleration(i, SPEED, i.q * (SPEED * t - y[0]), y[1], 0.0))])

    done = integrate_adaptive(f, 0.0, [0.0, 0.0], 1.0, rtol=1e-10, atol=1e-12, times=())
    value = first_integral(i, SPEED, i.q * (SPEED * done.t - done.y[:, 0]), SPEED - done.y[:, 1], 0.0)
    drift = np.ptp(value) / abs(value[0])
    return CheckResult({"DOP853 1e-10": drift}, 1e-9, 0.0, f"{len(done.t)} steps, no load, no friction")


def mean_speeds(p: Parameters) -> CheckResult:
    """The formula against the numbers of the specification, to their last digit."""
    found = [
        float(unidirectional(i, SPEED).without_sticking) if i.M1 else frictionless_mean_speed(i, SPEED) for i in SETS
    ]
    note = "ten cells; two of them ignore that the output would stick"
    return CheckResult({"analytic": found}, 1e-6, list(TABLE.values()), note)


def _simulated(i: Impulse) -> Cycle:
    found = closed_cycle(i, SPEED)
    if found is None:
        raise NoSolution(f"no cycle closes for q = {i.q:g}, M0 = {i.M0:g}, M1 = {i.M1:g}.")
    return found


def regimes(p: Parameters) -> CheckResult:
    """Mean speed, times and torque by simulation over whole cycles."""
    moving = [(i, found) for i in SETS if i.M1 and (found := unidirectional(i, SPEED)).exists]
    values = {
        "analytic": [[float(getattr(found, key)) for key in ANSWERS] for _, found in moving],
        "hybrid": [[getattr(_simulated(i), key) for key in ANSWERS] for i, _ in moving],
    }
    note = f"{len(moving)} sets: mean speed, forward and return time, mean motor torque over {TURNS} cycles"
    return CheckResult(values, 1e-7, None, note)


def where_it_sticks(p: Parameters) -> CheckResult:
    """Where the closed form says that the output sticks, the simulation sticks; and nowhere else."""
    rough = [i for i in SETS if i.M1]
    values = {
        "analytic": [float(not unidirectional(i, SPEED).exists) for i in rough],
        "hybrid": [float(_simulated(i).stuck_psi > 0.0) for i in rough],
    }
    return CheckResult(values, 0.0, None, "1: sticks; set-valued friction, q = 4/5 with M1 = 750 is the case")


def error_of_harmonics(kind: str) -> float:
    """Largest error of beta over a period, relative to its amplitude, against the orbit found by shooting."""
    orbit = periodic_orbit(FIGURE_7, SPEED)
    t = np.linspace(0.0, orbit.period, 401)
    truth = motion(FIGURE_7, SPEED, orbit.start, orbit.period, t)[0]
    return float(np.abs(harmonic_motion(FIGURE_7, SPEED, t, kind)[0] - truth).max() / np.abs(truth).max())


def consistent_harmonics(p: Parameters) -> CheckResult:
    """The formula with all terms of the third order."""
    return CheckResult(
        {"consistent harmonics": error_of_harmonics("consistent")}, 1e-3, 0.0, "relative error of beta, figure 7"
    )


def printed_harmonics(p: Parameters) -> CheckResult:
    """The error of the printed formula is the 1.18 % that the specification states, to half of its last digit."""
    return CheckResult(
        {"printed harmonics": error_of_harmonics("printed")}, 5e-5, 0.0118, "relative error of beta, figure 7"
    )


Pair = tuple[list[float], list[float]]


def _turning_points() -> Pair:
    """(measured, expected): half-phases of one-way rotation, integrated from one standstill to the next."""
    i = Impulse(M0=18.0, M1=750.0)
    found = unidirectional(i, SPEED)
    psi, measured = float(found.psi_a), []
    for load, time in ((i.M0 + i.M1, float(found.forward_time)), (i.M0 - i.M1, float(found.return_time))):

        def half(_: float, y: Array, load: float = load) -> Array:
            accel = float(constant_speed_acceleration(i, SPEED, y[0], y[1], load))
            return np.array([i.q * (SPEED - y[1]), accel])

        psi, rate = integrate_adaptive(half, 0.0, [psi, 0.0], time, rtol=1e-12, atol=1e-12, times=()).y[-1]
        measured += [float(psi), float(rate)]
    a, b = float(found.psi_a), float(found.psi_b)
    return [*measured, float(found.sine)], [b, 0.0, a + 2.0 * np.pi, 0.0, float(np.sin(0.5 * (a + b)))]


def _orbit() -> Pair:
    """(measured, expected): period, sine amplitudes and return to the start of the orbit of figure 7; rates of the
    harmonics against central differences."""
    i = FIGURE_7
    orbit, period = periodic_orbit(i, SPEED), 2.0 * np.pi / (i.q * SPEED)
    t = np.linspace(0.0, period, 201)
    beta = motion(i, SPEED, orbit.start, period, t)[0]
    sines = [2.0 * float(np.mean((beta * np.sin(m * i.q * SPEED * t))[:-1])) for m in (1, 2, 3)]
    home = motion(i, SPEED, orbit.start, period)[:, -1]
    step, at = 1e-6 / SPEED, np.array([0.0, 0.3, 0.7]) * period
    slopes = (harmonic_motion(i, SPEED, at + step)[0] - harmonic_motion(i, SPEED, at - step)[0]) / (2.0 * step)
    measured = [orbit.period, *(1e2 * orbit.sines), *orbit.start, *harmonic_motion(i, SPEED, at)[1]]
    return measured, [period, *(1e2 * np.array(sines)), *home, *slopes]


def _system(p: Parameters) -> Pair:
    """(measured, expected): the first-order system against accelerations under load and friction, and motor lag."""
    i = replace(p.impulse, tau=p.tau or 0.01)  # a static motor has no rate
    alpha, beta, u, v, motor = y = [0.4, -0.2, 210.0, -3.0, 120.0]
    first, second = (float(x) for x in accelerations(i, alpha, beta, u, v, motor, i.M0 - i.M1))
    expected = np.array([u, v, first, second, (float(motor_torque_at(i, u)) - motor) / i.tau])
    scale = np.maximum(1.0, np.abs(expected))
    return list(slope(i, y) / scale), list(expected / scale)


def closed_forms(p: Parameters) -> CheckResult:
    """Turning points, orbit with harmonics, and first-order system, each against an independent computation."""
    pairs = (_turning_points(), _orbit(), _system(p))
    measured, expected = ([x for pair in pairs for x in pair[k]] for k in (0, 1))
    note = (
        "psi [rad] and speed at the turning points, sine; period [s], 100 x amplitudes, start; rates; system, relative"
    )
    # Differences over 1e-6 of a radian: 1e-10 of rates of 10 rad/s in rounding; Newton ends at gaps of 1e-9 rad/s.
    return CheckResult({"closed form": measured}, 1e-7, expected, note)


ANGLES, RATES = (0.9, 0.35), (1.7, -0.6)
"""Angles [rad] and rates [rad/s] of input and output in the moving state."""


def state(p: Parameters, fidelity: str) -> State:
    """In `minimal` one planet stands for all and both shafts are massless rotors; in `full` a shaft is a flat disc as wide as
    the orbit of the planets."""
    (alpha, beta), (u, v) = ANGLES, RATES
    orbit, q = p.orbit, float(p.q)
    theta, dtheta = ((p.a * x + p.b * y) / orbit for x, y in (ANGLES, RATES))
    psi, dpsi = q * (alpha - beta), q * (u - v)
    count = 1 if fidelity == "minimal" else p.planets
    planets = [f"planet_{k + 1}" for k in range(p.planets)]
    values = {"alpha": alpha, "beta": beta, "theta": theta, "psi": psi} | dict.fromkeys(planets, psi)
    rates = {"alpha": u, "beta": v, "theta": dtheta, "psi": dpsi} | dict.fromkeys(planets, dpsi)
    particles, poses = NOTHING, {"carrier": (axis_rotation((0.0, 0.0, 1.0), theta), np.zeros(3))}
    for k, name in enumerate(planets[:count]):
        ray = theta + 2.0 * math.pi * k / count
        axis, arm = cmath.rect(orbit, ray), cmath.rect(p.h, ray + psi)
        speed = 1j * (dtheta * axis + (dtheta + dpsi) * arm)
        mass, moment = p.nm / count, max(0.0, p.nJ3 - p.nm * p.h**2) / count
        particles = particles + _flat(mass, moment, axis + arm, speed, dtheta + dpsi)
        pose = (axis_rotation((0.0, 0.0, 1.0), ray + psi), np.array(in_plane(axis)))
        poses["planet" if fidelity == "minimal" else name] = pose
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


SPEC = "specification of the transmission, part E"
EVENTS = "specification, DOP853 1e-10 with events, scipy 1.17"
LAGRANGE = "Lagrange, DOP853 1e-12"
CHECKS = (
    Check("I1", "accelerations of both fidelities against Lagrange's equations at 100 random states", equations, "Lagrange"),
    Check("I2", "first integral along 1 s at constant input speed", integral, "Lagrange"),
    Check("I3a", "table of mean speeds", mean_speeds, f"{SPEC}, DOP853 runs"),
    Check("I3b", "mean speed, half-phases and torque: closed form against event simulation", regimes, "each other"),
    Check("I3c", "where the output sticks: closed form against event simulation", where_it_sticks, "each other"),
    Check("I4a", "consistent harmonics against shooting", consistent_harmonics, "shooting, DOP853 1e-12"),
    Check("I4b", "error of the printed harmonics", printed_harmonics, f"{SPEC}: 1.18 %"),
    Check("I5", "ends of figures 2 and 4 with exact friction", rough_ends, EVENTS),
    Check("I6a", "MuJoCo, minimal, RK4 0.097 ms, 1 s of figure 7", smooth_end, LAGRANGE),
    Check("I6b", "order of RK4 in MuJoCo with the motor", order_of_steps, LAGRANGE),
    Check("I6c", "MuJoCo, full: slip of the meshes", slip_of_meshes, "the relations"),
    Check("I6d", "the DC motor of the model file", motor_of_the_file, "the source's motor equation"),
    Check("I7a", "evaluations of the sticking scene", effort_of_sticking, "specification: below 1e5"),
    Check("I7b", "sticking by the tree and by the closed form", sticking, "each other"),
    Check("I7c", "smoothed friction comes to the sticking solution linearly", smoothed_sticking, "event simulation", slow=True),
    Check("I11", "portraits of 0.5 s by vectorized RK4", portraits, "DOP853 1e-10"),
    moving_in_fidelities("I12", build, state, FIDELITIES),
    Check("I13", "turning points, orbit, harmonics and first-order system against the motion", closed_forms, "DOP853 1e-12"),
    Check("I14", "cycle with a one-way clutch to the housing: closed form against integration", clutch_to_the_housing, "each other"),
)  # fmt: skip
