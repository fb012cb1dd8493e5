"""Adaptive integration: accuracy, dense output, and ends that are told, not lost."""

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.integrate import ADAPTIVE, IntegrationStatus, integrate_adaptive


@pytest.mark.parametrize("method", ADAPTIVE)
def test_oscillator_and_dense_output(method):
    found = integrate_adaptive(lambda t, y: np.array([y[1], -y[0]]), 0.0, [1.0, 0.0], 10.0, method=method)
    assert found.complete
    t = np.linspace(0, 10, 101)
    assert np.abs(found.at(t)[:, 0] - np.cos(t)).max() < (1e-8 if method == "DOP853" else 1e-5)
    assert found.at(3.0).shape == (2,)
    with pytest.raises(MechlabError, match="outside the integration"):
        found.at(10.5)


def test_backwards():
    found = integrate_adaptive(lambda t, y: y, 1.0, [np.e], 0.0)
    assert found.y[-1, 0] == pytest.approx(1.0, abs=1e-8)


def test_a_finite_escape_ends_with_an_outcome_and_finite_states():
    found = integrate_adaptive(lambda t, y: y**2, 0.0, [1.0], 2.0)
    assert found.outcome in (IntegrationStatus.STEP_TOO_SMALL, IntegrationStatus.NOT_FINITE)
    assert np.all(np.isfinite(found.y)) and found.t[-1] < 1.0 + 1e-6


def test_not_finite_right_side_and_too_many_evaluations():
    bad = integrate_adaptive(lambda t, y: y * (np.nan if t > 0.5 else 1.0), 0.0, [1.0], 1.0)
    assert bad.outcome is IntegrationStatus.NOT_FINITE and np.all(np.isfinite(bad.y))
    assert integrate_adaptive(lambda t, y: np.array([np.nan]), 0.0, [1.0], 1.0).at(0.0)[0] == 1.0
    many = integrate_adaptive(lambda t, y: -1e6 * (y - np.cos(t)), 0.0, [1.0], 10.0, most_evaluations=500)
    assert many.outcome is IntegrationStatus.TOO_MANY


def test_an_exception_of_the_right_side_is_not_swallowed():
    def broken(t, y):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        integrate_adaptive(broken, 0.0, [1.0], 1.0)


def test_wrong_input():
    with pytest.raises(MechlabError, match="Existing: DOP853, Radau"):
        integrate_adaptive(lambda t, y: y, 0.0, [1.0], 1.0, method="LSODA")
    with pytest.raises(MechlabError, match="different finite"):
        integrate_adaptive(lambda t, y: y, 0.0, [1.0], 0.0)


def test_times_alone_are_answered_as_without_them_for_fewer_evaluations():
    def oscillator(t, y):
        return np.array([y[1], -y[0]])

    whole = integrate_adaptive(oscillator, 0.0, [1.0, 0.0], 20.0)
    few = integrate_adaptive(oscillator, 0.0, [1.0, 0.0], 20.0, times=[0.0, 7.3, 20.0])
    assert np.array_equal(few.at([0.0, 7.3, 20.0]), whole.at([0.0, 7.3, 20.0])) and np.array_equal(few.y, whole.y)
    assert few.evaluations == whole.evaluations - 3 * (len(whole.t) - 1 - 3)
    with pytest.raises(MechlabError, match="not among the times"):
        few.at(12.0)
