"""The physical pendulum by elliptic functions: against its equation of motion, its energy, and its own neighbours."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechlab.analytic.physical_pendulum import PhysicalPendulum
from mechlab.errors import NoSolution

STARTS = [
    (3.1, -0.5 * math.pi, 0.0), (3.1, -0.5 * math.pi, 7.0), (1.8, 1.0, -2.0), (2.0, 7.5, 0.3), (2.0, 0.0, 1e-3),
    (2.0, -3.1, -1.0), (2.0, 0.0, 3.9), (2.0, 0.0, -4.1), (2.0, 9.0, 40.0),
]  # fmt: skip
"""Frequency, angle, rate: swings, one from beyond a full turn, small ones, near the upright position, and turning over."""
T = np.linspace(0.0, 10.0, 101)


@pytest.mark.parametrize("start", STARTS)
def test_it_solves_its_equation(start: tuple[float, float, float]) -> None:
    w, angle, rate = start
    found, speed = PhysicalPendulum(*start).motion(T)
    told = solve_ivp(
        lambda t, y: [y[1], -w * w * math.sin(y[0])], (0.0, 10.0), [angle, rate], "DOP853", T, rtol=1e-13, atol=1e-14
    )
    # DOP853 at 1e-13 a step; next to the upright position what it misses grows a thousandfold
    assert found == pytest.approx(told.y[0], abs=1e-9) and speed == pytest.approx(told.y[1], abs=1e-9)
    energy = 0.5 * speed**2 + w * w * (1.0 - np.cos(found))
    assert energy == pytest.approx(np.full(len(T), energy[0]), rel=1e-12)


@pytest.mark.parametrize("start", STARTS)
def test_the_sensitivity_bounds_what_a_change_of_energy_does(start: tuple[float, float, float]) -> None:
    """The start is moved across the curve that it runs along, in the plane of theta and theta' / w."""
    p = PhysicalPendulum(*start)
    across = np.array([math.sin(p.angle) / 4, p.rate / p.frequency / 2])
    size = 1e-7 * p.modulus_squared / (across @ across)
    other = replace(p, angle=p.angle + size * across[0], rate=p.rate + size * across[1] * p.frequency)
    small = other.modulus_squared - p.modulus_squared
    moved = np.max(np.abs(other.motion(T)[0] - p.motion(T)[0]))
    later, shape = p.sensitivity()
    bound = np.max((later * np.abs(p.motion(T)[1]) * T + shape) * small)
    assert 0.3 * bound < moved < 1.01 * bound


def test_the_period_is_the_complete_integral() -> None:
    """A release from 90 degrees: T = 4 K(sin 45 deg) / w = 7.416298709205487 / w (DLMF 19.6)."""
    p = PhysicalPendulum(1.0, 0.5 * math.pi, 0.0)
    angle, rate = p.motion(np.array([7.416298709205487]))
    assert angle[0] == pytest.approx(0.5 * math.pi, abs=1e-12) and rate[0] == pytest.approx(0.0, abs=1e-12)


def test_where_there_is_no_period_it_says_so() -> None:
    hangs = PhysicalPendulum(2.0, 0.0, 0.0)
    assert np.all(hangs.motion(T)[0] == 0.0)
    with pytest.raises(NoSolution, match="hangs at rest"):
        hangs.sensitivity()
    for upright in (PhysicalPendulum(2.0, math.pi, 0.0), PhysicalPendulum(2.0, 0.0, 4.0)):
        with pytest.raises(NoSolution, match="upright"):
            upright.motion(T)
