"""Kinematics at many poses at once, against the tree and the constraints at one pose after the other."""

from __future__ import annotations

import numpy as np
import pytest

from mechlab import api
from mechlab.experiment.energy import kinetic_energy, potential_energy
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, structure
from mechlab.mechanism.many_motion import ManyMotion
from mechlab.mechanism.many_poses import ManyPoses, displacement, moved
from mechlab.mechanism.parts import LOOP_ROWS
from mechlab.mechanism.singularity import nearest_to_singular
from mechlab.mechanism.statics import passive_force, spring_stretch
from mechlab.mechanism.structure import generic
from tests.benchmarks.bench_large import four_bars
from tests.mechanism.samples import two_chains


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


@pytest.mark.parametrize("name", ["fourbar", "delta6", "bricard", "andrews", "impulse_transmission", "quick_return"])
def test_energies_of_many_states_are_those_of_the_tree(name: str) -> None:
    """Kinetic energy against v M v / 2 with the mass matrix of the tree, potential energy against the work of its static forces
    over a small step (central difference, third-order remainder), lengths of springs and velocities against the tree."""
    m = richest(name)
    rng = np.random.default_rng(12)
    q = moved(m, np.tile(m.reference(), (4, 1)), 0.3 * rng.standard_normal((4, m.nv)))
    v = rng.standard_normal((4, m.nv))
    many = ManyPoses(m).set(q)
    kinetic, (linear, angular) = kinetic_energy(m, q, v), many.twists(v)
    step = 1e-5 * v
    slope = (potential_energy(m, moved(m, q, step)) - potential_energy(m, moved(m, q, -step))) / 2e-5
    for k in range(4):
        tree = TreeKinematics(m, q[k], v[k])
        mass = tree.mass_matrix()
        assert kinetic[k] == pytest.approx(0.5 * v[k] @ mass @ v[k], rel=1e-12)
        for i, body in enumerate(m.bodies):
            np.testing.assert_allclose(np.append(linear[k, i], angular[k, i]), tree.velocity(body.name, np.zeros(3)), atol=1e-12)
        for spring in m.springs:
            length, rate = many.spring(spring, v)
            np.testing.assert_allclose((length[k], rate[k]), spring_stretch(tree, spring)[2:], rtol=1e-12)
        still = TreeKinematics(m, q[k])
        force = passive_force(still) - still.bias_force()
        size = 1.0 + float(np.abs(force) @ np.abs(v[k]))
        assert slope[k] == pytest.approx(-float(force @ v[k]), abs=1e-7 * size)


@pytest.mark.parametrize("name", ["fourbar", "bricard", "andrews", "n_fourbar N=35"])
def test_the_nearest_pose_to_a_singular_one_by_the_tree_at_each(name: str) -> None:
    name, _, given = name.partition(" N=")
    m = four_bars(int(given)) if given else richest(name)  # large enough to be solved sparsely
    rng = np.random.default_rng(13)
    q = moved(m, np.tile(m.reference(), (6, 1)), 0.4 * rng.standard_normal((6, m.nv)))
    constraints, sizes, rank = ConstraintSet(m), np.linalg.norm(generic(m)[1], axis=1), structure(m).rank
    rows = [constraints.jacobian(TreeKinematics(m, x)) / np.where(sizes > 1e-14, sizes, 1.0)[:, None] for x in q]
    least = np.array([np.linalg.svd(x, compute_uv=False)[rank - 1] for x in rows])
    k, near = nearest_to_singular(m, q)
    assert k == int(np.argmin(least)) and near == pytest.approx(least[k] / np.median(least), rel=1e-9)


@pytest.mark.parametrize("name", ["fourbar", "delta6", "closed_differential", "bricard", "prosthetic_leg"])
def test_many_motions_are_one_after_the_other(name: str) -> None:
    """Velocities, bias accelerations and biases of the rows equal those of the tree, at random poses and rates, to rounding."""
    m = richest(name)
    rng = np.random.default_rng(12)
    q = moved(m, np.tile(m.reference(), (4, 1)), 0.4 * rng.standard_normal((4, m.nv)))
    v, at = rng.standard_normal((4, m.nv)), rng.standard_normal((4, 3))
    motion = ManyMotion(ManyPoses(m).set(q), v)
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    rows = motion.bias()
    for k in range(4):
        tree.set(q[k], v[k])
        np.testing.assert_allclose(rows[k], constraints.bias(tree), atol=1e-11)
        for body in m.bodies:
            velocity, bias = motion.point(body.name, at)
            np.testing.assert_allclose(velocity[k], tree.velocity(body.name, at[k]), atol=1e-12)
            np.testing.assert_allclose(bias[k], tree.bias(body.name, at[k]), atol=1e-11)


@pytest.mark.parametrize("kind", list(LOOP_ROWS))
def test_many_motions_of_every_kind_of_loop(kind: str) -> None:
    m = two_chains(kind)
    rng = np.random.default_rng(3)
    q = moved(m, np.tile(m.reference(), (3, 1)), 0.3 * rng.standard_normal((3, m.nv)))
    v = rng.standard_normal((3, m.nv))
    rows = ManyMotion(ManyPoses(m).set(q), v).bias()
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    for k in range(3):
        np.testing.assert_allclose(rows[k], constraints.bias(tree.set(q[k], v[k])), atol=1e-12)
