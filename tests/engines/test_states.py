"""What every engine says of one state of a mechanism, and of a file: the three must agree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mechlab import api, catalog
from mechlab.engines.protocol import IMPLEMENTATIONS, engine
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.newton import lightest_correction
from mechlab.mechanism.structure import null_space

OPENED = 1e-5
"""Displacement [rad or m] by which a closed pose is torn open; what a correction leaves is of the order of its square."""


def torn(m: Mechanism) -> np.ndarray:
    """A pose near the reference whose loops and relations are open."""
    return integrate(m, m.reference(), OPENED * np.random.default_rng(5).standard_normal(m.nv))


def by_kkt(m: Mechanism, q: np.ndarray) -> np.ndarray:
    """(nv,) the correction as the minimum of dq^T M dq / 2 under J dq = -r: [M J^T; J 0] [dq; r] = [0; -residual]."""
    tree, constraints = TreeKinematics(m, q), ConstraintSet(m)
    rows, size = constraints.jacobian(tree), m.nv + len(constraints)
    matrix = np.zeros((size, size))
    matrix[: m.nv, : m.nv], matrix[: m.nv, m.nv :], matrix[m.nv :, : m.nv] = tree.mass_matrix(), rows.T, rows
    side = np.concatenate([np.zeros(m.nv), -constraints.residual(tree)])
    return np.linalg.lstsq(matrix, side, rcond=1e-12)[0][: m.nv]


@pytest.mark.parametrize("name", IMPLEMENTATIONS)
@pytest.mark.parametrize(("model", "fidelity"), [("fourbar", None), ("planetary", "parts"), ("delta6", "parts")])
def test_the_correction_closes_with_the_least_kinetic_energy(name: str, model: str, fidelity: str | None) -> None:
    m = api.load(model).mechanism(fidelity)
    q = torn(m)
    plant = engine(name).plant(m)
    residual = plant.set(q).closing()[0].copy()
    dq = plant.correction(residual)
    left = plant.set(integrate(m, q, dq)).closing()[0]
    assert np.max(np.abs(residual)) > 0.01 * OPENED
    assert np.max(np.abs(left)) < 1e-3 * np.max(np.abs(residual))  # second order: about OPENED of it stays
    expected = by_kkt(m, q)
    # of the second order in the opening: the engines' rows at an open pose differ by that
    assert np.max(np.abs(dq - expected)) < 1e-3 * np.max(np.abs(expected))


@pytest.mark.parametrize("model", ["fourbar", "planetary", "flyball", "geometric_pen", "cam_follower", "delta6"])
@pytest.mark.parametrize("name", ["numpy", "mujoco"])
def test_accelerations_of_a_state_are_those_of_pinocchio(name: str, model: str) -> None:
    for fidelity in set(catalog.entry(model).fidelities) - {"kinematic"}:
        m = api.load(model).mechanism(fidelity)
        rng = np.random.default_rng(3)
        q = m.reference()
        free = null_space(ConstraintSet(m).jacobian(TreeKinematics(m, q)))
        v, force = free @ rng.standard_normal(free.shape[1]), rng.standard_normal(m.nv)
        ours, theirs = (engine(x).accelerations(m, q, v, force) for x in (name, "pinocchio"))
        # rounding of two solvers; MuJoCo's (4.0.0) ends where its cost no longer falls: 3e-8 of the full delta
        assert np.max(np.abs(ours - theirs)) < (1e-7 if name == "mujoco" else 1e-9) * np.max(np.abs(theirs))


def test_a_correction_with_a_singular_mass_matrix_is_the_smallest_displacement() -> None:
    rows, residual = np.array([[1.0, 1.0]]), np.array([0.2])
    assert lightest_correction(np.zeros((2, 2)), rows, residual) == pytest.approx([-0.1, -0.1])


def test_engines_read_the_size_of_a_file_they_are_given(tmp_path: Path) -> None:
    m = api.load("fourbar").mechanism()
    api.generate("fourbar", out=tmp_path)
    mass, rates = engine("mujoco").file_size(tmp_path / "fourbar.xml")
    assert (mass, rates) == (pytest.approx(m.total_mass, rel=1e-12), m.nv)
    mass, rates = engine("pinocchio").file_size(tmp_path / "fourbar.urdf")
    assert (mass, rates) == (pytest.approx(m.total_mass, rel=1e-12), m.nv)
