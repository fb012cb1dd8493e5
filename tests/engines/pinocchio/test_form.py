"""The forms that users of Pinocchio and MuJoCo take: against finite differences, the numpy tree, and Pinocchio's own dynamics."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, ConstraintSet, Joint, Placement, TreeKinematics
from mechlab.mechanism.geometry import matrix_to_quaternion
from mechlab.mechanism.parts import LOOP_ROWS, Loop
from mechlab.mechanism.structure import null_space
from tests.engines.pinocchio.random_mechanisms import inertia, placement, random_mechanism

PROXIMAL = (1e-12, 1e-8, 20)
"""As the docstring says; accuracy of constraintDynamics then about 1e-7 of the accelerations, 1e-8 being the regularization."""


def closed_state(m, rng):
    """The reference pose, which is closed, with random rates that keep the rows."""
    rows = ConstraintSet(m).jacobian(TreeKinematics(m))
    free = null_space(rows) if len(rows) else np.eye(m.nv)
    return m.reference(), free @ rng.standard_normal(free.shape[1])


def chain(kind, seed):
    """Six bodies in a ring, loose enough to move with any loop; the loop closes at the reference pose by construction."""
    rng = np.random.default_rng(seed)
    b = Builder(f"ring_{kind}", gravity=(1.0, 2.0, -9.0))
    names = ["ground"]
    for k in range(6):
        if k % 3 == 2:
            joints = (Joint(f"j{k}", "spherical", armature=0.02),)
        else:
            joints = (Joint(f"j{k}", "revolute", tuple(np.eye(3)[k % 3]), armature=0.05),)
        b.bodies.append(ml.Body(f"b{k}", names[-1], placement(rng), joints, inertia(rng)))
        names.append(f"b{k}")
    tree = TreeKinematics(b.build())
    rotation, origin = tree.pose("b5")
    there = placement(rng)
    in_world = np.eye(4)
    in_world[:3, :3], in_world[:3, 3] = rotation, origin
    at_ground = in_world @ there.matrix()
    here = Placement(tuple(at_ground[:3, 3]), matrix_to_quaternion(at_ground[:3, :3]))
    b.loops.append(Loop("closing", kind, "ground", "b5", here, there))
    return b.build()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["spherical", "revolute", "fixed"])
def test_pinocchios_own_dynamics_with_these_closures_move_as_ours(kind, seed):
    m = chain(kind, seed)
    form = ml.load(m).to_pinocchio()
    model, constraints = form
    assert model is form[0] and len(form) == 2 and constraints.rows
    assert (
        len(form.rigid_constraints) == (2 if kind == "revolute" else 1) and not form.rows_only and not form.not_in_model
    )
    rng = np.random.default_rng(100 + seed)
    own_q, v = closed_state(m, rng)
    tau = rng.standard_normal(m.nv)
    ours = engine("pinocchio").accelerations(m, own_q, v, tau)
    q, v = form.engine_state(own_q, v)
    models, data = form.rigid_constraints, model.createData()
    datas = pin.StdVec_RigidConstraintData()
    for one in models:
        datas.append(one.createData())
    pin.initConstraintDynamics(model, data, models, datas)
    theirs = pin.constraintDynamics(model, data, q, v, tau, models, datas, pin.ProximalSettings(*PROXIMAL))
    np.testing.assert_allclose(theirs, ours, atol=1e-5 * np.abs(ours).max())
    # and the equations, solved with the rows and matrices that the form gives
    rows, bias = form.rows(q, v)
    size = m.nv + len(rows)
    matrix = np.zeros((size, size))
    matrix[: m.nv, : m.nv], matrix[: m.nv, m.nv :], matrix[m.nv :, : m.nv] = form.mass_matrix(q), rows.T, rows
    side = np.concatenate([tau - form.bias(q, v), -bias])
    by_hand = np.linalg.lstsq(matrix, side, rcond=1e-12)[0][: m.nv]
    np.testing.assert_allclose(by_hand, ours, atol=1e-8 * np.abs(ours).max())


@pytest.mark.parametrize("seed", range(6))
def test_rows_are_the_derivatives_of_the_residual(seed):
    """Random mechanisms with every kind of loop, relations, shafts: J by central differences of the residual along pin.integrate, and
    dJ/dt v by differences of J v; step 1e-6, so 1e-8."""
    m = random_mechanism(seed)
    form = ml.load(m).to_pinocchio()
    rng = np.random.default_rng(seed)
    q, v = form.engine_state(m.reference(), rng.standard_normal(m.nv))
    q = pin.integrate(form.model, q, 0.3 * rng.standard_normal(m.nv))
    rows, bias = form.rows(q, v)
    h = 1e-6
    for k in range(m.nv):
        e = h * np.eye(m.nv)[k]
        plus, minus = (form.residual(pin.integrate(form.model, q, s * e)) for s in (1, -1))
        np.testing.assert_allclose((plus - minus) / (2 * h), rows[:, k], atol=1e-7)
    plus, minus = (form.rows(pin.integrate(form.model, q, s * h * v), v)[0] @ v for s in (1, -1))
    np.testing.assert_allclose((plus - minus) / (2 * h), bias, atol=1e-6 * max(1.0, np.abs(bias).max()))
    state = engine("numpy").state(m, form._made.from_pin(q), v)
    np.testing.assert_allclose(rows, state.rows, atol=1e-11)
    np.testing.assert_allclose(form.mass_matrix(q), state.mass_matrix, atol=1e-11)
    np.testing.assert_allclose(form.bias(q, v), state.bias, atol=1e-10)


def test_what_pinocchio_cannot_say_is_named_and_stands_in_rows():
    form = ml.load("gear_linkage").to_pinocchio()
    m = form.mechanism
    assert set(form.rows_only) | set(form.rigid_names) == {x.name for x in (*m.loops, *m.relations)}
    assert all("couples joints" in form.rows_only[r.name] for r in m.relations)
    for kind, count in LOOP_ROWS.items():
        if kind not in ("spherical", "revolute", "fixed", "distance"):
            other = ml.load(chain(kind, 0)).to_pinocchio()
            assert list(other.rows_only) == ["closing"] and kind in other.rows_only["closing"]
            q, v = other.engine_state(other.mechanism.reference())
            assert other.rows(q, v, other.rows_only)[0].shape == (count, other.mechanism.nv)
            assert len(other.row_names(["closing"])) == count
            with pytest.raises(MechlabError, match="closing"):
                other.rows(q, v, ["closign"])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["mujoco", "pinocchio"])
def test_states_by_name_go_there_and_back(name, seed):
    """And both engines place the bodies where the numpy tree does."""
    m = random_mechanism(seed, loops=False)
    rng = np.random.default_rng(seed)
    values = {j.name: rng.normal() if j.nv == 1 else rng.normal(size=4) for j in m.joints}
    rates = {j.name: rng.normal(size=j.nv) for j in m.joints}
    design = ml.load(m)
    form = design.to_mujoco() if name == "mujoco" else design.to_pinocchio()
    q, v = form.engine_state(values, rates)
    back, back_rates = form.named_state(q, v)
    own = m.reference()
    for joint in m.joints:
        expected = np.asarray(values[joint.name])
        expected = expected if joint.nv == 1 else expected / np.linalg.norm(expected)
        np.testing.assert_allclose(back[joint.name], expected, atol=1e-14)
        np.testing.assert_allclose(np.atleast_1d(back_rates[joint.name]), rates[joint.name], atol=1e-14)
        own[m.q_slice[joint.name]] = expected if joint.nv == 3 else expected - joint.zero
    tree = TreeKinematics(m, own)
    if name == "mujoco":
        model, data = form
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
    else:
        pin.framesForwardKinematics(form.model, data := form.model.createData(), q)
    for body in m.bodies:
        if name == "mujoco":
            point = data.body(body.name).xpos
        else:
            point = data.oMf[form.model.getFrameId(body.name)].translation
        np.testing.assert_allclose(point, tree.pose(body.name)[1], atol=1e-12)


def test_a_state_that_is_not_whole_is_refused():
    form = ml.load("fourbar").to_mujoco()
    with pytest.raises(MechlabError, match="rocker_angle is missing"):
        form.engine_state({"crank_angle": 1.0, "coupler_joint": 0.2})
    answer = {"crank_angle": 1.0, "coupler_joint": -0.414, "rocker_angle": 1.555}
    with pytest.raises(MechlabError, match="crank'"):
        form.engine_state(answer | {"crank": 1.0})
    with pytest.raises(MechlabError, match="finite"):
        form.engine_state(answer | {"crank_angle": np.nan})


@pytest.mark.parametrize("engine", ["to_mujoco", "to_pinocchio"])
def test_arrays_of_another_length_are_refused_with_what_was_expected(engine):
    form = getattr(ml.load("fourbar"), engine)()
    for call in (form.engine_state, form.named_state):
        with pytest.raises(MechlabError, match=r"q(pos)?: expected 3 numbers \(.*crank_angle.*got the shape \(2,\)"):
            call([1.0, 2.0])
        with pytest.raises(MechlabError, match=r"(v|qvel): expected 3 numbers .*got the shape \(4,\)"):
            call(np.zeros(3), np.zeros(4))
        with pytest.raises(MechlabError, match="expected 3 numbers, got 'abc'"):
            call("abc")


def test_an_answer_of_solve_goes_into_the_engine_and_is_closed():
    """solve -> names -> qpos: the equality rows of MuJoCo are at rounding level there."""
    m = ml.load("fourbar").mechanism()
    answers = ml.solve(m, crank_angle=1.3)["pinocchio"]
    form = ml.load(m).to_mujoco()
    values = {"crank_angle": 1.3} | {j.name: answers[j.name] for j in m.joints if j.name in answers}
    form.data.qpos[:], form.data.qvel[:] = form.engine_state(values)
    mujoco.mj_forward(form.model, form.data)
    rows = form.data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    assert rows.any() and np.abs(form.data.efc_pos[rows]).max() < 1e-9
