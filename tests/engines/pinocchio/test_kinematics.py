"""PinKinematics and PinConstraints against the numpy tree, on random mechanisms with everything in them."""

import numpy as np
import pytest
from random_mechanisms import random_mechanism, random_state

from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.engines.pinocchio.model import to_pinocchio
from mechlab.errors import MechlabError
from mechlab.mechanism import ConstraintSet, TreeKinematics

SEEDS = range(30)


@pytest.mark.parametrize("seed", SEEDS)
def test_poses_jacobians_velocities_bias(seed):
    m = random_mechanism(seed)
    rng = np.random.default_rng(seed)
    q, v = random_state(m, rng)
    tree, kin = TreeKinematics(m, q, v), PinKinematics(m, q, v)
    for body in ["ground"] + [b.name for b in m.bodies]:
        point = rng.normal(size=3)
        for x, y in zip(tree.pose(body), kin.pose(body), strict=True):
            assert np.allclose(x, y, atol=1e-12, rtol=0)
        assert np.allclose(tree.jacobian(body, point), kin.jacobian(body, point), atol=1e-12, rtol=0)
        assert np.allclose(tree.velocity(body, point), kin.velocity(body, point), atol=1e-12, rtol=1e-13)
        assert np.allclose(tree.bias(body, point), kin.bias(body, point), atol=1e-11, rtol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_constraints(seed):
    m = random_mechanism(seed)
    q, v = random_state(m, np.random.default_rng(seed))
    tree, kin = TreeKinematics(m, q, v), PinKinematics(m, q, v)
    truth, fast = ConstraintSet(m), PinConstraints(kin)
    assert fast.rows == truth.rows
    for over in (tree, kin):
        assert np.allclose(truth.residual(over), fast.residual(), atol=1e-11, rtol=1e-12)
        assert np.allclose(truth.jacobian(over), fast.jacobian(), atol=1e-11, rtol=1e-12)
        assert np.allclose(truth.bias(over), fast.bias(), atol=1e-10, rtol=1e-12)


def test_frames_and_names_are_kept():
    m = random_mechanism(3)
    p = to_pinocchio(m)
    assert list(p.model.names)[1:] == [j.name for j in m.joints]
    for body in m.bodies:
        assert p.model.existBodyName(body.name)
    q, _ = random_state(m, np.random.default_rng(1))
    assert np.allclose(p.from_pin(p.to_pin(q)), q, atol=1e-15)
    import pinocchio as pin

    data = p.model.createData()
    pin.framesForwardKinematics(p.model, data, p.to_pin(q))
    tree = TreeKinematics(m, q)
    for body in m.bodies:
        pose = data.oMf[p.model.getFrameId(body.name, pin.FrameType.BODY)]
        assert np.allclose(pose.homogeneous, tree.matrix(body.name), atol=1e-12)
    tip = data.oMf[p.model.getFrameId("tip", pin.FrameType.OP_FRAME)]
    assert np.allclose(
        tip.homogeneous, tree.matrix(m.frame("tip").body) @ m.frame("tip").placement.matrix(), atol=1e-12
    )


def test_errors_name_what_exists():
    m = random_mechanism(0)
    kin = PinKinematics(m)
    with pytest.raises(MechlabError, match="body 'nobody' does not exist.*body_0"):
        kin.pose("nobody")
    with pytest.raises(MechlabError, match="coordinates have shape"):
        kin.set(np.zeros(m.nq + 1))
    with pytest.raises(MechlabError, match="rates have shape"):
        kin.set(m.reference(), np.zeros(m.nv + 1))
