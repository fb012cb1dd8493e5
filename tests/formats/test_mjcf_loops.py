"""Loops of every kind in MJCF: the same rows as the mechanism's, the right accelerations, closed while it moves."""

import mujoco
import numpy as np
import pytest
from mechanism_zoo import LOOPS, looped, planetary, tree

from mechlab.formats import to_mjcf
from mechlab.formats.mjcf.write_loops import connectors
from mechlab.mechanism import ConstraintSet, TreeKinematics


def load(m):
    model = mujoco.MjModel.from_xml_string(to_mjcf(m))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def columns(m, model):
    return np.concatenate(
        [np.arange(model.joint(j.name).dofadr[0], model.joint(j.name).dofadr[0] + j.nv) for j in m.joints]
    )


def jacobian(model, data):
    return data.efc_J.reshape(data.nefc, model.nv)[: data.ne]


def row_space(matrix):
    u, s, vt = np.linalg.svd(matrix)
    basis = vt[: int(np.sum(s > 1e-9 * s[0]))]
    return basis.T @ basis


def without_connectors(m, model, data):
    """The rows on the mechanism's own rates: combinations of the engine's rows that do not move a connector."""
    own = columns(m, model)
    other = np.setdiff1d(np.arange(model.nv), own)
    rows = jacobian(model, data)
    if not len(other):
        return rows
    u, s, _ = np.linalg.svd(rows[:, other])
    return u[:, int(np.sum(s > 1e-9)) :].T @ rows[:, own]


@pytest.mark.parametrize("kind", LOOPS)
@pytest.mark.parametrize("seed", [5, 6])
def test_rows_span_the_same_space(kind, seed):
    m = looped(kind, seed)
    model, data = load(m)
    expected = ConstraintSet(m).jacobian(TreeKinematics(m))
    found = without_connectors(m, model, data)
    assert np.abs(row_space(found) - row_space(expected)).max() < 1e-9
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-13


@pytest.mark.parametrize("kind", LOOPS)
@pytest.mark.parametrize("seed", [5, 6, 7])
def test_accelerations_are_those_of_the_exact_constraint(kind, seed):
    m = looped(kind, seed)
    model, data = load(m)
    kin, constraints = TreeKinematics(m), ConstraintSet(m)
    j, n = constraints.jacobian(kin), len(constraints)
    matrix = np.block([[kin.mass_matrix(), j.T], [j, np.zeros((n, n))]])
    exact = np.linalg.lstsq(matrix, np.concatenate([-kin.bias_force(), np.zeros(n)]), rcond=None)[0][: m.nv]
    assert np.abs(data.qacc[columns(m, model)] - exact).max() < 5e-3 * np.abs(exact).max()


@pytest.mark.parametrize("kind", [k for k in LOOPS if k != "distance"])
def test_stays_closed_while_it_falls(kind):
    m = looped(kind)
    model, data = load(m)
    own = np.concatenate(
        [np.arange(model.joint(j.name).qposadr[0], model.joint(j.name).qposadr[0] + j.nq) for j in m.joints]
    )
    kin, constraints = TreeKinematics(m), ConstraintSet(m)
    for _ in range(300):
        mujoco.mj_step(model, data)
        assert np.abs(constraints.residual(kin.set(data.qpos[own]))).max() < 2e-6
    assert np.linalg.norm(data.qvel) > 1.0


@pytest.mark.parametrize("kind", ["universal", "cylindrical", "prismatic"])
def test_connectors_share_the_mass_of_their_body(kind):
    m = looped(kind)
    (connector,) = connectors(m)
    model, _ = load(m)
    assert (connector.host, connector.guest) == ("a3", "b1")
    assert abs(model.body_mass.sum() - m.total_mass) < 1e-14
    assert np.isclose(model.body("pin:connector").mass[0], 0.5 * m.body("b1").inertia.mass, rtol=1e-15)
    assert model.nv == m.nv + len(connector.joints)


def dense_solution(model, data):
    """qacc by a dense solve of the engine's own soft-constraint problem: all rows are equalities."""
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    j = data.efc_J.reshape(data.nefc, model.nv)
    d, aref = data.efc_D[: data.nefc], data.efc_aref[: data.nefc]
    smooth = mass @ data.qacc_smooth
    return np.linalg.solve(mass + j.T @ (d[:, None] * j), smooth + j.T @ (d * aref))


@pytest.mark.parametrize("kind", LOOPS)
def test_the_engine_solves_its_own_problem(kind):
    """MuJoCo 4.0.0 with jacobian="sparse" does not (its issue 3767); the files ask for dense."""
    for seed in range(8):
        m = looped(kind, seed)
        model, data = load(m)
        rng = np.random.default_rng(seed)
        data.qvel[:] = rng.normal(size=model.nv)
        data.qfrc_applied[:] = rng.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        exact = dense_solution(model, data)
        assert np.abs(data.qacc - exact).max() < 1e-8 * np.abs(exact).max()


def test_a_gear_train_with_redundant_rows_is_solved():
    m = planetary()
    model, data = load(m)
    data.ctrl[:] = 1.0
    mujoco.mj_forward(model, data)
    exact = dense_solution(model, data)
    assert np.abs(data.qacc - exact).max() < 1e-8 * np.abs(exact).max()
    assert np.abs(jacobian(model, data) - ConstraintSet(m).jacobian(TreeKinematics(m))).max() < 1e-15
    for _ in range(500):
        mujoco.mj_step(model, data)
    gaps = [abs(data.sensor(f"gap:{r.name}").data[0]) for r in m.relations]
    assert max(gaps) < 1e-5 and abs(data.qvel).max() > 1.0


def test_trees_have_no_rows():
    model, data = load(tree(1))
    assert data.ne == 0 and model.neq == 0
