"""Curves and the relations that they make: the data, rows against finite differences and between all who compute them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.mechanism import (
    Builder,
    ConstraintSet,
    Curve,
    Inertia,
    Mechanism,
    TreeKinematics,
    close,
    constant,
    hermite,
    joined,
    polynomial,
    prismatic,
    revolute,
    spherical,
    structure,
)
from mechlab.mechanism.batch_sparse import SparseRows
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.length_unit import in_unit_of_length, row_units
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.state_rows import state_rows

STEP = 1e-6
SOLID = Inertia.box(1.0, 0.1, 0.2, 0.3)


def law(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A smooth law with a rise, and its derivatives."""
    s, c = np.sin(x), np.cos(x)
    return 0.1 * x + 0.3 * s, 0.1 + 0.3 * c, -0.3 * s


def wave(pieces: int = 24) -> Curve:
    """The law as a periodic curve."""
    x = np.linspace(0.0, 2.0 * math.pi, pieces + 1)
    return hermite(x, *law(x), periodic=True)


def coupled(extra: Callable[[Builder], object] | None = None) -> Mechanism:
    """A crank, a slide that follows it, and a lever that follows the slide, closed by two curves; zeros are not 0."""
    curve, bend = wave(), polynomial((0.2, 2.0, -1.5, 0.7), at=0.05)
    b = Builder("coupled", gravity=(0.0, 0.0, -9.81))
    x = 0.4
    s = curve.at(x)[0]
    b.body("crank", revolute("phi", "y", zero=x), inertia=SOLID)
    b.body("slide", prismatic("s", "z", zero=s, stiffness=50.0), at=(0.4, 0.0, 0.0), inertia=SOLID)
    b.body("lever", revolute("psi", "x", zero=bend.at(s)[0]), parent="slide", at=(0.0, 0.1, 0.0), inertia=SOLID)
    if extra:
        extra(b)
    return b.curve("cam", "s", "phi", curve).curve("arm", "psi", "s", bend).build()


def test_a_curve_is_its_law_within_the_error_of_quintic_pieces() -> None:
    """h^6 / 46080 and h^4 / 1920 of the sixth derivative 0.3 for h = 2 pi / 24; scalar and array evaluation are the same."""
    curve, h = wave(), 2.0 * math.pi / 24
    x = np.linspace(-20.0, 20.0, 1001)
    found = curve.many(x)
    for a, b, error in zip(found, law(x), (h**6 / 46080, h**5 / 4000, h**4 / 1920), strict=True):
        assert np.max(np.abs(a - b)) < 0.3 * error + 1e-14
    np.testing.assert_allclose(found, np.array([curve.at(float(a)) for a in x]).T, rtol=0, atol=1e-14)
    assert curve.rise == pytest.approx(0.2 * math.pi) and curve.jumps == ()


def test_a_jump_of_the_second_derivative_stands_at_a_knot() -> None:
    up = hermite([0.0, 1.0], [0.0, 0.5], [0.0, 1.0], [1.0, 1.0])
    curve = joined([constant(-1.0, 0.0, 0.0), up])
    assert curve.jumps == (0.0,) and curve.at(-3.0) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(curve.at(0.6), (0.18, 0.6, 1.0), atol=1e-15)
    np.testing.assert_allclose(curve.at(2.0), (2.0, 2.0, 1.0), atol=1e-12)  # the last piece, x^2 / 2, goes on


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Curve((0.0, 1.0, 2.0), ((0.0, 1.0), (3.0, 1.0))), "value jumps by 2 at 1"),
        (lambda: Curve((0.0, 1.0, 2.0), ((0.0, 1.0), (1.0, -1.0))), "slope jumps by -2 at 1"),
        (lambda: Curve((0.0, 1.0), ((0.0, 1.0),), 0.0), "value jumps"),
        (lambda: Curve((0.0, 0.0), ((0.0, 1.0),)), "knots must rise"),
        (lambda: Curve((0.0, math.nan), ((0.0, 1.0),)), "finite"),
        (lambda: Curve((0.0, 1.0), ()), "pieces"),
        (lambda: Curve((0.0, 1.0, 2.0), ((0.0, 1.0), (1.0,))), "same 1 to 8 coefficients"),
        (lambda: hermite([0.0, 1.0], [0.0], [0.0, 1.0], [0.0, 1.0]), "as many values"),
        (lambda: joined([constant(0.0, 1.0, 0.0), constant(2.0, 3.0, 0.0)]), "begins at 2"),
        (lambda: Builder("b").curve("c", "a", "b", 3.0), "expected a Curve"),
        (lambda: coupled(lambda b: b.curve("x", "s", "s", wave())), "to itself"),
        (lambda: coupled(lambda b: b.curve("x", "s", "fi", wave())), "'fi' does not exist"),
        (lambda: coupled(lambda b: b.curve("cam", "s", "phi", wave())), "'cam' is used 2 times"),
        (lambda: coupled(lambda b: b.body("t", spherical("t"), inertia=SOLID).curve("x", "t", "s", wave())), "spherical"),
        (lambda: replace(coupled(), curves=(replace(coupled().curves[0], curve=polynomial((1.0, 1.0))),)), "not assembled"),
    ],
)  # fmt: skip
def test_wrong_curves_are_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        make()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rows_are_derivatives_of_the_residual(seed: int) -> None:
    """Central differences: truncation STEP^2 times third derivatives of order 10, rounding 1e-16 / STEP."""
    m = coupled()
    rng = np.random.default_rng(seed)
    q, v = rng.uniform(-2.0, 2.0, 3), rng.standard_normal(3)
    constraints, tree = ConstraintSet(m), TreeKinematics(m, q, v)
    jacobian, bias = constraints.jacobian(tree), constraints.bias(tree)
    ahead, behind = q + STEP * v, q - STEP * v
    rate = (constraints.residual(tree.set(ahead)) - constraints.residual(tree.set(behind))) / (2 * STEP)
    np.testing.assert_allclose(rate, jacobian @ v, atol=1e-8)
    slope = (constraints.jacobian(tree.set(ahead, v)) - constraints.jacobian(tree.set(behind, v))) @ v / (2 * STEP)
    np.testing.assert_allclose(slope, bias, atol=1e-8)


