"""Forces of drives for commanded accelerations, against the equations of motion solved as a whole by least squares."""

from __future__ import annotations

import numpy as np
import pytest

import mechlab as ml
from mechlab.experiment.laws import drive_forces
from mechlab.experiment.laws.inverse import InverseDynamics
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism import Inertia, Mechanism, close, prismatic, revolute


def truth(plant: TreePlant, rows: np.ndarray, commands: np.ndarray, drives: tuple[str, ...]) -> np.ndarray:
    """Forces f of M a + h = B^T f + J^T r, J a = -b, R a = commands, all unknowns at once."""
    m, jacobian = plant.mechanism, plant.jacobian()
    nv, held = m.nv, np.vstack([jacobian, rows])
    acting = np.vstack([jacobian, [m.row(n) for n in drives]])
    whole = np.zeros((nv + len(held), nv + len(acting)))
    whole[:nv, :nv], whole[:nv, nv:], whole[nv:, :nv] = plant.mass_matrix(), -acting.T, held
    right = np.concatenate([-plant.bias(), -plant.constraint_bias(), commands])
    return np.asarray(np.linalg.lstsq(whole, right, rcond=1e-13)[0][nv + len(jacobian) :])


def moving(m: Mechanism, seed: int) -> TreePlant:
    """A closed pose near the reference with rates that keep the constraints."""
    rng = np.random.default_rng(seed)
    q = m.reference()
    q[m.q_columns] += 0.05 * rng.standard_normal(m.nv)
    plant = TreePlant(m, close(m, q).q)
    v = rng.standard_normal(m.nv)
    return plant.set(plant.q, v + np.linalg.lstsq(plant.jacobian(), -plant.jacobian() @ v, rcond=1e-11)[0])


@pytest.mark.parametrize(
    ("name", "fidelity", "scene"),
    [
        ("delta6", "minimal", "head-tracking"),
        ("delta6", "full", "head-tracking"),  # nine freedoms, six drives: the plain rods spin freely
        ("quick_return", "minimal", "driven-crank"),  # planar: two rows of the loops are void
        ("platform_3rrr", "minimal", "driven-cranks"),
    ],
)
def test_the_equations_of_motion_give_the_same_forces(name: str, fidelity: str, scene: str) -> None:
    design = ml.load(name)
    (law,) = design.scene(scene, fidelity).laws
    m = design.mechanism(fidelity)
    inverse = law.inverse(m)
    for seed in (1, 2, 3):
        plant = moving(m, seed)
        commands = np.random.default_rng(seed).standard_normal(len(law.drives))
        wanted = truth(plant, inverse.rows, commands, law.drives)
        # 1e-9: the condition of the whole system is 1e7 where spinning rods have 3e-7 kg m2
        np.testing.assert_allclose(inverse(plant, commands), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_a_freedom_that_nobody_commands_follows_its_own_dynamics() -> None:
    """A cart with a pendulum, l = 0.3 m, at rest at an angle: the cart's force carries what the swinging pendulum does to it."""
    b = ml.Builder("cart")
    b.body("cart", prismatic("x", "x"), inertia=Inertia.point(2.0))
    b.body("bob", revolute("angle", "y"), parent="cart", inertia=Inertia.point(0.5, (0.0, 0.0, -0.3)))
    m = b.build()
    angle, wanted, g = 0.4, 1.7, 9.81
    plant = TreePlant(m, np.array([0.0, angle]))
    # with the bob at (-l sin, -l cos): x'' - l cos angle'' = its acceleration along x, and l angle'' = x'' cos - g sin
    swing = (wanted * np.cos(angle) - g * np.sin(angle)) / 0.3
    force = 2.0 * wanted + 0.5 * (wanted - 0.3 * np.cos(angle) * swing)
    found = drive_forces(plant, np.array([m.row("x")]), np.array([wanted]), ("x",))
    assert found[0] == pytest.approx(force, rel=1e-12)


def test_a_state_that_is_not_finite_gives_no_force() -> None:
    m = ml.load("platform_3rrr").mechanism("minimal")
    (law,) = ml.load("platform_3rrr").scene("driven-cranks", "minimal").laws
    plant = TreePlant(m)
    assert np.isnan(law.inverse(m)(plant, np.full(3, np.nan))).all()


class Fixed(TreePlant):
    """Three carts on one axis with constraint rows that are given."""

    rows = np.zeros((0, 3))

    def jacobian(self) -> np.ndarray:
        return self.rows

    def constraint_bias(self) -> np.ndarray:
        return np.arange(1.0, 1.0 + len(self.rows))


def test_rows_that_are_chosen_at_a_singular_pose_do_not_last() -> None:
    """At first the second row repeats the first; later it is another, and then they contradict each other."""
    b = ml.Builder("carts")
    for k in range(3):
        b.body(f"cart{k}", prismatic(f"x{k}", "x"), inertia=Inertia.point(1.0 + k))
    m = b.build()
    plant = Fixed(m)
    inverse, command = InverseDynamics(m, np.array([m.row("x2")]), ("x2",)), np.array([0.3])
    for rows in ([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0]], [[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]], [[1.0, 1.0, 0.5], [0.0, 1.0, 2.0]]):
        plant.rows = np.array(rows)
        np.testing.assert_allclose(inverse(plant, command), truth(plant, inverse.rows, command, ("x2",)), rtol=1e-12)
    plant.rows = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])  # a0 + a1 = -1 and -2: in the middle by least squares
    assert inverse(plant, command)[0] == pytest.approx(3.0 * 0.3, rel=1e-12)
