"""Constraint rows against finite differences, for every kind of loop and all joint kinds."""

import numpy as np
import pytest

import mechlab as ml
from mechlab.mechanism import ConstraintSet, TreeKinematics, integrate
from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.parts import LOOP_ROWS
from tests.mechanism.samples import two_chains

STEP = 1e-6


@pytest.mark.parametrize("kind", sorted(LOOP_ROWS))
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_jacobian_and_bias_are_derivatives_of_the_residual(kind: str, seed: int) -> None:
    m = two_chains(kind)
    rng = np.random.default_rng(seed)
    q = integrate(m, m.reference(), rng.uniform(-0.8, 0.8, m.nv))
    v = rng.standard_normal(m.nv)
    constraints, tree = ConstraintSet(m), TreeKinematics(m, q, v)
    jacobian, bias = constraints.jacobian(tree), constraints.bias(tree)
    assert len(constraints.rows) == LOOP_ROWS[kind] == len(jacobian)
    ahead, behind = integrate(m, q, STEP * v), integrate(m, q, -STEP * v)
    rate = (constraints.residual(tree.set(ahead)) - constraints.residual(tree.set(behind))) / (2 * STEP)
    # Central differences: truncation STEP^2 times third derivatives of order 100, rounding 1e-16 / STEP.
    np.testing.assert_allclose(rate, jacobian @ v, atol=1e-8)
    slope = (constraints.jacobian(tree.set(ahead, v)) - constraints.jacobian(tree.set(behind, v))) @ v / (2 * STEP)
    np.testing.assert_allclose(slope, bias, atol=1e-7)


def test_kinematics_velocity_and_bias_against_differences() -> None:
    m = two_chains("spherical")
    rng = np.random.default_rng(5)
    q, v = integrate(m, m.reference(), rng.uniform(-0.8, 0.8, m.nv)), rng.standard_normal(m.nv)
    tree = TreeKinematics(m)
    body, local = m.bodies[-1].name, np.array([0.1, -0.2, 0.05])

    def point(x: np.ndarray) -> np.ndarray:
        rotation, origin = tree.set(x).pose(body)
        return origin + rotation @ local

    p = [point(integrate(m, q, s * STEP * v)) for s in (1, 0, -1)]
    tree.set(q, v)
    rotation, origin = tree.pose(body)
    at = origin + rotation @ local
    np.testing.assert_allclose((p[0] - p[2]) / (2 * STEP), tree.velocity(body, at)[:3], atol=1e-8)
    np.testing.assert_allclose(tree.jacobian(body, at) @ v, tree.velocity(body, at), atol=1e-13)
    big = 1e-4
    p = [point(integrate(m, q, s * big * v)) for s in (1, 0, -1)]
    tree.set(q, v)
    # Second difference of step 1e-4: truncation 1e-8 times fourth derivatives of order 100, rounding 1e-8.
    np.testing.assert_allclose((p[0] - 2 * p[1] + p[2]) / big**2, tree.bias(body, at)[:3], atol=1e-5)


def test_rows_are_written_in_frame_a() -> None:
    """A turned frame a turns the rows of a spherical loop: r_turned = R^T r."""
    m = two_chains("spherical")
    loop = m.loops[0]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = Placement.of(loop.placement_a.rotation @ turn, loop.placement_a.position)
    from dataclasses import replace

    other = replace(m, loops=(replace(loop, placement_a=turned),))
    q = integrate(m, m.reference(), np.linspace(-0.3, 0.3, m.nv))
    r1 = ConstraintSet(m).residual(TreeKinematics(m, q))
    r2 = ConstraintSet(other).residual(TreeKinematics(other, q))
    np.testing.assert_allclose(r2, [r1[1], -r1[0], r1[2]], atol=1e-15)


@pytest.mark.parametrize("name", ["fourbar", "oldham", "watt_governor", "bennett", "cardan"])
def test_power_of_a_unit_reaction_is_the_rate_of_its_row(name: str) -> None:
    """Where a loop is closed: force . (v_b - v_a) + moment . (w_b - w_a) = J v, for any rates."""
    design = ml.load(name)
    m = design.mechanism(design.scene().fidelity)
    v = np.random.default_rng(5).standard_normal(m.nv)
    tree, constraints = TreeKinematics(m, m.reference(), v), ConstraintSet(m)
    rates, (item,) = constraints.jacobian(tree) @ v, constraints.items[:1]
    _, point_a, _, point_b = item.ends(tree)
    relative = tree.velocity(item.loop.body_b, point_b) - tree.velocity(item.loop.body_a, point_a)
    np.testing.assert_allclose(item.wrenches(tree) @ relative, rates[constraints.slices[item.name]], atol=1e-9)
