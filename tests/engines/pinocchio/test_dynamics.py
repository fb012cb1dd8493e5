"""Mass matrix, bias and constrained accelerations against the numpy tree, dense KKT and reduced coordinates."""

import numpy as np
import pytest
from random_mechanisms import random_mechanism, random_state
from samples import fourbar, planetary

from mechlab.engines.pinocchio.dynamics import PinPlant, accelerations
from mechlab.engines.pinocchio.kkt import dense
from mechlab.errors import Untrustworthy
from mechlab.experiment.energy import potential_energy
from mechlab.mechanism import Builder, ConstraintSet, Inertia, TreeKinematics, close, integrate, revolute
from mechlab.mechanism.structure import null_space


@pytest.mark.parametrize("seed", range(20))
def test_mass_matrix_and_bias(seed):
    m = random_mechanism(seed)
    q, v = random_state(m, np.random.default_rng(seed))
    plant, tree = PinPlant(m, q, v), TreeKinematics(m, q, v)
    assert np.allclose(plant.mass_matrix(), tree.mass_matrix(), atol=1e-12, rtol=1e-12)
    passive = plant.passive.force(v)
    assert np.allclose(plant.bias() - passive, tree.bias_force(), atol=1e-11, rtol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_static_bias_is_the_gradient_of_the_potential(seed):
    m = random_mechanism(seed)
    q, _ = random_state(m, np.random.default_rng(seed))
    h = PinPlant(m, q).bias()
    e = 1e-6 * np.eye(m.nv)
    q_plus = np.array([integrate(m, q, x) for x in e])
    q_minus = np.array([integrate(m, q, -x) for x in e])
    gradient = (potential_energy(m, q_plus) - potential_energy(m, q_minus)) / 2e-6
    assert np.allclose(h, gradient, atol=1e-7)


@pytest.mark.parametrize("seed", range(10))
def test_passive_forces_lose_energy_at_the_stated_rate(seed):
    from mechlab.experiment.energy import dissipation

    m = random_mechanism(seed)
    q, v = random_state(m, np.random.default_rng(seed))
    plant = PinPlant(m, q, v)
    damping = plant.passive.force(v) - PinPlant(m, q).passive.force(np.zeros(m.nv))
    assert damping @ v == pytest.approx(float(dissipation(m, q, v)[0]), rel=1e-10)


@pytest.mark.parametrize("seed", range(20))
def test_accelerations_meet_the_equations(seed):
    m = random_mechanism(seed)
    rng = np.random.default_rng(seed)
    q = m.reference()
    basis = null_space(ConstraintSet(m).jacobian(TreeKinematics(m, q)))
    v = basis @ rng.normal(size=basis.shape[1])
    tau = rng.normal(size=m.nv)
    plant = PinPlant(m, q, v)
    a, r = plant.accelerations(tau)
    scale = max(1.0, np.abs(a).max())
    assert np.allclose(plant.mass_matrix() @ a + plant.bias(), tau + plant.jacobian().T @ r, atol=1e-8 * scale)
    a_dense, r_dense, gap = dense(plant.mass_matrix(), plant.jacobian(), tau - plant.bias(), plant.constraint_bias())
    if gap < 1e-8:
        assert np.allclose(a, a_dense, atol=1e-6 * scale)
        assert np.allclose(plant.jacobian() @ a, -plant.constraint_bias(), atol=1e-7 * scale)


def test_fourbar_against_the_one_freedom_equation():
    """theta'' of I(theta) theta'' + I'/2 theta'^2 + V' = tau, I and V from the numpy tree along the closed curve."""
    m = fourbar()
    h = 1e-4

    def point(theta):
        q = close(m, None, {"crank_angle": theta}, steps=5).q
        tree = TreeKinematics(m, q)
        j = np.vstack([ConstraintSet(m).jacobian(tree), m.row("crank_angle")])
        n = np.linalg.lstsq(j, np.append(np.zeros(len(j) - 1), 1.0), rcond=1e-11)[0]
        return q, n, n @ tree.mass_matrix() @ n, potential_energy(m, q)[0]

    theta, rate, tau = 1.3, 4.0, 0.2
    q, n, inertia, _ = point(theta)
    (_, _, i1, v1), (_, _, i0, v0) = point(theta + h), point(theta - h)
    expected = (tau - (i1 - i0) / (2 * h) / 2 * rate**2 - (v1 - v0) / (2 * h)) / inertia
    a, r = accelerations(m, q, n * rate, tau * m.row("crank_angle"))
    assert m.row("crank_angle") @ a == pytest.approx(expected, rel=1e-6)
    assert r[2] == 0.0  # the void row along the normal of the plane carries nothing


def test_planetary_against_the_reduction_by_k_and_equal_loads():
    m = planetary()
    rng = np.random.default_rng(0)
    a_rows = ConstraintSet(m).jacobian(TreeKinematics(m))
    k = null_space(a_rows)
    q = k @ rng.normal(size=k.shape[1])
    v = k @ rng.normal(size=k.shape[1])
    tau = 0.3 * m.row("sun") - 0.7 * m.row("carrier")
    plant = PinPlant(m, q, v)
    a, r = plant.accelerations(tau)
    expected = k @ np.linalg.solve(k.T @ plant.mass_matrix() @ k, k.T @ (tau - plant.bias()))
    assert np.allclose(a, expected, rtol=1e-10, atol=1e-10)
    loads = r[::2]
    assert plant.factors().rank == 4
    smallest = np.linalg.lstsq(a_rows.T, plant.mass_matrix() @ a + plant.bias() - tau, rcond=1e-11)[0]
    assert np.allclose(r, smallest, atol=1e-10)
    assert loads.shape == (3,)


def test_a_motion_without_inertia_of_its_own_that_the_loops_hold():
    """A point mass in its own joint: the mass matrix is singular, the constrained equations are not."""
    b = Builder("point", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("one"), 0.1)
    b.body("coupler", revolute("two"), parent="crank", at=(0.1, 0, 0), inertia=Inertia.point(0.3))
    b.bar("rocker", revolute("three"), 0.25, at=(0.3, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0))
    m = b.assemble({"one": 0.9, "two": -0.3, "three": 1.5}, hold=["one"])
    plant = PinPlant(m, m.reference(), np.zeros(3))
    assert plant.factors() is None
    a, r = plant.accelerations(np.zeros(3))
    k = null_space(plant.jacobian())
    expected = k @ np.linalg.solve(k.T @ plant.mass_matrix() @ k, -k.T @ plant.bias())
    assert np.allclose(a, expected, rtol=1e-9)
    assert np.allclose(plant.mass_matrix() @ a + plant.bias(), plant.jacobian().T @ r, atol=1e-9)


def test_a_free_motion_without_inertia_is_refused():
    b = Builder("free_point")
    b.bar("arm", revolute("one", "y"), 0.1)
    b.body("point", revolute("two", "x"), parent="arm", at=(0.1, 0, 0), inertia=Inertia.point(0.3))
    m = b.build()
    with pytest.raises(Untrustworthy, match="has no inertia"):
        accelerations(m, m.reference(), np.zeros(2), m.row("two"))
