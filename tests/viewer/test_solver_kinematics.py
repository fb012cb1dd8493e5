"""The page's kinematics and closure against those of Python, for every mechanism of the catalog and its fidelities."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mechlab as ml
from mechlab.catalog import NAMES
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import integrate
from mechlab.viewer.from_recording import placed
from tests.viewer.solver_in_node import in_node

CASES = [(name, f) for name in NAMES for f in ml.load(name).entry.fidelities if f != "kinematic"]


def some_poses(mechanism: Mechanism, count: int = 3) -> list[Array]:
    """Coordinates far from home, closed or not."""
    rng = np.random.default_rng(1)
    return [integrate(mechanism, mechanism.reference(), rng.uniform(-2.0, 2.0, mechanism.nv)) for _ in range(count)]


@pytest.mark.parametrize(("name", "fidelity"), CASES)
def test_kinematics_are_those_of_python(name: str, fidelity: str) -> None:
    m = ml.load(name).mechanism(fidelity)
    constraints, poses = ConstraintSet(m), some_poses(m)
    rates = np.random.default_rng(2).standard_normal(m.nv)
    questions = [{"ask": "facts"}]
    for q in poses:
        questions += [{"ask": "poses", "q": q.tolist()}, {"ask": "constraints", "q": q.tolist()}]
        questions += [{"ask": "velocities", "q": q.tolist(), "v": rates.tolist()}]
    facts, *answers = in_node(m, questions)
    names, expected, _ = placed(m, np.array(poses))
    assert facts["bodies"] == list(names)
    assert facts["names"] == list(m.scalar_names)
    assert facts["size"] == pytest.approx(m.size or 1.0, rel=1e-15)
    assert facts["rank"] == structure(m).rank
    scale = max(1.0, m.size)  # rounding of positions grows with the size and with slides of up to 2 m
    for k, q in enumerate(poses):
        pose, closure, moving = answers[3 * k : 3 * k + 3]
        np.testing.assert_allclose(np.reshape(pose["position"], (-1, 3)), expected[k, :, :3, 3], atol=1e-13 * scale)
        rotation = Rotation.from_quat(np.reshape(pose["quaternion"], (-1, 4))).as_matrix()
        np.testing.assert_allclose(rotation, expected[k, :, :3, :3], atol=1e-13)
        tree = TreeKinematics(m, q, rates)
        assert closure["names"] == list(constraints.rows)
        np.testing.assert_allclose(closure["residual"], constraints.residual(tree), atol=3e-13 * scale)
        jacobian = np.reshape(closure["jacobian"], (len(constraints), m.nv))
        np.testing.assert_allclose(jacobian, constraints.jacobian(tree), atol=1e-12 * scale)
        linear, angular = (np.reshape(moving[x], (-1, 3)) for x in ("linear", "angular"))
        for i, body in enumerate(m.bodies):
            at = tree.velocity(body.name, tree.pose(body.name)[1])
            np.testing.assert_allclose(np.concatenate([linear[i], angular[i]]), at, atol=1e-12 * scale)
