"""Collocation at Radau points: exact solutions, stiff ones, its order, dense output, ends that are told."""

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.integrate import IntegrationStatus
from mechlab.integrate.collocation import integrate_collocated, radau_points


def oscillator(t, y):
    return np.stack([y[..., 1], -y[..., 0]], axis=-1)


def test_the_points_integrate_polynomials_exactly():
    """A c^k = c^(k+1) / (k+1) below the number of points; Gauss-Radau is exact up to degree 2 s - 2 over the whole step."""
    for s in (3, 9):
        x = radau_points(s)
        for k in range(s):
            assert x.integrals @ x.nodes**k == pytest.approx(x.nodes ** (k + 1) / (k + 1), abs=1e-14)
        for k in range(2 * s - 1):
            assert x.integrals[-1] @ x.nodes**k == pytest.approx(1.0 / (k + 1), abs=1e-14)
        assert x.nodes[-1] == 1.0


def test_three_points_are_radau_5():
    """Coefficients as printed: Hairer & Wanner, Solving ODEs II, table 5.6."""
    root = np.sqrt(6.0)
    printed = [
        [(88 - 7 * root) / 360, (296 - 169 * root) / 1800, (-2 + 3 * root) / 225],
        [(296 + 169 * root) / 1800, (88 + 7 * root) / 360, (-2 - 3 * root) / 225],
        [(16 - root) / 36, (16 + root) / 36, 1 / 9],
    ]
    assert radau_points(3).integrals == pytest.approx(np.array(printed), abs=1e-14)


def test_oscillator_and_dense_output():
    found = integrate_collocated(oscillator, 0.0, [1.0, 0.0], 20.0, rtol=1e-12, atol=1e-13)
    assert found.complete and found.t[-1] == 20.0
    t = np.linspace(0.0, 20.0, 401)
    # each of some 60 steps leaves 1e-12 at most
    assert np.abs(found.at(t)[:, 0] - np.cos(t)).max() < 1e-11
    assert found.at(3.0).shape == (2,) and found.at(t[:6].reshape(2, 3)).shape == (2, 3, 2)
    assert found.y[0] == pytest.approx([1.0, 0.0]) and len(found.t) < 80


def test_the_error_follows_the_tolerance():
    t = np.linspace(0.0, 20.0, 401)
    for tolerance in (1e-4, 1e-7, 1e-10):
        found = integrate_collocated(oscillator, 0.0, [1.0, 0.0], 20.0, rtol=tolerance, atol=tolerance)
        assert np.abs(found.at(t)[:, 0] - np.cos(t)).max() < 20.0 * tolerance


@pytest.mark.parametrize("fast", [1e2, 1e5, 1e8])
def test_a_stiff_equation_whose_solution_is_known(fast):
    """y' = -fast (y - cos t) - sin t from cos 0: Prothero and Robinson's problem; y = cos t however fast."""
    found = integrate_collocated(lambda t, y: -fast * (y - np.cos(t)[:, None]) - np.sin(t)[:, None], 0.0, [1.0], 10.0)
    t = np.linspace(0.0, 10.0, 101)
    assert found.complete and len(found.t) < 100
    # rounding of the slope, 1e-16 fast, counts 1 / fast
    assert np.abs(found.at(t)[:, 0] - np.cos(t)).max() < 1e-9


def test_a_fast_transient_is_followed_and_left_behind():
    found = integrate_collocated(lambda t, y: -1e4 * (y - 1.0), 0.0, [0.0], 1.0, rtol=1e-10, atol=1e-12)
    t = np.array([1e-5, 1e-4, 3e-4, 1e-3, 1.0])
    assert found.at(t)[:, 0] == pytest.approx(1.0 - np.exp(-1e4 * t), abs=1e-9)
    assert len(found.t) < 60


def test_ends_are_told():
    escape = integrate_collocated(lambda t, y: y**2, 0.0, [1.0], 2.0)
    assert escape.outcome in (IntegrationStatus.STEP_TOO_SMALL, IntegrationStatus.NOT_FINITE)
    assert np.all(np.isfinite(escape.y)) and escape.t[-1] < 1.0 + 1e-6
    bad = integrate_collocated(lambda t, y: y * np.where(t > 0.5, np.nan, 1.0)[:, None], 0.0, [1.0], 1.0)
    assert not bad.complete and np.all(np.isfinite(bad.y)) and bad.t[-1] <= 0.5
    assert bad.at(0.25)[0] == pytest.approx(np.exp(0.25), abs=1e-8)
    start = integrate_collocated(lambda t, y: np.full(y.shape, np.nan), 0.0, [1.0], 1.0)
    assert start.outcome is IntegrationStatus.NOT_FINITE and start.at(0.0)[0] == 1.0
    many = integrate_collocated(oscillator, 0.0, [1.0, 0.0], 100.0, most_evaluations=50)
    assert many.outcome is IntegrationStatus.TOO_MANY


def test_wrong_times():
    for end in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(MechlabError, match="after it"):
            integrate_collocated(oscillator, 0.0, [1.0, 0.0], end)


def test_nothing_moves():
    found = integrate_collocated(lambda t, y: 0.0 * y, 0.0, [2.0, -1.0], 3.0)
    assert found.complete and found.at(1.5) == pytest.approx([2.0, -1.0])
