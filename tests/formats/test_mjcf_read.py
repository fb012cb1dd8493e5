"""MJCF back to a mechanism: files of ours read back the same; ordinary MJCF agrees with MuJoCo; the rest is named."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mechanism_zoo import ALL, arm, state, tree

from mechlab.errors import MechlabError
from mechlab.formats import from_mjcf, to_mjcf
from mechlab.formats.json_text import exact
from mechlab.mechanism import ConstraintSet, Inertia, Shape, TreeKinematics


def linear(m):
    """The mechanism without what MJCF has no place for: summary, kinds of relations, shapes that need meshes."""
    kept = ("box", "cylinder", "sphere")

    def few(shapes: tuple[Shape, ...]):
        return tuple(replace(s, name="") for s in shapes if s.kind in kept)

    return replace(
        m, summary="", relations=tuple(replace(r, kind="linear") for r in m.relations),
        bodies=tuple(replace(b, shapes=few(b.shapes)) for b in m.bodies), ground_shapes=few(m.ground_shapes),
        shafts=tuple(replace(s, body="ground", shapes=()) for s in m.shafts),
    )  # fmt: skip


def plain(m):
    """Without inertias and ranges, which may come back with a different last digit."""

    def bare(body):
        joints = tuple(replace(j, range=None if j.range is None else (0.0, 1.0)) for j in body.joints)
        return replace(body, inertia=Inertia.box(1, 1, 1, 1), joints=joints)

    return replace(linear(m), bodies=tuple(bare(b) for b in linear(m).bodies))


@pytest.mark.parametrize("name", ALL)
def test_our_files_read_back(name):
    m = ALL[name]()
    again = from_mjcf(to_mjcf(m))
    if name == "distance":
        again = replace(again, loops=m.loops)  # its length is measured in the reference pose, to rounding
    assert plain(again) == plain(m)
    q, v = state(m, 1)
    expected = TreeKinematics(m, q, v)
    found = TreeKinematics(again, q, v)
    assert np.abs(found.mass_matrix() - expected.mass_matrix()).max() < 1e-12 * np.abs(expected.mass_matrix()).max()
    constraints = ConstraintSet(m)
    if len(constraints):
        assert np.abs(ConstraintSet(again).jacobian(found) - constraints.jacobian(expected)).max() < 1e-15


@pytest.mark.parametrize("seed", range(15))
def test_random_trees_read_back(seed):
    m = tree(seed)
    again = from_mjcf(to_mjcf(m))
    assert plain(again) == plain(m)
    q, v = state(m, seed)
    expected = TreeKinematics(m, q, v).mass_matrix()
    assert np.abs(TreeKinematics(again, q, v).mass_matrix() - expected).max() < 1e-12 * np.abs(expected).max()


ORDINARY = """<mujoco model="any thing">
  <compiler eulerseq="zyx"/>
  <option gravity="0 0 -9.8"/>
  <default>
    <joint damping="0.5" armature="0.01"/>
    <geom density="500" rgba="1 0 0 1"/>
    <default class="arm">
      <joint axis="0 1 0" range="-90 90"/><default class="fore"><joint damping="0.1"/></default>
    </default>
  </default>
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="1 1 1"/>
    <body name="upper" pos="0.1 0 1" euler="30 20 10" childclass="arm">
      <joint name="shoulder" pos="0.05 0 0"/>
      <joint name="twist" axis="1 0 0" class="fore" pos="0.05 0.1 0"/>
      <geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.03"/>
      <geom type="ellipsoid" size="0.1 0.05 0.02" pos="0 0.1 0" axisangle="0 1 1 45" mass="0.3"/>
      <body name="lower" pos="0.3 0 0" xyaxes="0 1 0 -1 0 0">
        <joint name="elbow" class="fore" ref="20" pos="0 0.1 0.02"/>
        <inertial pos="0.1 0 0" quat="1 1 0 0" mass="0.7" diaginertia="0.01 0.02 0.015"/>
        <geom type="box" size="0.1 0.02 0.02"/>
        <site name="hand/tip" pos="0.2 0 0"/>
      </body>
    </body>
    <body name="slider" pos="0 1 0.5" zaxis="1 1 0">
      <joint name="slide" type="slide" stiffness="5" springref="0.1"/>
      <geom type="cylinder" size="0.05 0.1"/>
      <body name="bob" pos="0 0 -0.2"><joint name="ball" type="ball"/><geom type="sphere" size="0.04"/></body>
    </body>
    <body name="loose" pos="2 0 0"><freejoint/><geom type="box" size="0.1 0.2 0.3" quat="1 0 0 1"/></body>
  </worldbody>
  <tendon>
    <fixed name="sum"><joint joint="elbow" coef="2"/><joint joint="twist" coef="-0.3333333333333333"/></fixed>
    <spatial name="cable" stiffness="3" springlength="0.2"><site site="hand/tip"/><site site="hand/tip2"/></spatial>
  </tendon>
  <equality>
    <connect body1="lower" body2="loose" anchor="0.1 0.1 0"/>
    <weld body1="slider" body2="loose" anchor="0.1 0 0"/>
    <joint joint1="shoulder" joint2="twist" polycoef="0 2 0 0 0"/>
  </equality>
  <actuator>
    <motor joint="shoulder" gear="50" ctrlrange="-2 2"/><position name="servo" tendon="sum" kp="10" kv="1"/>
  </actuator>
