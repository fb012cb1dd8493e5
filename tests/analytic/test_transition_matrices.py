"""Matrix Lagrange equations: derivatives by differences, energy, planar against spatial, spatial against Pinocchio."""

import numpy as np
import pytest

from mechlab.analytic import transition_matrices as tm
from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, Inertia, Placement, prismatic, revolute
from mechlab.mechanism.geometry import axis_rotation

RNG = np.random.default_rng(11)
STEP = 1e-6


def random_tree(spatial: bool, links: int = 6) -> tm.Tree:
    """A branched tree of alternating turns and slides with turned placements."""
    made = []
    for i in range(links):
        parent = [-1, 0, 1, 1, 3, 0][i]
        if spatial:
            place = tm.placement(RNG.normal(size=3), axis_rotation([0.0, 0.6, 0.8], RNG.normal()))
            axis = RNG.normal(size=3)
            a = RNG.normal(size=(3, 3))
            second = a @ a.T  # any second moments give a real body
            inertia = tm.spatial_inertia(1.0 + i, RNG.normal(size=3), np.trace(second) * np.eye(3) - second)
            generator = tm.revolute(axis) if i % 2 else tm.prismatic(axis)
        else:
            place = tm.placement(RNG.normal(size=2), RNG.normal())
            inertia = tm.planar_inertia(1.0 + i, RNG.normal(size=2), 0.3 + 0.1 * i)
            generator = tm.revolute() if i % 2 else tm.prismatic(RNG.normal(size=2))
        made.append(tm.TreeLink(parent, place, generator, inertia, 50.0 * i, 0.1 * i, 0.2 * i))
    return tm.Tree(tuple(made), (0.3, -9.0, 1.0) if spatial else (0.3, -9.0))


@pytest.mark.parametrize("spatial", [False, True])
def test_derivatives_of_the_transition_matrices_against_differences(spatial):
    tree = random_tree(spatial)
    q = RNG.normal(size=6)
    for i, path in enumerate(tree.ancestors):
        for j in range(6):
            ahead, behind = (tm.transitions(tree, q + s * np.eye(6)[j])[0][i] for s in (STEP, -STEP))
            u = tm.first_derivative(tree, q, i, j)
            assert np.allclose(u, (ahead - behind) / (2 * STEP), atol=1e-8)  # rounding / step
            assert np.any(u) == (j in path)
            for k in path:
                ahead, behind = (tm.first_derivative(tree, q + s * np.eye(6)[k], i, j) for s in (STEP, -STEP))
                second = tm.second_derivative(tree, q, i, j, k)
                assert np.allclose(second, (ahead - behind) / (2 * STEP), atol=1e-8)
                assert np.array_equal(second, tm.second_derivative(tree, q, i, k, j))


@pytest.mark.parametrize("spatial", [False, True])
def test_mass_matrix_is_the_double_sum_over_links(spatial):
    tree = random_tree(spatial)
    q = RNG.normal(size=6)
    m = np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            for k in range(6):
                left, right = tm.first_derivative(tree, q, i, j), tm.first_derivative(tree, q, i, k)
                m[j, k] += np.trace(left @ tree.links[i].inertia @ right.T)
    assert np.allclose(tm.mass_matrix(tree, q), m, rtol=0, atol=1e-12 * np.abs(m).max())


@pytest.mark.parametrize("spatial", [False, True])
def test_bias_and_gravity_are_those_of_the_energies(spatial):
    tree = random_tree(spatial)
    q, v = RNG.normal(size=6), RNG.normal(size=6)
    kinetic, _ = tm.energy(tree, q, v)
    assert kinetic == pytest.approx(0.5 * v @ tm.mass_matrix(tree, q) @ v, rel=1e-12)
    slopes = [(tm.mass_matrix(tree, q + STEP * e) - tm.mass_matrix(tree, q - STEP * e)) / (2 * STEP) for e in np.eye(6)]
    by_christoffel = sum(s * x for s, x in zip(slopes, v, strict=True)) @ v - 0.5 * np.array(
        [v @ s @ v for s in slopes]
    )
    assert np.allclose(tm.bias_force(tree, q, v), by_christoffel, atol=1e-6)
    push = [
        (tm.energy(tree, q - STEP * e, v * 0)[1] - tm.energy(tree, q + STEP * e, v * 0)[1]) / (2 * STEP)
        for e in np.eye(6)
    ]
    assert np.allclose(tm.gravity_force(tree, q) + tm.elastic_force(tree, q, 0 * v), push, atol=1e-5)


