"""Forces of laws at many states at once, against the laws themselves at one state after the other, by the numpy tree."""

import numpy as np
import pytest

import mechlab as ml
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.experiment.tree_plant import TreePlant
from mechlab.lab.accuracy.dense import driven, law_forces
from mechlab.mechanism.batch_dynamics import BatchDynamics


@pytest.mark.parametrize(("name", "scene"), [
    ("fivebar", "driven-crank"), ("quick_return", "driven-crank"), ("delta6", "head-tracking"), ("fourbar", "driven-crank"),
    ("closed_differential", "internal-drag"), ("closed_differential", "motor-and-viscous-load"),
])  # fmt: skip
def test_forces_and_accelerations_are_those_of_the_laws_one_by_one(name: str, scene: str) -> None:
    """Computed torque with loops, redundant rows and shafts; a servo, dampers, a motor; at states of a run, moved at random rates."""
    design = ml.load(name).for_scene(scene)
    plan, run = design.scene(scene), ml.simulate(design, scene=scene, duration=0.2)
    m, rng = run.mechanism, np.random.default_rng(3)
    some = rng.choice(len(run.t), 9, replace=False)
    t, q = run.t[some], run.q[some]
    v = run.v[some] * rng.uniform(0.5, 1.5, (9, 1))
    named, accelerations = driven(m, plan, t, q, v)
    again = law_forces(m, plan, t, q, v)
    plant = TreePlant(m)
    for k in range(9):
        plant.set(q[k], v[k], float(t[k]))
        wanted: dict[str, float] = {}
        push = np.zeros(m.nv)
        for law in plan.laws:
            for target, force in law.force(float(t[k]), plant).items():
                wanted[target] = wanted.get(target, 0.0) + force
                push += force * m.row(target)
        size = 1.0 + max(abs(x) for x in wanted.values())
        # two factorizations of matrices with condition numbers up to 1e4
        assert {n: x[k] for n, x in named.items()} == pytest.approx(wanted, abs=1e-10 * size)
        assert {n: x[k] for n, x in again.items()} == pytest.approx(wanted, abs=1e-10 * size)
        slow = plant.accelerations(push)
        assert accelerations[k] == pytest.approx(slow, abs=1e-9 * (1.0 + np.max(np.abs(slow))))


def test_a_singular_pose_is_left_to_the_solution_one_by_one() -> None:
    """The five-bar with both distal links on one line: the drives do not command the point, and no number is made up."""
    design = ml.load("fivebar").for_scene("driven-crank")
    plan, m = design.scene("driven-crank"), design.mechanism(None)
    q, v = np.tile(m.reference(), (3, 1)), np.zeros((3, m.nv))
    at = BatchDynamics(m).equations(q, v)
    at.rows[0] = 0.0  # no constraint left: the matrix of rows and unit rows is singular
    forces = CompiledLaws(m, plan.laws).many(np.zeros(3), q, v, lambda: at)[0]
    assert not np.isfinite(forces[0]).any()