def test_all_who_compute_rows_agree() -> None:
    """Single and batch numpy, sparse rows, Pinocchio and MuJoCo, at poses off the constraints and many turns away."""
    m = coupled()
    rng = np.random.default_rng(4)
    q, v = rng.uniform(-9.0, 9.0, (6, 3)), rng.standard_normal((6, 3))
    constraints, batch, poses = ConstraintSet(m), BatchRows(BatchTree(m)), ManyPoses(m).set(q)
    residual, jacobian = batch.evaluate(q)
    many = poses.residual_and_jacobian()
    sparse = SparseRows(batch)
    entries, gaps = sparse.at(q)
    for k in range(len(q)):
        tree = TreeKinematics(m, q[k], v[k])
        wanted = constraints.residual(tree), constraints.jacobian(tree), constraints.bias(tree)
        filled = np.zeros((2, 3))
        np.add.at(filled, (sparse.row, sparse.column), entries[:, k])
        for found in ((residual[k], jacobian[k]), (many[0][k], many[1][k]), (gaps[:, k], filled)):
            np.testing.assert_allclose(found[0], wanted[0], atol=1e-12)
            np.testing.assert_allclose(found[1], wanted[1], atol=1e-12)
        np.testing.assert_allclose(state_rows(m).bias(ManyStates(m, q, v))[k], wanted[2], atol=1e-12)
        for name in ("pinocchio", "mujoco"):
            plant = engine(name).plant(m).set(q[k], v[k])
            np.testing.assert_allclose(plant.jacobian(), wanted[1], atol=1e-12)
            np.testing.assert_allclose(plant.constraint_bias(), wanted[2], atol=1e-11)
            np.testing.assert_allclose(plant.closing()[0], wanted[0], atol=1e-11)


def test_structure_names_rows_and_freedom() -> None:
    found = structure(coupled())
    assert (found.rank, found.freedoms, found.independent) == (2, 1, ("phi",)) and not found.redundant
    twice = structure(coupled(lambda b: b.curve("again", "s", "phi", wave())))
    assert twice.freedoms == 1 and [r.row for r in twice.redundant] in (["again"], ["cam"])


def test_poses_are_closed_on_the_branch_of_the_law() -> None:
    m = coupled()
    for x in (-7.0, 0.0, 2.5, 30.0):
        for name in ("pinocchio", "mujoco"):
            found = engine(name).assemble(m, {"phi": x})
            assert found.closed
            assert float(m.value("s", found.q)) == pytest.approx(float(law(np.array(x))[0]), abs=3e-9)  # 0.3 h^6 / 46080
    opened = Builder.of(m).change("s", kind="joint", zero=0.0).change("psi", kind="joint", zero=0.0)
    again = opened.assemble({"phi": 0.3}, hold=("phi",))
    assert again.joint("phi").zero == 0.7 and again.joint("s").zero == pytest.approx(float(law(np.array(0.7))[0]), abs=3e-9)


def test_json_edit_attach_and_units_of_length() -> None:
    m = coupled()
    assert from_json(to_json(m)) == m and Builder.of(m).build() == m and '"curves"' in to_json(m)
    renamed = ml.edit(m).rename("phi", "turn").rename("cam", "disc").build()
    assert [(x.name, x.output, x.input) for x in renamed.curves] == [("disc", "s", "turn"), ("arm", "psi", "s")]
    with pytest.raises(MechlabError, match="cam"):
        ml.edit(m).remove("phi")
    assert not ml.edit(m).remove("cam").remove("arm").build().is_closed
    two = ml.edit(m).attach(m, prefix="b_").build()
    assert two.curves[2].input == "b_phi" and structure(two).freedoms == 2
    small = in_unit_of_length(m, 0.25)
    q = close(m, m.reference(), {"phi": 1.7}).q
    short = q * [1.0, 4.0, 1.0]
    assert np.max(np.abs(ConstraintSet(small).residual(TreeKinematics(small, short)))) < 1e-12
    assert row_units(m, ConstraintSet(m)).tolist() == [m.length_scale, 1.0]
    assert "s = f(phi)" in str(ml.load(m))
