"""Masses, forces and poses of written MJCF agree with the mechanism to rounding; its inertias are taken as they are."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mechanism_zoo import ALL, arm, fourbar, state, tree

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Settings, preset
from mechlab.formats import to_mjcf
from mechlab.mechanism import Builder, Inertia, TreeKinematics, prismatic, revolute, spherical
from mechlab.mechanism.statics import hold_reference_pose, passive_force


def load(m, **options):
    model = mujoco.MjModel.from_xml_string(to_mjcf(m, **options))
    return model, mujoco.MjData(model)


def at(m, q, v):
    model, data = load(m)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return model, data, mass


def relative(a, b):
    return np.max(np.abs(a - b)) / max(np.max(np.abs(b)), 1e-300)


@pytest.mark.parametrize("seed", range(30))
def test_dynamics_of_random_trees(seed):
    m = tree(seed)
    q, v = state(m, seed)
    _, data, mass = at(m, q, v)
    kin = TreeKinematics(m, q, v)
    assert relative(mass, kin.mass_matrix()) < 1e-12
    assert relative(data.qfrc_bias, kin.bias_force()) < 1e-12
    assert relative(data.qfrc_passive, passive_force(kin)) < 1e-12
    for body in m.bodies:
        assert np.abs(data.body(body.name).xpos - kin.pose(body.name)[1]).max() < 1e-13
        assert np.abs(data.body(body.name).xmat.reshape(3, 3) - kin.pose(body.name)[0]).max() < 1e-13


def test_coordinates_are_those_of_the_mechanism():
    m = tree(3)
    model, data, _ = at(m, *state(m, 3))
    assert np.array_equal(model.qpos0, m.reference())
    for joint in m.joints:
        found = model.joint(joint.name)
        assert found.qposadr[0] == m.q_slice[joint.name].start
        if joint.range is not None:
            assert np.allclose(found.range, np.array(joint.range) - joint.zero, atol=1e-15)
        if joint.nv == 1:
            assert found.user[0] == joint.zero
            assert data.sensor(f"pos:{joint.name}").data[0] == data.qpos[found.qposadr[0]]
    for shaft in m.shafts:
        q, v = data.qpos, data.qvel
        assert abs(data.sensor(f"pos:{shaft.name}").data[0] + shaft.zero - m.value(shaft.name, q)) < 1e-14
        assert abs(data.sensor(f"rate:{shaft.name}").data[0] - v @ m.row(shaft.name)) < 1e-14
    tip = m.frame("tip")
    kin = TreeKinematics(m, data.qpos.copy())
    r, p = kin.pose(tip.body)
    assert np.abs(data.sensor("at:tip").data - p - r @ tip.placement.translation).max() < 1e-13


def test_inertias_at_the_edge_of_what_is_possible():
    """MuJoCo refuses 4 of 10 plates, whose moments satisfy a + b = c only to rounding; ours are lifted by 4e-14."""
    rng = np.random.default_rng(0)
    for k in range(200):
        q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        a, b = 10 ** rng.uniform(-6, 1, 2)
        t = q @ np.diag([[a, b, a + b], [a, a, 0.0], [0.0, 0.0, 0.0]][k % 3]) @ q.T
        tensor = (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2])
        part = Inertia(1.0, (0.1, 0.2, 0.3), tensor)
        m = Builder("plate").body("plate", revolute("turn"), prismatic("slide"), inertia=part).build()
        _, _, mass = at(m, np.zeros(2), np.zeros(2))
        assert relative(mass, TreeKinematics(m).mass_matrix()) < 1e-12


def test_joints_that_mujoco_does_not_allow_in_one_body():
    b = Builder("chain")
    joints = [
        spherical("ball"),
        revolute("turn", "x"),
        prismatic("slide", "y"),
        spherical("second"),
        revolute("last", "z"),
    ]
    b.body("body", *joints, inertia=Inertia.box(1, 0.1, 0.2, 0.3, (0.1, 0, 0)))
    m = b.build()
    q, v = state(m, 1)
    model, data, mass = at(m, q, v)
    kin = TreeKinematics(m, q, v)
    assert relative(mass, kin.mass_matrix()) < 1e-11
    assert relative(data.qfrc_bias, kin.bias_force()) < 1e-11
    assert model.nbody == 2 + 3


def test_a_massless_body_that_carries_another():
    b = Builder("cross").body("cross", revolute("a", "x"))
    m = b.body("rod", revolute("b", "y"), parent="cross", inertia=Inertia.box(1, 0.1, 0.1, 0.5)).build()
    q, v = state(m, 1)
    _, _, mass = at(m, q, v)
    assert relative(mass, TreeKinematics(m, q, v).mass_matrix()) < 1e-11


def test_names_that_mjcf_keeps_for_itself():
    b = Builder("names").body("base", revolute("base"), inertia=Inertia.box(1, 1, 1, 1))
    m = b.body("world", revolute("world"), parent="base", inertia=Inertia.box(1, 1, 1, 1)).build()
    model, _ = load(m)
    assert [model.body(k).name for k in range(model.nbody)] == ["world", "base", "base:body", "world:body"]


@pytest.mark.parametrize("name", ALL)
def test_options_and_names(name):
    m = ALL[name]()
    model, _ = load(m)
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert np.array_equal(model.opt.gravity, m.gravity)
    assert [model.body(k).name for k in np.flatnonzero(model.body_parentid == 0)[1:]] == ["base"]
    for item in (*m.loops, *m.relations):
        row = model.equality(item.name)
        assert row.solref[0] == 0.002 and row.solimp[0] == 0.9999
    for drive in m.drives:
        assert model.actuator(drive.name).id >= 0
    assert model.key("home").id == 0
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()


def test_settings_are_written():
    model, _ = load(fourbar(), settings=preset("stiff"))
    assert model.opt.timestep == 2.5e-4 and model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
    model, _ = load(fourbar(), settings=preset("defaults"))
    assert tuple(model.eq_solref[0]) == (0.02, 1.0) and tuple(model.eq_solimp[0]) == (0.9, 0.95, 0.001, 0.5, 2.0)
    model, _ = load(fourbar(), settings=Settings(engine="pinocchio", integrator="DOP853", timestep=2e-3))
    assert model.opt.timestep == 2e-3 and model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4


def test_contacts_only_when_asked():
    model, _ = load(arm(), contacts=True)
    assert model.geom_contype.all()


@pytest.mark.parametrize("name", ALL)
def test_the_same_byte_for_byte(name):
    assert to_mjcf(ALL[name]()) == to_mjcf(ALL[name]())


def test_a_shaft_spring_at_minus_one():
    """MuJoCo takes the springlength -1 for "not given"."""
    b = Builder("spring").body("disc", revolute("turn"), inertia=Inertia.cylinder(1, 0.1, 0.1))
    b.shaft("rotor", {"turn": 2}, stiffness=3.0, spring_rest=-1.0)
    m = b.build()
    _, data, _ = at(m, np.array([0.1]), np.zeros(1))
    assert math.isclose(data.qfrc_passive[0], -2 * 3.0 * (0.2 + 1.0), rel_tol=1e-14)


def test_home_holds_against_gravity():
    m = arm()
    assert hold_reference_pose(m).holds
    model, data = load(m)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos).max() < 1e-10
    assert np.abs(data.qvel).max() < 1e-10


def test_home_of_a_closed_loop_holds():
    m = fourbar()
    assert hold_reference_pose(m).holds
    model, data = load(m)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos).max() < 1e-6  # the soft loop gives way by 1e-7 m


def test_drives_that_cannot_hold_say_so():
    m = replace(fourbar(), drives=())
    found = hold_reference_pose(m)
    assert not found.holds and "cannot hold" in found.sentence(m)
    weak = replace(fourbar(), drives=(replace(fourbar().drives[0], limit=1e-3),))
    assert not hold_reference_pose(weak).holds and abs(hold_reference_pose(weak).forces["crank"]) == 1e-3


def test_a_limit_of_zero_is_refused():
    m = replace(fourbar(), drives=(replace(fourbar().drives[0], limit=0.0),))
    with pytest.raises(MechlabError, match="drive 'crank': a force limit of 0"):
        to_mjcf(m)
