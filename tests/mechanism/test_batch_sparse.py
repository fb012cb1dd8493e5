"""Sparse rows and their least squares against the numpy tree one pose at a time, dense least squares, and a parallelogram."""

import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.mechanism import Builder, ConstraintSet, Loop, Mechanism, Placement, TreeKinematics, prismatic, revolute
from mechlab.mechanism.batch_sparse import SparseClosing, SparseRows, smallest_of_rows
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.geometry import frame_along
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.parts import LOOP_ROWS
from mechlab.mechanism.sparse_squares import SparseLeastSquares
from mechlab.mechanism.structure import ranks
from tests.benchmarks.bench_large import four_bars, train
from tests.mechanism.samples import PART

CATALOG = [
    ("fourbar", "minimal"),
    ("bricard", "full"),
    ("delta6", "parts"),
    ("planetary", "full"),
    ("gear_linkage", "minimal"),
]


def two_chains(kind: str) -> Mechanism:
    """Hinges and slides, closed at the ends of two chains by a loop of the kind."""
    b = Builder(kind)
    b.body("a1", revolute("r1", (1, 2, 2)), inertia=PART)
    b.body("a2", prismatic("p1", "x"), revolute("r2", "y"), parent="a1", at=(0.3, 0, 0.1), inertia=PART)
    b.body("b1", revolute("s1", "z"), revolute("s2", "y"), at=(0.6, 0.1, 0), inertia=PART)
    b.body(
        "b2", *(prismatic(f"t{x}", x) for x in "xyz"), revolute("s3", "x"), parent="b1", at=(0, 0.2, 0.1), inertia=PART
    )
    ends = (0.2, 0.1, 0.0), (-0.1, -0.2, 0.0)  # (0.5, 0.1, 0.1) in the world, both
    away = (ends[0], (0.1, 0.2, 0.3)) if kind == "distance" else ends
    length = math.dist((0.5, 0.1, 0.1), (0.7, 0.5, 0.4)) if kind == "distance" else 0.0
    frame = frame_along((0.0, 0.6, 0.8))
    b.close_here(Loop("tie", kind, "a2", "b2", Placement.of(frame, away[0]), Placement.of(frame, away[1]), length))
    return b.build()


def mechanisms() -> list[Mechanism]:
    """Of the catalog, every kind of loop between two chains, and gears."""
    found = [ml.load(name).mechanism(fidelity) for name, fidelity in CATALOG]
    return [*found, *(two_chains(kind) for kind in LOOP_ROWS), train(5)]


@pytest.mark.parametrize("m", mechanisms(), ids=lambda m: m.name)
def test_entries_are_those_of_the_tree_one_pose_at_a_time(m: Mechanism) -> None:
    q = m.reference() + 0.2 * np.random.default_rng(3).normal(size=(4, m.nv))
    sparse = SparseRows(BatchRows(BatchTree(m)))
    values, residual = sparse.at(q)
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    for k, pose in enumerate(q):
        found = np.zeros((len(constraints), m.nv + 1))
        found[sparse.row, sparse.column] = values[:, k]
        found[:, -1] = residual[:, k]
        tree.set(pose)
        wanted = np.column_stack([constraints.jacobian(tree), constraints.residual(tree)])
        # the rows stand in another order: each has one of the other side, exact to rounding
        gap = np.abs(found[:, None] - wanted[None]).max(axis=2)
        assert gap.min(axis=1).max() < 1e-14 * (1.0 + np.abs(wanted).max())
        assert gap.min(axis=0).max() < 1e-14 * (1.0 + np.abs(wanted).max())


