"""Accelerations at many states at once against the numpy tree, one state at a time, and against Pinocchio's forward dynamics."""

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Mechanism, TreeKinematics, close, revolute
from mechlab.mechanism.batch_dynamics import BatchDynamics
from mechlab.mechanism.many_poses import moved
from mechlab.mechanism.structure import null_space

CASES = [
    ("fourbar", "minimal"), ("andrews", "full"), ("bricard", "full"), ("flyball", "full"), ("delta6", "parts"),
    ("gear_linkage", "minimal"), ("planetary", "full"), ("closed_differential", "full"), ("prosthetic_leg", "full"),
    ("delta6", "full"), ("cam_follower", "full"),
]  # fmt: skip
"""Point, hinge and rod loops, gear relations, shafts, slides, springs between points, redundant rows, ball joints, a curve."""


def states(m: Mechanism, count: int = 7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The reference pose at random rates that keep it closed (a tree: random poses), under random forces."""
    rng = np.random.default_rng(5)
    free = null_space(ConstraintSet(m).jacobian(TreeKinematics(m)))
    v = rng.normal(size=(count, free.shape[1])) @ free.T
    open_ = 0.0 if m.loops or m.relations else 0.3
    q = moved(m, np.tile(m.reference(), (count, 1)), open_ * rng.normal(size=v.shape))
    return q, v, rng.normal(size=v.shape)


@pytest.mark.parametrize(("name", "fidelity"), CASES)
def test_many_states_at_once_accelerate_as_one_by_one(name: str, fidelity: str) -> None:
    m = ml.load(name).mechanism(fidelity)
    q, v, force = states(m)
    found = BatchDynamics(m).accelerations(q, v, force)
    one, other = TreePlant(m), engine("pinocchio")
    for k in range(len(q)):
        size = np.max(np.abs(found[k]))
        # both solve by least squares, which leaves 1e-12 of the condition of their equations: 6e6 with the rods of the full delta
        within = 1e-8 if (name, fidelity) == ("delta6", "full") else 1e-9
        assert found[k] == pytest.approx(one.set(q[k], v[k]).accelerations(force[k]), abs=within * size)
        assert found[k] == pytest.approx(other.accelerations(m, q[k], v[k], force[k]), abs=1e-8 * size)


def test_rows_that_are_rounding_hold_nothing() -> None:
    """The loops of a governor lie in a plane: two rows of each pin say nothing, and are rounding once the spindle has turned."""
    m = ml.load("watt_governor").mechanism("full")
    start = m.reference()
    turned = [close(m, None, {"spindle": x, "arm_1": float(m.value("arm_1", start)) - 1e-3}, steps=4).q for x in (0.0, -0.24, 0.9, 2.0)]
    q, v = np.array(turned), np.zeros((4, m.nv))
    found = BatchDynamics(m).accelerations(q, v, np.zeros((4, m.nv)))
    for k in range(4):
        right = engine("pinocchio").accelerations(m, q[k], v[k], np.zeros(m.nv))
        assert found[k] == pytest.approx(right, abs=1e-9 * np.max(np.abs(right)))
    # gravity does not see which way the spindle stands
    assert np.abs(found[1:] - found[0]).max() < 1e-9 * np.abs(found[0]).max() and np.abs(found[0]).max() > 1.0


def test_a_rod_between_two_points_holds_its_length_in_second_order() -> None:
    """Along d = b - a with |d| constant, d . d'' + |d'|^2 = 0: by second differences of the motion that the accelerations predict."""
    b = Builder("rod", gravity=(0.0, -9.81, 0.0))
    for name, x in (("left", 0.0), ("right", 0.5)):
        b.body(name, revolute(name, "z"), at=(x, 0.0, 0.0), inertia=Inertia.point(1.0, (0.3, 0.0, 0.0)))
    b.loop("rod", "left", "right", (0.1, 0.3, 0.0), (0.1, 0.2, 0.0), kind="distance", length=float(np.hypot(0.5, 0.1)))
    m = b.assemble()
    free = null_space(ConstraintSet(m).jacobian(TreeKinematics(m)))
    q, v = m.reference(), 2.0 * free[:, 0]
    a = BatchDynamics(m).accelerations(q[None], v[None], np.zeros((1, m.nv)))[0]
    h = 1e-3

    def residual(t: float) -> float:
        return float(ConstraintSet(m).residual(TreeKinematics(m, q + t * v + 0.5 * t * t * a))[0])

    # rate and acceleration keep it closed: what is left is of third order in t, and odd in it
    assert abs(residual(h) + residual(-h) - 2.0 * residual(0.0)) / h**2 < 1e-4
    assert a == pytest.approx(TreePlant(m, q, v).accelerations(np.zeros(m.nv)), rel=1e-9)
