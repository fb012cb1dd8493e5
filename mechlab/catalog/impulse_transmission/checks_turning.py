"""Check I13: turning points, periodic orbits and the equations as a system, each against the motion itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic.impulse import (
    Impulse,
    accelerations,
    constant_speed_acceleration,
    harmonic_motion,
    motor_torque_at,
    periodic_orbit,
    slope,
    unidirectional,
)
from mechlab.analytic.impulse.regime import motion
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.experiment.entry import Check, CheckResult
from mechlab.integrate import integrate_adaptive
from mechlab.mechanism.geometry import Array

SPEED = 150.0


def _turning_points() -> tuple[list[float], list[float]]:
    """(said, expected): the half-phases of one-way rotation, by following the motion from one standstill to the next."""
    i = replace(Impulse(), M0=18.0, M1=750.0)
    found = unidirectional(i, SPEED)
    psi, said = float(found.psi_a), []
    for load, time in ((i.M0 + i.M1, float(found.forward_time)), (i.M0 - i.M1, float(found.return_time))):

        def half(_: float, y: Array, load: float = load) -> Array:
            accel = float(constant_speed_acceleration(i, SPEED, y[0], y[1], load))
            return np.array([i.q * (SPEED - y[1]), accel])

        psi, rate = integrate_adaptive(half, 0.0, [psi, 0.0], time, rtol=1e-12, atol=1e-12).y[-1]
        said += [float(psi), float(rate)]
    a, b = float(found.psi_a), float(found.psi_b)
    return [*said, float(found.sine)], [b, 0.0, a + 2.0 * np.pi, 0.0, float(np.sin(0.5 * (a + b)))]


def _orbit() -> tuple[list[float], list[float]]:
    """Period, return to the start, and sine amplitudes of the orbit of figure 7; rates of the harmonics as differences."""
    i = Impulse(M0=0.0, M1=0.0, c=500.0)
    orbit, period = periodic_orbit(i, SPEED), 2.0 * np.pi / (i.q * SPEED)
    t = np.linspace(0.0, period, 201)
    beta = motion(i, SPEED, orbit.start, period, t)[0]
    sines = [2.0 * float(np.mean((beta * np.sin(m * i.q * SPEED * t))[:-1])) for m in (1, 2, 3)]
    home = motion(i, SPEED, orbit.start, period)[:, -1]
    step, at = 1e-6 / SPEED, np.array([0.0, 0.3, 0.7]) * period
    slopes = (harmonic_motion(i, SPEED, at + step)[0] - harmonic_motion(i, SPEED, at - step)[0]) / (2.0 * step)
    said = [orbit.period, *(1e2 * orbit.sines), *orbit.start, *harmonic_motion(i, SPEED, at)[1]]
    return said, [period, *(1e2 * np.array(sines)), *home, *slopes]


def _system(p: Parameters) -> tuple[list[float], list[float]]:
    """The first-order system against the accelerations under load and dry friction, and the lag of the motor."""
    i = replace(p.impulse, tau=p.tau or 0.01)  # a static motor has no rate
    alpha, beta, u, v, motor = y = [0.4, -0.2, 210.0, -3.0, 120.0]
    first, second = (float(x) for x in accelerations(i, alpha, beta, u, v, motor, i.M0 - i.M1))
    expected = np.array([u, v, first, second, (float(motor_torque_at(i, u)) - motor) / i.tau])
    scale = np.maximum(1.0, np.abs(expected))
    return list(slope(i, y) / scale), list(expected / scale)


def i13(p: Parameters) -> CheckResult:
    """All of it."""
    pairs = (_turning_points(), _orbit(), _system(p))
    said, expected = ([x for pair in pairs for x in pair[k]] for k in (0, 1))
    # Differences over 1e-6 of a radian: 1e-10 of rates of 10 rad/s in rounding; Newton ends at gaps of 1e-9 rad/s.
    note = (
        "psi [rad] and speed at the turning points, sine; period [s], 100 x amplitudes, start; rates; system, relative"
    )
    return CheckResult({"closed form": said}, 1e-7, expected, note)


TURNING = Check(
    "I13", "turning points, orbit, harmonics and first-order system against the motion", i13, "DOP853 1e-12"
)
