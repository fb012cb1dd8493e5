"""Kinematics at many poses at once, against the tree and the constraints at one pose after the other."""

from __future__ import annotations

import numpy as np
import pytest

from mechlab import api
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.many_poses import ManyPoses, displacement, moved


def richest(name: str) -> Mechanism:
    d = api.load(name)
    return d.mechanism(list(d.entry.fidelities)[-1])


@pytest.mark.parametrize("name", ["fourbar", "delta6", "closed_differential", "bricard"])
def test_many_poses_are_one_after_the_other(name: str) -> None:
    """Poses, residuals and Jacobians at random, open poses equal those of the tree, row by row, to rounding."""
    m = richest(name)
    rng = np.random.default_rng(11)
    q = moved(m, np.tile(m.reference(), (4, 1)), 0.4 * rng.standard_normal((4, m.nv)))
    many = ManyPoses(m).set(q)
    residual, jacobian = many.residual_and_jacobian()
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    for k in range(4):
        tree.set(q[k])
        np.testing.assert_allclose(residual[k], constraints.residual(tree), atol=1e-13)
        np.testing.assert_allclose(jacobian[k], constraints.jacobian(tree), atol=1e-13)
        for i, body in enumerate(m.bodies):
            np.testing.assert_allclose(many.poses()[k, i], tree.matrix(body.name), atol=1e-13)
        for i, frame in enumerate(m.frames):
            rotation, origin = tree.pose(frame.body)
            point = origin + rotation @ frame.placement.translation
            np.testing.assert_allclose(many.frame_positions()[k, i], point, atol=1e-13)
    np.testing.assert_allclose(moved(m, q[:2], displacement(m, q[:2], q[2:])), q[2:], atol=1e-12)
