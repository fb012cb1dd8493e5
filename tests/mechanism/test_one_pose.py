"""The equations at one pose, in few calls, against the tree and the constraints."""

import numpy as np
import pytest

import mechlab as ml
from mechlab.catalog import NAMES
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.one_pose import OnePose
from tests.mechanism.test_batch_sparse import mechanisms


def agree(m: Mechanism) -> None:
    """Residuals and Jacobians at random, open poses equal those of the tree, row by row, to rounding; then those of the given joints."""
    rows, constraints, tree = BatchRows(BatchTree(m)), ConstraintSet(m), TreeKinematics(m)
    order, given = [constraints.rows.index(name) for name in rows.names], np.eye(m.nv)[-2:]
    one = OnePose(rows, given)
    for q in m.reference() + 0.3 * np.random.default_rng(7).normal(size=(3, m.nv)):
        off = np.array([0.3, -0.2])[-len(given) :]
        residual, jacobian = one.evaluate(q, off)
        tree.set(q)
        truth = [*constraints.residual(tree)[order], *(given @ q + off)]
        np.testing.assert_allclose(residual, truth, atol=1e-13)
        np.testing.assert_allclose(jacobian, [*constraints.jacobian(tree)[order], *given], atol=1e-13)
        np.testing.assert_array_equal(one.residual(q, off), residual)


@pytest.mark.parametrize("m", mechanisms(), ids=lambda m: m.name)
def test_every_kind_of_loop_and_joint(m: Mechanism) -> None:
    agree(m)


@pytest.mark.parametrize("name", NAMES)
def test_the_catalog(name: str) -> None:
    m = ml.load(name).mechanism()
    if m.curves or any(j.nv != 1 for j in m.joints) or not m.nv:
        pytest.skip("curves and balls go the general way")
    agree(m)
