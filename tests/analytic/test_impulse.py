"""Closed forms of the inertial-impulse transmission against independent computations."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechlab.analytic.impulse import (
    Impulse,
    accelerations,
    after_turns,
    coefficients,
    constant_speed_acceleration,
    first_integral,
    frictionless_mean_speed,
    harmonic_amplitudes,
    harmonic_motion,
    motor_orbit,
    periodic_orbit,
    resonances,
    section_points,
    shape,
    slip_speed,
    slope,
    unidirectional,
)  # fmt: skip
from mechlab.errors import MechlabError, NoSolution

SET_4 = Impulse()


def planets_kinetic_energy(p: Impulse, alpha, beta, u, v, n=5):
    """Kinetic energy from the Cartesian motion of every planet's mass centre, independent of A1, A2, A3."""
    theta, psi = (p.a * alpha + p.b * beta) / p.k, p.q * (alpha - beta)
    dtheta, dpsi = (p.a * u + p.b * v) / p.k, p.q * (u - v)
    spin = dtheta + dpsi
    total = 0.5 * p.J1 * u**2 + 0.5 * p.J2 * v**2
    for i in range(n):
        at = theta + 2 * math.pi * i / n
        angle = at + psi
        vx = -p.k * math.sin(at) * dtheta - p.h * math.sin(angle) * spin
        vy = p.k * math.cos(at) * dtheta + p.h * math.cos(angle) * spin
        total += 0.5 * p.nm / n * (vx**2 + vy**2) + 0.5 * (p.nJ3 - p.nm * p.h**2) / n * spin**2
    return total


def test_kinetic_energy_is_that_of_the_planets() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        alpha, beta, u, v = rng.normal(size=4)
        A1, A2, A3, *_ = coefficients(SET_4, SET_4.q * (alpha - beta))
        assert math.isclose(
            0.5 * A1 * u * u + A2 * u * v + 0.5 * A3 * v * v,
            planets_kinetic_energy(SET_4, alpha, beta, u, v),
            rel_tol=1e-12,
        )


def test_energy_grows_by_the_power_of_the_torques() -> None:
    p = replace(SET_4, c=300.0)
    rng = np.random.default_rng(2)
    for _ in range(20):
        alpha, beta, u, v = rng.normal(size=4) * [1, 1, 10, 10]
        du, dv = (float(x) for x in accelerations(p, alpha, beta, u, v, 30.0, 7.0))
        h = 1e-6

        def energy(s, alpha=alpha, beta=beta, u=u, v=v, du=du, dv=dv):
            b = beta + s * v + s * s * dv / 2
            return (
                planets_kinetic_energy(p, alpha + s * u + s * s * du / 2, b, u + s * du, v + s * dv) + 0.5 * p.c * b * b
            )

        # Central difference of energies of order 1e4: rounding 1e-16 * 1e4 / 1e-6 = 1e-6.
        assert math.isclose((energy(h) - energy(-h)) / (2 * h), 30.0 * u - 7.0 * v, rel_tol=1e-6, abs_tol=1e-3)


def test_input_may_be_the_carrier() -> None:
    p = Impulse(a=0.1, b=0.0)
    A = coefficients(p, 0.3)
    assert math.isclose(A[2], p.J2 + p.q**2 * p.nJ3) and A[4] == 0.0


def test_constant_speed_is_the_second_equation() -> None:
    p = replace(SET_4, c=200.0)
    alpha, beta, w, v = 0.7, 0.2, 150.0, 8.0
    A1, A2, A3, A4, A5, A6 = (float(x) for x in coefficients(p, p.q * (alpha - beta)))
    dv = float(constant_speed_acceleration(p, w, p.q * (alpha - beta), v, 5.0, beta))
    torque = A2 * dv + A4 * (w - v) ** 2 + A6 * v * v
    du, again = accelerations(p, alpha, beta, w, v, torque, 5.0)
    assert abs(float(du)) < 1e-9 and math.isclose(float(again), dv, rel_tol=1e-10)


def test_arrays_broadcast() -> None:
    y = np.random.default_rng(3).normal(size=(4, 3, 5))
    whole = slope(SET_4, y)
    assert whole.shape == y.shape and np.allclose(whole[2, 1], slope(SET_4, y[2, 1]), rtol=1e-14)


def test_first_integral_and_slip_are_inverse() -> None:
    p = replace(SET_4, M0=0.0, M1=0.0)
    psi = np.linspace(0.0, 5.0, 7)
    E = first_integral(p, 150.0, psi, 140.0, 12.0)
    assert np.allclose(slip_speed(p, 150.0, psi, E, 12.0), 140.0)
    with pytest.raises(MechlabError, match="c = 0"):
        first_integral(replace(p, c=1.0), 150.0, 0.0, 1.0, 0.0)


def test_limit_of_weak_friction_is_the_integral() -> None:
    for q in (4 / 3, 4 / 5):
        p = replace(SET_4, q=q)
        # The regime approaches its limit quadratically in M1: 1e-5 of M1 = 20's change of 2e-4 (1.1e-3).
        assert math.isclose(
            frictionless_mean_speed(p, 150.0), float(unidirectional(p, 150.0, 0.0, 0.01).mean_speed), abs_tol=1e-8
        )


