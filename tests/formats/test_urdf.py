"""URDF: Pinocchio, yourdfpy, MuJoCo load it and agree with the mechanism; mimics do not contradict; it reads back."""

import math
from dataclasses import replace
from fractions import Fraction

import mujoco
import numpy as np
import pytest
from mechanism_zoo import ALL, arm, fourbar, planetary, state, tree

from mechlab.errors import MechlabError
from mechlab.formats import from_urdf, to_urdf, urdf_map
from mechlab.formats.urdf import mimics, roll_pitch_yaw
from mechlab.mechanism import Builder, Inertia, Placement, TreeKinematics, mimic, revolute
from mechlab.mechanism.geometry import axis_rotation, matrix_to_quaternion

X, Y, Z = np.eye(3)


def values(m, seed):
    """Random URDF joint values, and the coordinates of the mechanism that they mean."""
    rng = np.random.default_rng(seed)
    names, q, by_name = urdf_map(m), m.reference(), {}
    for joint in m.joints:
        x = rng.normal(size=joint.nv)
        by_name |= dict(zip(names.joints[joint.name], x.tolist(), strict=True))
        turned = axis_rotation(X, x[0]) @ axis_rotation(Y, x[-2]) @ axis_rotation(Z, x[-1]) if joint.nv == 3 else None
        q[m.q_slice[joint.name]] = x if turned is None else matrix_to_quaternion(turned)
    return by_name, q


@pytest.mark.parametrize("seed", range(12))
def test_poses_in_pinocchio(seed):
    pin = pytest.importorskip("pinocchio")
    m = tree(seed)
    by_name, q = values(m, seed)
    model = pin.buildModelFromXML(to_urdf(m))
    assert model.nq == model.nv == m.nv
    data, x = model.createData(), np.zeros(model.nq)
    for name, value in by_name.items():
        x[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, x)
    kin = TreeKinematics(m, q)
    for body, link in list(urdf_map(m).bodies.items())[1:]:
        assert np.abs(data.oMf[model.getFrameId(link)].homogeneous - kin.matrix(body)).max() < 1e-13