@pytest.mark.parametrize("band", [1, 4])
def test_least_squares_of_random_patterns(band: int) -> None:
    # Three rows for each of 40 columns, which name columns near it and, some, one far away.
    rng = np.random.default_rng(band)
    n, m, poses = 40, 120, 5
    entries = {(i, i // 3) for i in range(m)} | {(i, (i // 3 + int(rng.integers(band + 1))) % n) for i in range(m)}
    entries |= {(i, int(rng.integers(n))) for i in range(0, m, 17)}
    rows, columns = (np.array(x, dtype=np.intp) for x in zip(*sorted(entries), strict=True))
    values, sides = rng.normal(size=(len(rows), poses)), rng.normal(size=(m, 2, poses))
    found, change = SparseLeastSquares(rows, columns, n).solve(values, sides)
    # normal equations lose digits with the square of the condition number; the refinement gives them back
    assert change < 1e-9
    for p in range(poses):
        dense = np.zeros((m, n))
        dense[rows, columns] = values[:, p]
        assert found[:, :, p] == pytest.approx(np.linalg.lstsq(dense, sides[:, :, p])[0], abs=1e-12)


def test_a_column_without_entries_is_singular() -> None:
    equations = SparseLeastSquares(np.array([0, 1]), np.array([0, 1]), 3)
    with pytest.raises(np.linalg.LinAlgError):
        equations.solve(np.ones((2, 1)), np.ones((2, 1, 1)))


def test_a_row_of_parallelograms_is_closed() -> None:
    # All rockers turn alike and the couplers not at all: couplers' joints turn back by what the rockers turn.
    m = four_bars(40)
    sign = np.array([1.0 if j.name.startswith("rocker") else -1.0 for j in m.joints])
    angle = np.linspace(0.2, 1.3, 7)
    exact = angle[:, None] * sign
    q = exact + 0.02 * np.random.default_rng(2).normal(size=exact.shape)
    q[:, 0] = exact[:, 0]
    step = SparseClosing(BatchRows(BatchTree(m)), 0)
    for _ in range(5):
        found, _ = step.solve(q)
        q[:, 1:] -= found[:, :, 0]
    assert q == pytest.approx(exact, abs=1e-13)
    # minus the rates for the rate 1 of the first rocker
    assert found[:, :, 1] == pytest.approx(np.tile(-sign[1:], (7, 1)), abs=1e-12)
    gap = engine("pinocchio").state(m, q[3]).residual
    assert np.max(np.abs(gap)) < 1e-13 * math.sqrt(m.nv)


def test_small_mechanisms_and_one_large_loop_stay_dense() -> None:
    with pytest.raises(ValueError, match="small"):
        SparseClosing(BatchRows(BatchTree(four_bars(5))), 0)
    rows, columns = (x.ravel() for x in np.indices((3, 80)))
    assert not SparseLeastSquares(rows, columns, 80).pays


def test_smallest_singular_values_of_a_chain() -> None:
    m = four_bars(70)
    sign = np.array([1.0 if j.name.startswith("rocker") else -1.0 for j in m.joints])
    q = np.array([0.3, 1.0, 1.55])[:, None] * sign  # at pi / 2 all bars lie on one line
    jacobian = ManyPoses(m).set(q).residual_and_jacobian()[1]
    dense = np.linalg.svd(jacobian, compute_uv=False)[:, 2 * 70 - 1]
    # the square of the condition number, 1e4 to 1e8, times rounding
    assert smallest_of_rows(jacobian) == pytest.approx(dense, rel=1e-7)
    assert dense[2] < 0.1 * dense[0]
    repeated = np.concatenate([jacobian, jacobian[:, :1]], axis=1)
    found = smallest_of_rows(repeated)
    assert found is None or np.max(found) < 1e-6


def test_ranks_of_large_matrices_are_those_of_dense_ones() -> None:
    # bidiagonal rows, some of them zero; then one of them again
    rng, n = np.random.default_rng(8), 330
    matrix = np.diag(rng.uniform(1.0, 2.0, n)) + np.diag(rng.uniform(0.1, 0.5, n - 1), 1)
    matrix[::11] = 0.0
    again = matrix.copy()
    again[11] = matrix[12]
    nearly = matrix.copy()
    nearly[11] = matrix[12] + 1e-9 * matrix[13]  # independent in exact arithmetic, not to rounding
    assert ranks(np.stack([matrix, 2.0 * matrix])) == [300, 300]
    assert ranks(again[None]) == ranks(nearly[None]) == [300]