@pytest.mark.parametrize(("M0", "M1", "word"), [(20.0, 10.0, "M0"), (0.0, 3000.0, "sin"), (0.0, 1700.0, "sticks")])
def test_no_such_regime_says_why(M0, M1, word) -> None:
    found = unidirectional(SET_4, 150.0, M0, M1)
    assert not found.exists and word in str(found.reason) and np.isnan(found.mean_speed)


def test_existence_limit_is_where_the_sine_is_one() -> None:
    s = shape(SET_4)
    limit = 2 * (s.a6 - s.a5) * 150.0**2 / math.pi  # M0 = 0: Delta = pi
    assert float(unidirectional(SET_4, 150.0, 0.0, limit * 1.0001).sine) > 1.0
    assert "sin" in str(unidirectional(SET_4, 150.0, 0.0, limit * 1.0001).reason)
    assert "sin" not in str(unidirectional(SET_4, 150.0, 0.0, limit * 0.9999).reason)


def test_orbit_closes_and_has_neutral_multipliers() -> None:
    p = Impulse(M0=0.0, M1=0.0, c=500.0)
    orbit = periodic_orbit(p, 150.0)
    points = section_points(p, 150.0, orbit.start, 3)
    assert np.allclose(points, orbit.start, atol=1e-7)
    assert np.allclose(np.abs(orbit.multipliers), 1.0, atol=1e-6)
    # Shooting of the specification, DOP853 1e-10, scipy 1.17.
    assert np.allclose(orbit.sines, [-0.11567233, -0.00482743, -0.00033636], atol=1e-8)


def test_harmonics_agree_for_small_unbalance() -> None:
    p = Impulse(M0=0.0, M1=0.0, c=500.0, h=0.0083)
    beta, _ = harmonic_motion(p, 150.0, np.array([0.001, 0.004]))
    assert np.all(np.isfinite(beta))
    # Amplitudes of order h: what is left out is of order h^5.
    assert np.allclose(harmonic_amplitudes(p, 150.0), periodic_orbit(p, 150.0).sines, atol=1e-8)
    assert resonances(p, 150.0)[0] < 0.1


def test_shooting_without_an_orbit_says_so() -> None:
    p = Impulse(M0=0.0, M1=0.0)
    with pytest.raises(NoSolution, match="resonance"):
        periodic_orbit(replace(p, c=shape(p).B3 * p.q**2 * 150.0**2 * 1.001), 150.0)


@pytest.mark.parametrize(
    "bad",
    [{"nJ3": 0.01}, {"a": -0.2}, {"q": 0.0}, {"M1": -1.0}, {"Mn": 0.0}, {"nominal_speed": 300.0}, {"J1": math.nan}],
)
def test_impossible_transmissions_are_refused(bad) -> None:
    with pytest.raises(MechlabError):
        Impulse(**bad)


def test_offset_counts_in_the_inertia_exactly() -> None:
    assert Impulse(nJ3=8.0 * 0.083**2).nJ3 > 0
    with pytest.raises(MechlabError, match="nm h"):
        Impulse(nJ3=8.0 * 0.083**2 * 0.999)


def test_with_the_motor_neighbours_come_nearer_as_the_multipliers_say() -> None:
    """A light input shaft, which swings, and so is damped by its motor: against runs in time up to the same turn of the planets."""
    p = Impulse(M0=0.0, M1=0.0, Mn=10.0, c=500.0, J1=0.6, tau=0.01)
    guess = periodic_orbit(replace(p, J1=14.0), 150.0).start[1]
    cycle = motor_orbit(p, np.array([0.0, 153.0, guess, 0.0]))
    turns, away = 30, np.array([2e-4, 0.0, 0.0, 0.0])

    def end(z: np.ndarray) -> np.ndarray:
        def full(t: float, y: np.ndarray) -> float:
            return float(p.q * (y[0] - y[1]) - 2.0 * np.pi * turns)

        full.terminal, full.direction = True, 1.0  # type: ignore[attr-defined]
        start = [z[0], *z]  # psi = 0: alpha = beta
        run = solve_ivp(lambda t, y: slope(p, y), (0.0, 2.0 * turns * cycle.period), start, "LSODA", rtol=1e-11, atol=1e-12, events=full)
        return np.asarray(run.y_events[0][0])[1:]

    same = end(cycle.start)
    np.testing.assert_allclose(same, cycle.start, atol=1e-6)  # it is periodic
    _, vectors = np.linalg.eig(_derivative(p, cycle.start))
    shares = np.linalg.solve(vectors, away)
    left = np.linalg.norm(np.linalg.solve(vectors, end(cycle.start + away) - same)[np.abs(shares).argmax()]) / np.abs(shares).max()
    slowest = np.abs(cycle.multipliers[0])
    assert 1e-4 < cycle.approach < 0.5
    # The distance is small, but not zero: what is of second order in it leaves some per cent.
    assert left == pytest.approx(slowest**turns, rel=0.05)


def _derivative(p: Impulse, z: np.ndarray) -> np.ndarray:
    """Of the map over a turn, by one-sided differences."""
    steps = np.array([1e-6, 1e-4, 1e-5, 1e-3])
    ends = after_turns(p, np.vstack([z, z + np.diag(steps)]))[0]
    return ((ends[1:] - ends[0]) / steps[:, None]).T


def test_no_cycle_with_the_motor_under_dry_friction() -> None:
    with pytest.raises(MechlabError, match="dry friction"):
        motor_orbit(Impulse(M1=5.0, c=500.0), np.zeros(4))
