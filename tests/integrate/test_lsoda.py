"""LSODA: a stiff problem with a known solution, and an end that is not reached."""

import numpy as np
import pytest

from mechlab.integrate import integrate_lsoda


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8])
def test_a_stiff_problem_follows_its_slow_solution(tolerance: float) -> None:
    """Prothero & Robinson 1974: y' = -k (y - cos t) - sin t has the solution cos t, whatever k."""
    t = np.linspace(0.0, 10.0, 21)
    found = integrate_lsoda(lambda t, y: -1e5 * (y - np.cos(t)) - np.sin(t), np.array([1.0]), t, tolerance)
    assert found.reason == ""
    # local errors of a stiff mode die at once, so that the global error is that of a few steps
    assert np.max(np.abs(found.y[:, 0] - np.cos(t))) < 10.0 * tolerance
    # an explicit method of this stability would need k t / 3 steps, a third of a million
    assert found.evaluations < 5000


def test_what_blows_up_ends_before_it() -> None:
    """y' = y^2 from 1 goes to infinity at t = 1: y = 1 / (1 - t)."""
    t = np.linspace(0.0, 2.0, 21)
    with np.errstate(over="ignore", invalid="ignore"):
        found = integrate_lsoda(lambda t, y: y * y, np.array([1.0]), t, 1e-9)
    assert found.reason
    count = len(found.y)
    assert 5 <= count <= 11 and np.all(np.isfinite(found.y))
    reached = t[:count] < 0.95
    assert found.y[reached, 0] == pytest.approx(1.0 / (1.0 - t[:count][reached]), rel=1e-6)