@pytest.mark.parametrize("seed", range(12))
def test_poses_in_mujoco_and_yourdfpy(seed, tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy")
    m = tree(seed)
    by_name, q = values(m, seed)
    path = tmp_path / "tree.urdf"
    path.write_text(to_urdf(m), encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for name, value in by_name.items():
        data.joint(name).qpos = value
    mujoco.mj_kinematics(model, data)
    robot = yourdfpy.URDF.load(str(path), load_meshes=False)
    robot.update_cfg(by_name)
    kin = TreeKinematics(m, q)
    for body, link in list(urdf_map(m).bodies.items())[1:]:
        assert np.abs(data.body(link).xpos - kin.pose(body)[1]).max() < 1e-13
        assert np.abs(robot.get_transform(link, "base") - kin.matrix(body)).max() < 1e-13


def test_mass_matrix_in_pinocchio():
    pin = pytest.importorskip("pinocchio")
    m = tree(2, kinds=("revolute", "prismatic"), shafts=False, armature=False)
    q, _ = state(m, 2)
    model = pin.buildModelFromXML(to_urdf(m))
    order = [model.joints[model.getJointId(j.name)].idx_v for j in m.joints]
    x = np.zeros(model.nq)
    x[order] = q
    upper = np.triu(pin.crba(model, model.createData(), x))
    mass = (upper + np.triu(upper, 1).T)[np.ix_(order, order)]
    expected = TreeKinematics(m, q).mass_matrix()
    assert np.abs(mass - expected).max() < 1e-11 * np.abs(expected).max()


def test_angles_are_exact_near_the_gimbal():
    rng = np.random.default_rng(0)
    for k in range(3000):
        near = math.copysign(math.pi / 2, rng.normal()) + 10 ** rng.uniform(-17, -1)
        pitch = near if k % 2 else rng.uniform(-1.5, 1.5)
        a, b = rng.uniform(-3, 3, 2)
        placed = Placement.of(axis_rotation(Z, a) @ axis_rotation(Y, pitch) @ axis_rotation(X, b), (0, 0, 0))
        roll, pitch, yaw = roll_pitch_yaw(placed)
        again = axis_rotation(Z, yaw) @ axis_rotation(Y, pitch) @ axis_rotation(X, roll)
        assert np.abs(again - placed.rotation).max() < 3e-15


def chain():
    b = Builder("belts")
    for k in range(4):
        b.body(f"p{k}", revolute(f"p{k}"), at=(k, 0, 0), inertia=Inertia.cylinder(1, 0.1, 0.1))
    b.mesh(mimic("m1", "p1", "p0", 2)).mesh(mimic("m2", "p2", "p3", "1/3")).mesh(mimic("m3", "p2", "p1", -1))
    b.mesh(mimic("again", "p2", "p0", -2))
    b.drive("p3")
    return b.build()


def test_mimics_name_one_independent_leader():
    m = chain()
    found = mimics(m)
    assert {n: f.leader for n, f in found.items()} == {"p0": "p3", "p1": "p3", "p2": "p3"}
    ratios = {n: f.ratio for n, f in found.items()} | {"p3": Fraction(1)}
    for relation in m.relations:
        assert sum(c * ratios[n] for n, c in relation.coefficients) == 0


def test_mujoco_honours_the_mimics():
    model = mujoco.MjModel.from_xml_string(to_urdf(chain()))
    assert model.neq == 3


def test_relations_of_three_joints_are_only_in_the_sidecar():
    m = planetary()
    assert "<mimic" not in to_urdf(m)
    assert set(urdf_map(m).to_dict(m)["not_in_urdf"]) == {r.name for r in m.relations}


@pytest.mark.parametrize("seed", range(8))
def test_reads_back(seed):
    m = tree(seed, kinds=("revolute", "prismatic"), shafts=False, armature=False)
    again = from_urdf(to_urdf(m))
    assert [j.name for j in again.joints] == [j.name for j in m.joints]
    assert [f.name for f in again.frames] == ["tip"]
    q, _ = state(m, seed)
    expected = TreeKinematics(m, q).mass_matrix()
    assert np.abs(TreeKinematics(again, q).mass_matrix() - expected).max() < 1e-12 * np.abs(expected).max()
    assert TreeKinematics(again, q).pose(m.bodies[-1].name)[1] == pytest.approx(
        TreeKinematics(m, q).pose(m.bodies[-1].name)[1]
    )
    assert {j.range for j in again.joints if j.kind == "prismatic"} <= {None}


def test_relations_read_back_as_mimics():
    again = from_urdf(to_urdf(chain()))
    assert {r.coefficients for r in again.relations} == {
        (("p0", Fraction(1)), ("p3", Fraction(1, 6))),
        (("p1", Fraction(1)), ("p3", Fraction(1, 3))),
        (("p2", Fraction(1)), ("p3", Fraction(-1, 3))),
    }


ROBOT = """<robot name="hand"><link name="palm"/><link name="a"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="ja" type="continuous"><parent link="palm"/><child link="a"/><axis xyz="0 0 2"/></joint>
<joint name="jb" type="TYPE"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>
<mimic joint="ja" multiplier="-0.5" offset="0.25"/></joint></robot>"""


def test_an_offset_of_a_mimic_is_in_the_reference_pose():
    m = from_urdf(ROBOT.replace("TYPE", "revolute"))
    assert m.joint("jb").zero == 0.25 and m.joint("jb").range == (-1, 1)
    assert m.relations[0].coefficients == (("jb", Fraction(1)), ("ja", Fraction(1, 2)))
    expected = axis_rotation(Z, 0.25)
    assert np.abs(TreeKinematics(m).pose("b")[0] - expected).max() < 1e-15
    slid = from_urdf(ROBOT.replace("TYPE", "prismatic"))
    assert TreeKinematics(slid).pose("b")[1].tolist() == [1.0, 0.0, 0.25]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("TYPE", "planar"), "joint name='jb'.*'planar' are not read"),
        (('child link="b"', 'child link="a"'), "parent and its child are the same link 'a'"),
        (('parent link="a"', 'parent link="b"'), "parent and its child are the same link 'b'"),
        (('link name="b"', 'link name="a"'), "two links of this name"),
        (('joint name="jb"', 'joint name="ja"'), "two joints of this name"),
        (('parent link="a"', 'parent link="c"'), "parent link 'c' does not exist"),
        (('parent link="palm"', 'parent link="b"'), "2: palm|exactly one root|cycle"),
        (('mimic joint="ja"', 'mimic joint="jx"'), "mimic joint 'jx' does not exist"),
        (('mimic joint="ja"', 'mimic joint="jb"'), "mimics form a cycle"),
        (('xyz="0 0 2"', 'xyz="0 0"'), "has 2 numbers, expected 3"),
        (("<robot", "<model"), "is not XML"),
        (('mass value="1"', 'mass value="one"'), "is not a list of numbers"),
    ],
)
def test_errors_of_the_reader(change, message):
    with pytest.raises(MechlabError, match=message):
        from_urdf(ROBOT.replace(*change).replace("TYPE", "revolute"))


def test_wrong_root_is_named():
    with pytest.raises(MechlabError, match="root element is <mujoco>"):
        from_urdf("<mujoco/>")


@pytest.mark.parametrize("name", ALL)
def test_the_same_byte_for_byte(name):
    assert to_urdf(ALL[name]()) == to_urdf(ALL[name]())


def test_limits_and_efforts():
    text = to_urdf(replace(arm(), drives=(replace(arm().drives[1], limit=7.0),)))
    assert 'effort="7"' in text and 'lower="-1.3"' in text
    assert 'lower="-1000000000"' in to_urdf(fourbar()) and "continuous" not in to_urdf(fourbar())
