"""Integrals of samples against scipy, to the last digit, and against a function that the rule integrates exactly."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, cumulative_trapezoid

from mechlab.integrate.samples import integral_by_chords, integral_by_parabolas


@pytest.mark.parametrize("count", [2, 3, 4, 7, 100, 401])
def test_integrals_are_those_of_scipy(count: int) -> None:
    rng = np.random.default_rng(count)
    t, y = np.cumsum(rng.uniform(0.01, 1.0, count)), rng.normal(size=count)
    assert np.array_equal(integral_by_chords(t, y), cumulative_trapezoid(y, t, initial=0.0))
    if count > 2:
        assert np.array_equal(integral_by_parabolas(t, y), cumulative_simpson(y, x=t, initial=0.0))


def test_parabolas_are_exact_for_parabolas() -> None:
    t = np.array([0.0, 0.1, 0.4, 0.5, 1.1, 1.3])
    np.testing.assert_allclose(integral_by_parabolas(t, 3.0 * t**2 - t), t**3 - 0.5 * t**2, atol=1e-14)


def test_times_must_increase() -> None:
    with pytest.raises(ValueError, match="must increase"):
        integral_by_parabolas(np.array([0.0, 1.0, 1.0]), np.zeros(3))
