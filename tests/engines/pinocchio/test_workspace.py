"""A large tree computed branch by branch against Pinocchio's algorithms on the whole of it."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from mechlab.engines.pinocchio.model import to_pinocchio
from mechlab.engines.pinocchio.workspace import PART, Workspace, parts_of, split
from mechlab.engines.protocol import engine
from mechlab.errors import EngineMissing
from mechlab.mechanism import Builder, Inertia, Mechanism, floating, prismatic, revolute, spherical
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.kinematics import TreeKinematics

PIECE = Inertia(1.3, (0.1, -0.05, 0.02), (0.02, 0.03, 0.025, 0.001, -0.002, 0.0005))


def forest(branches: int) -> Mechanism:
    """Branches of five rates and of three, spherical joints among them; their ends are tied to the next branch."""
    b = Builder("forest", gravity=(0.3, -9.81, 0.4))
    for k in range(branches):
        base = spherical(f"s{k}") if k % 3 else revolute(f"s{k}", (1, 2, 2))
        b.body(f"a{k}", base, at=(0.4 * k, 0.0, 0.0), inertia=PIECE)
        b.body(
            f"b{k}", prismatic(f"p{k}", "x"), revolute(f"r{k}", "y"), parent=f"a{k}", at=(0.3, 0.0, 0.1), inertia=PIECE
        )
    m = b.build()
    return replace(
        m, bodies=tuple(replace(x, joints=tuple(replace(j, armature=0.1) for j in x.joints)) for x in m.bodies)
    )


def test_parts_compute_what_the_whole_does() -> None:
    m = forest(20)
    made = to_pinocchio(m)
    model, data = made.model, made.model.createData()
    parts = parts_of(model)
    assert len(parts) == len(split(model)) > 2
    assert all(p.model.nv <= PART for p in parts)
    assert sum(p.model.nv for p in parts) == model.nv == m.nv
    work, rng = Workspace(model, parts), np.random.default_rng(4)
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=m.nv))
    v, tau, a = rng.normal(size=(3, m.nv))
    # the same sums of the same numbers, in blocks: rounding of forces of some 100 N m
    close = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(np.triu(work.mass(q)), np.triu(pin.crba(model, data, q)), **close)
    np.testing.assert_allclose(work.nonlinear(q, v), pin.nonLinearEffects(model, data, q, v), **close)
    np.testing.assert_allclose(work.forward(q, v, tau), pin.aba(model, data, q, v, tau), rtol=1e-10, atol=1e-10)
    pin.computeJointJacobiansTimeVariation(model, data, q, v)
    placed = work.place(q, v)
    np.testing.assert_allclose(placed.J, data.J, **close)
    np.testing.assert_allclose(placed.dJ, data.dJ, **close)
    for mine, whole in zip(placed.oMi, data.oMi, strict=True):
        np.testing.assert_allclose(mine.homogeneous, whole.homogeneous, **close)
    forces = [pin.Force(rng.normal(size=6)) for _ in range(model.njoints)]
    listed = pin.StdVec_Force()
    for k, f in enumerate(forces):
        listed.append(f if k else pin.Force.Zero())
    pin.rnea(model, data, q, v, a, listed)
    for mine, whole in zip(work.through_joints(q, v, a, forces)[1:], list(data.f)[1:], strict=True):
        np.testing.assert_allclose(mine.vector, whole.vector, rtol=1e-11, atol=1e-11)
    pin.ccrba(model, data, q, v)
    shares = work.moving(q, v)
    assert sum(s.mass for s in shares) == pytest.approx(data.Ig.mass, rel=1e-14)
    np.testing.assert_allclose(sum(s.momentum for s in shares), data.hg.linear, **close)


def test_more_rates_than_one_workspace_holds() -> None:
    # 80 free bodies hinged in a row, 480 rates: one pin.Data of them would take 4.9 GB
    b = Builder("row")
    for k in range(80):
        b.body(f"b{k}", *floating(f"f{k}"), at=(float(k), 0.0, 0.0), inertia=PIECE)
        if k:
            b.loop(f"h{k}", f"b{k - 1}", f"b{k}", (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), kind="revolute")
    m = b.build()
    q = m.reference() + 0.0
    q[m.q_slice["f3_x"]] += 0.01
    found, tree, rows = engine("pinocchio").state(m, q), TreeKinematics(m, q), ConstraintSet(m)
    np.testing.assert_allclose(found.residual, rows.residual(tree), atol=1e-14)
    np.testing.assert_allclose(found.mass_matrix, tree.mass_matrix(), atol=1e-12)


def test_one_long_branch_is_refused() -> None:
    b = Builder("chain")
    for k in range(460):
        b.body(
            f"b{k}", revolute(f"r{k}", "z"), parent=f"b{k - 1}" if k else "ground", at=(0.01, 0.0, 0.0), inertia=PIECE
        )
    with pytest.raises(EngineMissing, match="460 rates of one branch"):
        engine("pinocchio").state(b.build(), np.zeros(460))