</mujoco>""".replace('<site site="hand/tip2"/>', '<site site="far"/>').replace(
    '<light pos="0 0 3"/>', '<light pos="0 0 3"/><site name="far" pos="0 0 2"/>'
)


def test_ordinary_mjcf_agrees_with_mujoco():
    m = from_mjcf(ORDINARY)
    model = mujoco.MjModel.from_xml_string(ORDINARY)
    data = mujoco.MjData(model)
    q = m.reference()
    v = np.zeros(m.nv)
    rng = np.random.default_rng(0)
    for name in ("shoulder", "twist", "elbow", "slide"):
        x, rate = rng.normal(size=2)
        q[m.q_slice[name]] = x
        v[m.v_slice[name]] = rate
        data.joint(name).qpos = x + model.qpos0[model.joint(name).qposadr[0]]
        data.joint(name).qvel = rate
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    kin = TreeKinematics(m, q, v)
    names = ["shoulder", "twist", "elbow", "slide", "ball"]
    ours = np.concatenate([np.r_[m.v_slice[n]] for n in names])
    theirs = np.concatenate([model.joint(n).dofadr[0] + np.arange(m.joint(n).nv) for n in names])
    expected = mass[np.ix_(theirs, theirs)]
    assert np.abs(kin.mass_matrix()[np.ix_(ours, ours)] - expected).max() < 1e-12 * expected.max()
    assert np.abs(kin.bias_force()[ours] - data.qfrc_bias[theirs]).max() < 1e-12 * np.abs(data.qfrc_bias).max()
    tip = m.frame("hand_tip")
    r, p = kin.pose(tip.body)
    assert np.abs(p + r @ tip.placement.translation - data.site("hand/tip").xpos).max() < 1e-14
    assert m.name == "any_thing"
    assert m.joint("elbow").zero == pytest.approx(np.radians(20))
    assert m.joint("shoulder").range == pytest.approx((-np.pi / 2, np.pi / 2))
    assert m.drives[0].limit == 100.0 and m.drives[1].on == "sum"
    assert [x.kind for x in m.loops] == ["spherical", "fixed"]
    assert str(dict(m.relations[0].coefficients)["twist"]) == "-2"
    assert str(dict(m.shafts[0].coefficients)["twist"]) == "-1/3"
    assert m.springs[0].rest_length == 0.2


def test_ratios_are_exact_again():
    for text in ("5/14", "-17/22", "7", "1/3", "24/84"):
        number = float(eval(text))
        assert float(exact(number)) == number
    assert str(exact(5 / 14)) == "5/14" and str(exact(0.1)) == "1/10" and str(exact(-17 / 22)) == "-17/22"
    assert float(exact(np.pi)) == np.pi


def ordinary(old, new):
    assert old in ORDINARY
    return ORDINARY.replace(old, new)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco", "is not XML"),
        ("<robot/>", "root element is <robot>"),
        ('<mujoco><include file="x"/></mujoco>', "<include>: mechlab does not read"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "declares entities"),
        (ordinary("polycoef=\"0 2 0 0 0\"", 'polycoef="1 2 1 0 0"'), "not assembled"),
        (ordinary("polycoef=\"0 2 0 0 0\"", 'polycoef="1 2 0 0 0"'), "not assembled"),
        (ordinary('joint2="twist"', 'joint2="twirl"'), "joint 'twirl' does not exist. Did you mean 'twist'"),
        (ordinary('name="elbow" class="fore"', 'name="elbow" class="four"'), "default class 'four' does not exist"),
        (ordinary('<motor joint="shoulder"', '<cylinder joint="shoulder"'), "<cylinder>: only motors"),
        (ordinary('<freejoint/>', '<freejoint/><attach model="x"/>'), "<attach>: mechlab does not read"),
        (ordinary('type="box" size="0.1 0.2 0.3"', 'type="mesh" mesh="x"'), "give its body an <inertial>"),
        (ordinary('<motor joint="shoulder"', '<motor joint="elbows"'), "joint 'elbows' does not exist"),
        (ordinary('stiffness="5"', 'stiffness="5 1 0"'), "name='slide'>: stiffness is nonlinear"),
        (ordinary('name="lower"', 'name="lower" gravcomp="1"'), "gravcomp='1' is not read"),
        (ordinary("<option ", '<option density="1.2" '), "density='1.2' is not read"),
    ],
)  # fmt: skip
def test_what_is_not_understood_is_named(text, message):
    with pytest.raises(MechlabError, match=message):
        from_mjcf(text)


def test_forces_of_a_read_model_are_the_same():
    """Motion of the arm under its servos, from its file and from what was read of its file."""
    runs = []
    for m in (arm(), from_mjcf(to_mjcf(arm()))):
        model = mujoco.MjModel.from_xml_string(to_mjcf(m))
        data = mujoco.MjData(model)
        data.ctrl[:] = 0.1
        for _ in range(200):
            mujoco.mj_step(model, data)
        runs.append(data.qpos.copy())
    assert np.abs(runs[0] - runs[1]).max() < 1e-10
