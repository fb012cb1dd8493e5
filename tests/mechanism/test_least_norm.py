"""The sparse solution of large systems against numpy's singular values."""

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, ConstraintSet, Inertia, TreeKinematics, floating, structure
from mechlab.mechanism import least_norm as module
from mechlab.mechanism.least_norm import LARGE, least_norm
from mechlab.mechanism.structure import sample_poses


def banded(n: int, repeated: int) -> np.ndarray:
    """(n + repeated, n + 50) rows that touch six neighbours each; the last ones repeat sums of others."""
    rng = np.random.default_rng(2)
    rows = np.zeros((n, n + 50))
    for k in range(n):
        rows[k, k : k + 6] = rng.normal(size=6) + np.array([4.0, 0, 0, 0, 0, 0])
    pairs = rng.integers(0, n, size=(repeated, 2))
    return np.vstack([rows, rows[pairs[:, 0]] - 2.0 * rows[pairs[:, 1]]])


def test_large_systems_with_repeated_rows_have_the_solution_of_least_size(monkeypatch: pytest.MonkeyPatch) -> None:
    matrix = banded(LARGE, 40)
    right = matrix @ np.random.default_rng(3).normal(size=matrix.shape[1])
    wanted = np.linalg.pinv(matrix, rcond=1e-11) @ right
    monkeypatch.setattr(module.np.linalg, "lstsq", None)  # the dense way must not be needed
    assert np.max(np.abs(least_norm(matrix, right) - wanted)) < 1e-9  # CLOSED is 1e-7 for the change of the last iteration


def test_what_contradicts_itself_is_solved_in_the_sense_of_least_squares() -> None:
    """Pairs of equal rows with right-hand sides that differ by 2e-3: their mean counts."""
    rows = banded(LARGE, 0)
    right = rows @ np.random.default_rng(3).normal(size=rows.shape[1])
    both = np.vstack([rows, rows])
    found = least_norm(both, np.concatenate([right + 1e-3, right - 1e-3]))
    assert np.max(np.abs(found - np.linalg.pinv(rows) @ right)) < 1e-6  # the method's stop: a change of 1e-7


def test_a_nearly_singular_system_is_solved_by_singular_values() -> None:
    matrix = banded(LARGE, 0)
    matrix[7] = matrix[8] + 1e-9 * matrix[7]
    right = np.random.default_rng(3).normal(size=len(matrix))
    assert np.allclose(least_norm(matrix, right), np.linalg.lstsq(matrix, right, rcond=1e-11)[0], rtol=1e-6)


def row_of_plates(n: int) -> Builder:
    """Free bodies in a row, each fixed to the next at two points: 6 n rates, 5 (n - 1) of 6 (n - 1) rows independent."""
    b = Builder("row")
    for i in range(n):
        b.body(f"b{i}", *floating(f"f{i}"), at=(float(i), 0.0, 0.0), inertia=Inertia.box(1.0, 1.0, 0.1, 0.1))
    for i in range(n - 1):
        for k in (0, 1):
            b.loop(f"l{i}_{k}", f"b{i}", f"b{i + 1}", (0.5, 0.1 * k, 0.0), (-0.5, 0.1 * k, 0.0))
    return b


def test_many_bodies_hinged_in_a_row() -> None:
    """Two common points leave a hinge between neighbors: 6 + (n - 1) freedoms, by hand; the poses are closed."""
    n = 56
    m = row_of_plates(n).build()
    assert m.nv >= LARGE and len(ConstraintSet(m)) >= LARGE
    found = structure(m)
    assert (found.rank, found.freedoms, len(found.redundant)) == (5 * (n - 1), 6 + n - 1, n - 1)
    poses = sample_poses(m)
    assert len(poses) == 5
    for q in poses[1:]:
        assert np.max(np.abs(ConstraintSet(m).residual(TreeKinematics(m, q)))) < 1e-11  # Newton stops at 1e-13, or at rounding of 56 m
        assert np.max(np.abs(q - m.reference())) > 0.01


def test_rates_are_limited() -> None:
    b = Builder("many")
    for i in range(301):
        b.body(f"b{i}", *floating(f"f{i}"), inertia=Inertia.box(1.0, 1.0, 0.1, 0.1))
    with pytest.raises(MechlabError, match="has 1806 rates .* limit is 1800"):
        b.build()
