"""Starts of many motions at once against the start of each, found on its own."""

from __future__ import annotations

import numpy as np
import pytest

import mechlab as ml
from mechlab.errors import NoSolution
from mechlab.experiment.many_starts import many_initial_states
from mechlab.experiment.scene import Scene, initial_state
from mechlab.mechanism import ConstraintSet, TreeKinematics

CLOSED = 1e-12
"""Both searches close poses to 1e-13 m or rad; at a transmission angle above 10 degrees coordinates follow within ten times that."""


@pytest.mark.parametrize(
    ("name", "fidelity", "values", "rates"),
    [
        ("fourbar", "minimal", {"crank_angle": np.linspace(-3.0, 3.0, 40)}, {"crank_angle": np.linspace(0.0, 5.0, 40)}),
        ("n_fourbar", "full", {"rocker_0": np.linspace(0.4, 2.6, 40)}, {"rocker_1": np.full(40, -2.0)}),
        ("delta6", "minimal", {f"q{k}": 0.25 + 0.02 * np.sin(k + np.arange(20)) for k in (1, 2, 3)}
         | {f"phi{k}": 0.1 * np.cos(k * np.arange(20)) for k in (1, 2, 3)}, {"q1": np.linspace(-1.0, 1.0, 20)}),
    ],
)  # fmt: skip
def test_they_are_those_of_single_starts_and_on_all_constraints(name, fidelity, values, rates) -> None:
    m = ml.load(name).mechanism(fidelity)
    count = len(next(iter(values.values())))
    q, v, sure = many_initial_states(m, values, rates, count)
    assert sure.mean() > 0.9
    tree, rows = TreeKinematics(m), ConstraintSet(m)
    for k in np.flatnonzero(sure)[::3]:
        here = Scene("s", initial={n: float(x[k]) for n, x in values.items()}, initial_rates={n: float(x[k]) for n, x in rates.items()})
        one, its_rates = initial_state(m, here)
        assert np.abs(q[k] - one).max() < CLOSED and np.abs(v[k] - its_rates).max() < 100 * CLOSED
        assert np.abs(rows.residual(tree.set(q[k]))).max() < CLOSED
        assert np.abs(rows.jacobian(tree) @ v[k]).max() < 10 * CLOSED
        assert all(abs(m.row(n) @ v[k] - x[k]) < 10 * CLOSED for n, x in rates.items())


def test_what_does_not_close_or_contradicts_is_left_to_the_single_search() -> None:
    m = ml.load("fourbar", crank=0.3, coupler=0.2, rocker=0.25, ground=0.3).mechanism("minimal")  # the crank swings between two ends
    angles = np.linspace(-3.0, 3.0, 30)
    _, _, sure = many_initial_states(m, {"crank_angle": angles}, {}, 30)
    assert 5 < sure.sum() < 25
    for angle, found in zip(angles, sure, strict=True):
        try:
            initial_state(m, Scene("s", initial={"crank_angle": float(angle)}))
        except NoSolution:
            assert not found
    two = {"crank_angle": np.ones(3), "rocker_angle": np.array([1.0, 1.0, 5.0])}
    chain = ml.load("n_fourbar").mechanism()
    _, _, sure = many_initial_states(chain, {"rocker_0": np.ones(3)}, {"rocker_0": np.ones(3), "rocker_1": two["rocker_angle"]}, 3)
    assert sure.tolist() == [True, True, False]  # parallelograms: both rockers turn alike


def test_values_that_leave_a_freedom_open_are_not_guessed() -> None:
    m = ml.load("delta6").mechanism("minimal")
    _, _, sure = many_initial_states(m, {"q1": np.linspace(0.24, 0.26, 4)}, {}, 4)
    assert not sure.any()
