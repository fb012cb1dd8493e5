"""Fixed steps: measured order of every tableau, many states at once, refusal of wrong tableaux, honest ends."""

from fractions import Fraction

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.integrate import HEUN, RK4, TABLEAUX, Tableau, integrate_fixed


def pendulum(t, y):
    return np.stack([y[..., 1], -np.sin(y[..., 0]) + 0.3 * np.cos(t)], axis=-1)


@pytest.mark.parametrize("name", TABLEAUX)
def test_measured_order_is_the_stated_one(name):
    tableau = TABLEAUX[name]
    truth = integrate_fixed(RK4, pendulum, 0.0, [1.0, 0.2], 2.0 / 20000, 20000).y
    errors = [
        np.abs(integrate_fixed(tableau, pendulum, 0.0, [1.0, 0.2], 2.0 / n, n).y - truth).max() for n in (50, 100, 200)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([tableau.order] * 2, abs=0.15)


def test_many_states_at_once_are_the_single_ones():
    starts = np.random.default_rng(0).normal(size=(3, 5, 2))
    together = integrate_fixed(RK4, pendulum, 0.0, starts, 0.01, 50).y
    alone = np.array([[integrate_fixed(RK4, pendulum, 0.0, y, 0.01, 50).y for y in row] for row in starts])
    assert np.array_equal(together, alone)


def test_observe_and_project():
    seen = []
    end = integrate_fixed(
        HEUN,
        lambda t, y: np.array([-y[1], y[0]]),
        0.0,
        [1.0, 0.0],
        0.1,
        100,
        observe=lambda k, t, y: seen.append((k, t, np.hypot(*y))),
        project=lambda t, y: y / np.hypot(*y),
    )
    assert [k for k, _, _ in seen] == list(range(101))
    assert seen[-1][1] == end.t == 100 * 0.1
    assert np.allclose([r for _, _, r in seen], 1.0, atol=1e-15)


def test_a_blow_up_says_when_and_returns_the_last_good_state():
    end = integrate_fixed(RK4, lambda t, y: y**2, 0.0, [1.0], 0.01, 500)
    assert not end.complete and np.all(np.isfinite(end.y)) and 0.9 < end.t < 1.2
    assert "not finite" in end.reason


def test_wrong_tableaux_are_refused_with_the_condition_that_fails():
    half, one = Fraction(1, 2), Fraction(1)
    with pytest.raises(MechlabError, match="sum b c = 1/4, must be 1/2"):
        Tableau("midpointish", 2, ((), (half,)), (half, half))
    with pytest.raises(MechlabError, match="rows of 0, 1 coefficients"):
        Tableau("ragged", 1, ((), (half, half)), (half, half))
    with pytest.raises(MechlabError, match="order must be 1 to 4"):
        Tableau("high", 5, ((),), (one,))
    with pytest.raises(MechlabError, match="not of order 3"):
        Tableau("boast", 3, HEUN.a, HEUN.b)


@pytest.mark.parametrize("h", [0.0, -1.0, np.nan])
def test_a_step_must_be_positive(h):
    with pytest.raises(MechlabError, match="step size"):
        integrate_fixed(RK4, pendulum, 0.0, [0.0, 0.0], h, 1)
