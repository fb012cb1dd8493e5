"""Constraint rows from the engine's own arrays, against those of the numpy mechanism and against differences over time."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.engine_rows import EngineRows
from mechlab.engines.mujoco.plant import StateOfMujoco
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism import close


@pytest.mark.parametrize(
    ("name", "fidelity"),
    [
        ("delta6", "minimal"),
        ("delta6", "parts"),
        ("delta6", "full"),
        ("gear_linkage", "minimal"),
        ("bricard", "full"),
        ("agile_eye", "full"),
        ("thompson", "full"),
    ],
)
def test_they_allow_the_accelerations_that_the_mechanism_allows(name: str, fidelity: str) -> None:
    """Connects, welds, distances and gears: accelerations with J a + b = 0 of the one are those of the other. Of the agile eye and
    Thompson's joint the engine drops equalities."""
    m = ml.load(name).mechanism(fidelity)
    rng = np.random.default_rng(4)
    plant, tree = StateOfMujoco(m), TreePlant(m)
    fast = EngineRows(plant.model, plant.data, plant.closure)
    for _ in range(3):
        q = m.reference()
        q[m.q_columns] += 0.03 * rng.standard_normal(m.nv)
        q, v = close(m, q).q, rng.standard_normal(m.nv)
        jacobian = tree.set(q, v).jacobian()
        v -= np.linalg.lstsq(jacobian, jacobian @ v, rcond=1e-11)[0]
        tree.set(q, v)
        a = np.linalg.lstsq(jacobian, -tree.constraint_bias(), rcond=1e-11)[0]
        free = rng.standard_normal(m.nv)
        a += free - np.linalg.lstsq(jacobian, jacobian @ free, rcond=1e-11)[0]
        plant.set(q, v)
        before = plant.data.qacc.copy()
        rows = fast.rows(plant.data)
        assert rows is not None
        np.testing.assert_array_equal(plant.data.qacc, before)
        order = np.concatenate([plant.map.dof, plant.map.other_dof])
        # 1e-9: the pose is closed to 1e-12, and the rows of both grow with the rates, up to 1e2
        assert np.abs(rows[0][:, order[: m.nv]] @ a + rows[1]).max() < 1e-9 * max(1.0, np.abs(rows[1]).max())
        assert np.linalg.matrix_rank(rows[0], tol=1e-9) == np.linalg.matrix_rank(jacobian, tol=1e-9)


def test_the_bias_is_the_time_derivative_of_the_rows() -> None:
    """b = d(J v)/dt at constant rates, by central differences, away from a closed pose too."""
    m = ml.load("delta6").mechanism("parts")
    plant = StateOfMujoco(m)
    model, data, fast = plant.model, plant.data, EngineRows(plant.model, plant.data, plant.closure)
    rng = np.random.default_rng(5)
    v, h = rng.standard_normal(model.nv), 1e-5
    here = data.qpos.copy()

    def speed(step: float) -> np.ndarray:
        data.qpos[:], data.qvel[:] = here, v
        mujoco.mj_integratePos(model, data.qpos, v, step)
        mujoco.mj_forward(model, data)
        found = fast.rows(data)
        assert found is not None
        return np.asarray(found[0] @ v)

    difference = (speed(h) - speed(-h)) / (2.0 * h)
    speed(0.0)
    found = fast.rows(data)
    assert found is not None
    np.testing.assert_allclose(
        found[1], difference, atol=1e-7
    )  # h^2 of the differences: 1e-10, rounding / h: 1e-11 x 100
