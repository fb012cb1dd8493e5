"""Motion, masses and constraint rows of many states at once, against the numpy tree at one state after the other."""

import numpy as np
import pytest

from mechlab import api
from mechlab.mechanism import ConstraintSet, TreeKinematics
from mechlab.mechanism.many_poses import moved
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.small_systems import SMALL, solve_positive
from mechlab.mechanism.state_rows import state_rows
from mechlab.mechanism.statics import passive_force

CASES = [
    ("fourbar", "minimal"), ("bricard", "full"), ("flyball", "full"), ("andrews", "full"), ("delta6", "parts"), ("delta6", "full"),
    ("stewart", "full"), ("planetary", "full"), ("prosthetic_leg", "full"), ("cam_follower", "full"), ("quick_return", "minimal"),
]  # fmt: skip
"""Hinge, ball, rod and universal loops, slides, gears, shafts, springs, ball joints, a curve."""


@pytest.mark.parametrize(("name", "fidelity"), CASES)
def test_many_states_are_one_after_the_other(name: str, fidelity: str) -> None:
    """At random open poses, to rounding: the tree sums over bodies what is summed over rates here."""
    m = api.load(name).mechanism(fidelity)
    rng = np.random.default_rng(3)
    q, v = moved(m, np.tile(m.reference(), (5, 1)), 0.3 * rng.standard_normal((5, m.nv))), rng.standard_normal((5, m.nv))
    many, rows, constraints = ManyStates(m, q, v), state_rows(m), ConstraintSet(m)
    mass, bias, passive, points = many.masses(), many.bias(), many.passive(), many.frame_positions()
    residual, jacobian, change = rows.residual(many), rows.jacobian(many), rows.bias(many)
    for k in range(5):
        tree = TreeKinematics(m, q[k], v[k])
        expected = [tree.mass_matrix(), tree.bias_force(), passive_force(tree), constraints.jacobian(tree), constraints.bias(tree)]
        for found, right in zip((mass[k], bias[k], passive[k], jacobian[k], change[k]), expected, strict=True):
            assert found == pytest.approx(right, abs=1e-13 * max(1.0, np.max(np.abs(right), initial=0.0)))
        assert residual[k] == pytest.approx(constraints.residual(tree), abs=1e-13)
        for i, frame in enumerate(m.frames):
            rotation, origin = tree.pose(frame.body)
            assert points[k, i] == pytest.approx(origin + rotation @ frame.placement.translation, abs=1e-13)


@pytest.mark.parametrize("n", [1, 3, SMALL, SMALL + 1])
def test_small_systems_are_solved(n: int) -> None:
    """a x = b put in again; the condition of a is below 100."""
    rng = np.random.default_rng(n)
    root = rng.standard_normal((600, n, n)) / n
    a, b = root @ np.swapaxes(root, 1, 2) + np.eye(n), rng.standard_normal((600, n, 2))
    np.testing.assert_allclose(a @ solve_positive(a, b), b, atol=1e-12)


def test_a_singular_small_system_is_not_solved_silently() -> None:
    a = np.array([np.eye(3), np.diag([1.0, 0.0, 1.0])])
    x = solve_positive(a, np.ones((2, 3, 1)))
    assert np.isfinite(x[0]).all() and not np.isfinite(x[1]).all()