def test_states_are_vectorised():
    tree = random_tree(True)
    q, v = RNG.normal(size=(3, 4, 6)), RNG.normal(size=(3, 4, 6))
    whole = tm.accelerations(tree, q, v)
    assert whole.shape == (3, 4, 6)
    assert np.allclose(whole[2, 1], tm.accelerations(tree, q[2, 1], v[2, 1]), rtol=1e-11)


def test_a_spatial_tree_against_pinocchio():
    b = Builder("tree", gravity=(0.3, -9.0, 1.0))
    links = []
    for i, parent in enumerate(("ground", "b0", "b1", "b1", "b3", "b0")):
        rotation, at = axis_rotation([0.0, 0.6, 0.8], 0.4 * i), RNG.normal(size=3)
        axis = RNG.normal(size=3)
        box = Inertia.box(1.0 + i, 0.3, 0.5, 0.7, (0.1, -0.2, 0.05 * i))
        joint = revolute(f"j{i}", axis) if i % 2 else prismatic(f"j{i}", axis)
        b.body(f"b{i}", joint, parent=parent, at=at, turned=Placement.of(rotation, (0.0, 0.0, 0.0)), inertia=box)
        generator = (tm.revolute if i % 2 else tm.prismatic)(axis)
        links.append(tm.TreeLink((-1, 0, 1, 1, 3, 0)[i], tm.placement(at, rotation), generator,
                             tm.spatial_inertia(box.mass, box.com, box.matrix())))  # fmt: skip
    m, tree = b.build(), tm.Tree(tuple(links), (0.3, -9.0, 1.0))
    order = [int(n[1:]) for n in m.rate_names]
    for _ in range(20):
        q, v = RNG.normal(size=6), RNG.normal(size=6)
        plant = PinPlant(m, q[order], v[order])
        mass = tm.mass_matrix(tree, q)[np.ix_(order, order)]
        h = (tm.bias_force(tree, q, v) - tm.gravity_force(tree, q))[order]
        # Rounding of sums of some tens of terms.
        assert np.abs(mass - plant.mass_matrix()).max() < 1e-13 * np.abs(mass).max()
        assert np.abs(h - plant.bias()).max() < 1e-13 * max(1.0, np.abs(h).max())


def test_a_locked_joint_is_a_rigid_link():
    tree = random_tree(False)
    q, v = RNG.normal(size=6), RNG.normal(size=6)
    free = [0, 1, 3, 5]
    q[[2, 4]] = v[[2, 4]] = 0.0
    less = tree.merged([2, 4])
    assert np.allclose(tm.mass_matrix(less, q[free]), tm.mass_matrix(tree, q)[np.ix_(free, free)], atol=1e-12)
    assert np.allclose(tm.bias_force(less, q[free], v[free]), tm.bias_force(tree, q, v)[free], atol=1e-12)


def test_bad_input_is_named():
    link = tm.TreeLink(0, np.eye(3), tm.revolute(), np.eye(3))
    with pytest.raises(MechlabError, match="its parent is 0"):
        tm.Tree((link,), (0.0, -9.81))
    with pytest.raises(MechlabError, match="placement has shape"):
        tm.Tree((tm.TreeLink(-1, np.eye(3), tm.revolute(), np.eye(3)),), (0.0, 0.0, -9.81))
    with pytest.raises(MechlabError, match="one for each link"):
        tm.mass_matrix(random_tree(False), np.zeros(5))
    with pytest.raises(MechlabError, match="singular"):
        massless = tm.TreeLink(-1, np.eye(3), tm.revolute(), np.zeros((3, 3)))
        tm.accelerations(tm.Tree((massless,), (0.0, 0.0)), [0.0], [0.0])
