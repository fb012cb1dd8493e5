"""Dry friction against closed forms: sliding, coming to rest, breaking loose, staying; no chatter."""

import math

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.integrate import Ending, integrate_hybrid, modes_at


class Blocks:
    """k unit masses on springs to the ground with dry friction, pushed by force(t): state (x..., v...)."""

    def __init__(self, stiffness, limits, force=lambda t: 0.0):
        self.k, self.limits, self.force = np.array(stiffness, dtype=float), np.array(limits, dtype=float), force
        n = len(self.k)
        self.rates = np.hstack([np.zeros((n, n)), np.eye(n)])
        self.calls = 0

    def push(self, t, y):
        return self.force(t) - self.k * y[: len(self.k)]

    def slope(self, t, y, modes):
        self.calls += 1
        n, m = len(self.k), np.array(modes)
        a = np.where(m == 0, 0.0, self.push(t, y) - m * self.limits)
        return np.concatenate([y[n:], a])

    def holding(self, t, y, modes):
        m = np.array(modes)
        return np.where(m == 0, -self.push(t, y), -m * self.limits)

    def settle(self, t, y, modes):
        out = y.copy()
        n = len(self.k)
        out[n:][np.array(modes) == 0] = 0.0
        return out


def test_oscillator_loses_two_limits_of_stretch_each_half_turn_and_stays() -> None:
    # k = 4, F = 1: the centre of each half oscillation lies F/k = 0.25 beside 0; from 1.1 the turning points are
    # -0.6, 0.1; |k x| <= F holds at 0.1: it stays there from t = 2 pi / 2.
    problem = Blocks([4.0], [1.0])
    t = np.linspace(0.0, 6.0, 61)
    done = integrate_hybrid(problem, [1.1, 0.0], t, rtol=1e-12)
    assert done.complete and [e.after for e in done.events] == [1, 0]
    assert math.isclose(done.events[0].t, math.pi / 2, abs_tol=1e-10)
    assert math.isclose(done.events[1].t, math.pi, abs_tol=1e-10)
    first = t < math.pi / 2
    assert np.allclose(done.y[first, 0], 0.25 + 0.85 * np.cos(2 * t[first]), atol=1e-10)
    second = (t > math.pi / 2) & (t < math.pi)
    assert np.allclose(done.y[second, 0], -0.25 + 0.35 * np.cos(2 * t[second]), atol=1e-10)
    assert np.allclose(done.y[t > math.pi, 0], 0.1, atol=1e-10) and np.all(done.y[t > math.pi, 1] == 0.0)
    assert math.isclose(done.stuck_time[0], 6.0 - math.pi, abs_tol=1e-9)


def test_a_growing_force_breaks_it_loose_at_its_limit() -> None:
    problem = Blocks([0.0], [2.0], lambda t: 3.0 * t)
    done = integrate_hybrid(problem, [0.0, 0.0], [0.0, 2.0], rtol=1e-11)
    start = 2.0 / 3.0
    assert [(e.before, e.after) for e in done.events] == [(0, 1)]
    assert math.isclose(done.events[0].t, start, rel_tol=2e-9)  # the grazing share of 1e-9
    assert math.isclose(done.y[-1, 0], 3.0 * (2.0 - start) ** 3 / 6.0, rel_tol=1e-7)


def test_weak_force_never_moves_it_and_costs_next_to_nothing() -> None:
    problem = Blocks([0.0], [2.0], lambda t: 1.99 * math.sin(30.0 * t))
    done = integrate_hybrid(problem, [0.0, 0.0], [0.0, 10.0])
    assert done.complete and not done.events and np.all(done.y[-1] == 0.0)
    assert problem.calls < 5000


def test_strong_shaking_sticks_and_slips_without_chatter() -> None:
    problem = Blocks([0.0], [1.0], lambda t: 1.2 * math.sin(20.0 * t))
    done = integrate_hybrid(problem, [0.0, 0.0], np.linspace(0.0, 3.0, 301), rtol=1e-10)
    # Each half period: breaks loose where 1.2 sin = 1, stops where the momentum is used up.
    w, sine = 20.0, 1.0 / 1.2
    loose = math.asin(sine) / w
    assert math.isclose(done.events[0].t, loose, rel_tol=1e-8)
    stop = done.events[1].t
    momentum = 1.2 * (math.cos(w * loose) - math.cos(w * stop)) / w - (stop - loose)
    assert abs(momentum) < 1e-10
    assert all(a.after == 0 or b.after == 0 for a, b in zip(done.events, done.events[1:], strict=False))
    assert abs(len(done.events) - 2 * 3.0 * w / math.pi) <= 2
    assert problem.calls < 60000


def test_two_blocks_are_followed_each_on_its_own_time() -> None:
    both = integrate_hybrid(Blocks([4.0, 9.0], [1.0, 0.5]), [1.1, -1.0, 0.0, 0.0], [0.0, 2.0], rtol=1e-12)
    for k, (stiffness, limit, x) in enumerate(((4.0, 1.0, 1.1), (9.0, 0.5, -1.0))):
        one = integrate_hybrid(Blocks([stiffness], [limit]), [x, 0.0], [0.0, 2.0], rtol=1e-12)
        assert np.allclose(both.y[-1][[k, 2 + k]], one.y[-1], atol=1e-9)


def test_modes_at_rest_follow_from_the_force() -> None:
    problem = Blocks([4.0, 4.0, 4.0], [1.0, 1.0, 1.0])
    y = np.array([0.2, 0.3, -0.3, 0.0, 0.0, 0.0])
    assert modes_at(problem, 0.0, y) == (0, -1, 1)


class Held(Blocks):
    """Blocks whose holding forces have bounds of their own and hold rates other than 0."""

    def __init__(self, limits, targets, force):
        super().__init__([0.0] * len(limits), limits, force)
        self.targets = np.array(targets, dtype=float)

    def slope(self, t, y, modes):
        n = len(self.k)
        return np.concatenate([y[n:], self.push(t, y) + self.holding(t, y, modes)])

    def holding(self, t, y, modes):
        m, (low, high) = np.array(modes), self.limits.T
        return np.where(m == 0, -self.push(t, y), np.where(m > 0, low, high))

    def settle(self, t, y, modes):
        out, n = y.copy(), len(self.k)
        out[n:][np.array(modes) == 0] = self.targets[np.array(modes) == 0]
        return out


def test_a_bounded_force_brings_a_rate_to_its_target_and_keeps_it() -> None:
    """Unit mass, push 1, force in -3..2, target 4 from rate 10: it slows by 2 until t = 3, x = 10 t - t^2, and keeps 4 from there."""
    t = np.array([1.0, 3.0, 5.0])
    done = integrate_hybrid(Held([[-3.0, 2.0]], [4.0], lambda t: 1.0), [0.0, 10.0], [0.0, *t], rtol=1e-12)
    assert np.allclose(done.y[1:, 1], [8.0, 4.0, 4.0], atol=1e-11) and np.allclose(done.y[1:, 0], [9.0, 21.0, 29.0], atol=1e-10)
    # the sample at the event shows what comes after it, wherever rounding puts the event
    assert done.modes[:, 0].tolist() == [1, 1, 0, 0] and math.isclose(done.events[0].t, 3.0, abs_tol=1e-11)


def test_an_unbounded_force_holds_from_the_start_and_one_way_only() -> None:
    """Two one-way stops, force at least 0: one is pushed against its stop by cos t until t = pi/2 and is at its target -1 at once; the
    other one is free from the start."""
    force = lambda t: np.array([-math.cos(t), 1.0])  # noqa: E731
    done = integrate_hybrid(Held([[0.0, math.inf]] * 2, [-1.0, 0.0], force), [0.0, 0.0, -2.0, 0.0], [0.0, 1.0, 3.0], rtol=1e-12)
    assert done.y[0, 2] == done.y[1, 2] == -1.0 and done.modes[:, 0].tolist() == [0, 0, 1]
    assert math.isclose(done.events[0].t, math.pi / 2, abs_tol=1e-8)  # the grazing share of 1e-9
    assert math.isclose(done.y[2, 2], -1.0 + 1.0 - math.sin(3.0), abs_tol=1e-8)
    assert np.allclose(done.y[1:, 3], [1.0, 3.0], atol=1e-11) and done.modes[:, 1].tolist() == [1, 1, 1]


def test_without_friction_it_is_plain_dop853() -> None:
    class Free:
        limits, rates = np.zeros(0), np.zeros((0, 2))

        def slope(self, t, y, modes):
            return np.array([y[1], -y[0]])

    done = integrate_hybrid(Free(), [1.0, 0.0], [0.0, 1.0, 2.0], rtol=1e-12)
    assert np.allclose(done.y[:, 0], np.cos([0.0, 1.0, 2.0]), atol=1e-11)


def test_what_cannot_go_on_says_why() -> None:
    class Bad(Blocks):
        def slope(self, t, y, modes):
            return np.full(2, np.nan) if t > 0.5 else super().slope(t, y, modes)

    done = integrate_hybrid(Bad([1.0], [0.1]), [0.0, 1.0], np.linspace(0.0, 1.0, 11))
    assert done.ending is Ending.NOT_FINITE and not done.complete and np.all(np.isfinite(done.y))
    short = integrate_hybrid(Blocks([4.0], [1.0]), [1.1, 0.0], [0.0, 6.0], most_evaluations=50)
    assert short.ending is Ending.TOO_MANY


@pytest.mark.parametrize("times", [[0.0], [1.0, 0.0], [0.0, math.nan]])
def test_times_must_increase(times) -> None:
    with pytest.raises(MechlabError, match="increasing"):
        integrate_hybrid(Blocks([1.0], [1.0]), [0.0, 0.0], times)


def test_shapes_must_fit() -> None:
    with pytest.raises(MechlabError, match="shape"):
        integrate_hybrid(Blocks([1.0], [1.0]), [0.0, 0.0, 0.0], [0.0, 1.0])
