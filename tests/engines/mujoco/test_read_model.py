"""Strangers' MJCF, read from the model that MuJoCo compiles: small files, one for each thing that a reader of the text alone
would miss. MuJoCo's own model of the file is the truth: mass matrix, bias, constraint rows, free acceleration, joint forces of
the actuators at 20 random states (1e-10), and 0.5 s of motion (1e-9), rounding both."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.api.finding import read_file
from mechlab.cli import main
from mechlab.engines.mujoco.model_file.compiled import compiled
from mechlab.engines.mujoco.model_file.coordinates import FileCoordinates
from mechlab.errors import LeftOutWarning, MechlabError
from mechlab.experiment.model_file import ModelFile
from mechlab.formats import from_json, from_mjcf, to_json, to_mjcf
from mechlab.mechanism import ConstraintSet, TreeKinematics
from tests.benchmarks.read_files import Pair

ROD = 'type="capsule" fromto="0 0 0 .3 0 0" size=".02" contype="0" conaffinity="0"'
TETRAHEDRON = "0 0 0  .2 0 0  0 .3 0  0 0 .4"

ARM = f"""<body name="arm"><joint name="q" axis="0 1 0" damping=".1"/><geom {ROD}/>
  <body name="hand" pos=".3 0 0"><joint name="r" axis="0 1 0" damping=".1"/><geom {ROD}/></body></body>"""
"""A double pendulum."""

FOURBAR = f"""<body name="a"><joint name="qa" axis="0 1 0"/><geom {ROD}/>
    <body name="b" pos=".3 0 0"><joint name="qb" axis="0 1 0"/><geom {ROD}/><site name="end" pos=".3 0 GAP"/></body></body>
  <body name="c" pos=".6 0 -.4"><joint name="qc" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 .4" size=".02" contype="0" conaffinity="0"/><site name="top" pos="0 0 .4"/></body>"""


def mjcf(world: str, more: str = "", compiler: str = "") -> str:
    return f'<mujoco model="test"><compiler angle="radian" {compiler}/><worldbody>{world}</worldbody>{more}</mujoco>'


def actuated(actuator: str, compiler: str = "") -> str:
    return mjcf(ARM, f"<actuator>{actuator}</actuator>", compiler)


WHOLE = {
    "defaults": mjcf(
        '<body childclass="k"><joint name="q"/><geom/><body pos="0 0 .2"><joint name="r" class="l"/><geom/></body></body>',
        '<default><default class="k"><joint axis="0 1 0" armature=".01"/><geom size=".1" mass="2" contype="0" conaffinity="0"/>'
        '<default class="l"><joint damping="3"/></default></default></default>',
    ),
    "replicate": mjcf(f'<replicate count="3" offset="0 1 0" euler="0 0 .4"><body name="p">'
                      f'<joint axis="0 1 0"/><geom {ROD}/></body></replicate>'),
    "frame": mjcf(f'<frame pos="1 2 3" euler=".1 .2 .3">{ARM}</frame>'),
    "mesh inertia": mjcf(
        '<body><joint axis="0 1 0"/><geom type="mesh" mesh="m" contype="0" conaffinity="0"/></body>',
        f'<asset><mesh name="m" vertex="{TETRAHEDRON}"/></asset>'),
    "bound on masses": mjcf(ARM, compiler='boundmass="3" boundinertia=".05" settotalmass="7"'),
    "degrees": mjcf(ARM.replace("<joint name", '<joint ref="20" range="-60 80" name')).replace('angle="radian"', 'angle="degree"'),
    "dampratio": actuated('<position joint="q" kp="50" dampratio="1"/>'),
    "gear": actuated('<motor joint="q" gear="25" ctrlrange="-4.5 4.5"/><motor joint="r" gear="-3" ctrlrange="-1 2"/>'),
    "velocity": actuated('<velocity joint="q" kv=".05" ctrlrange="-10 10"/><velocity joint="r" kv=".01" gear="3" forcerange="-.1 .4"/>'),
    "general": actuated('<general joint="q" gear="2" gainprm="50" biastype="affine" biasprm="5 -40 -2" ctrlrange=".2 1"/>'
                        '<general joint="r" gainprm="7" biastype="affine" biasprm="1 0 0"/>'),
    "position": actuated('<position joint="q" kp="20" kv="1" forcerange="-2 3"/><position joint="r" kp="20" inheritrange="1"/>').replace(
        'name="r"', 'name="r" ref=".3" range="-1 2"'),
    "actuatorfrcrange": actuated('<motor joint="r" gear="-5"/>').replace('name="r"', 'name="r" actuatorfrcrange="-1 2"'),
    "rotor": actuated('<motor joint="q" gear="10" armature="1e-4" damping="1e-3"/>'),
    "springs": mjcf(ARM.replace('name="r"', 'name="r" ref=".2" springdamper=".3 .8" springref=".5" frictionloss=".01"')),
    "ball": mjcf('<body pos="0 0 1" euler=".3 .2 .1"><joint name="b" type="ball" range="0 .4" damping=".02"/>'
                 '<geom type="box" size=".1 .2 .3" pos=".1 .2 .3" contype="0" conaffinity="0"/></body>'),
    "free": mjcf('<body pos="0 0 1" euler=".3 .2 .1"><joint name="f" type="free" damping=".2" armature=".1"/>'
                 '<geom type="box" size=".1 .2 .3" pos=".1 .2 .3" contype="0" conaffinity="0"/>'
                 f'<body pos=".1 0 0"><joint axis="1 1 0" pos=".02 .03 .04"/><joint axis="0 1 1" pos=".1 0 0"/><geom {ROD}/></body></body>',
                 '<option integrator="RK4"/>'),
    "gravity off": mjcf(ARM, '<option gravity="1 2 3"><flag gravity="disable"/></option>'),
    "tendon range": mjcf(
        ARM, '<tendon><fixed name="t" limited="true" range="-.1 .05" stiffness="3" springlength=".02"><joint joint="q" coef="1"/>'
        '<joint joint="r" coef="-.5"/></fixed></tendon><actuator><position tendon="t" kp="9" gear="2"/></actuator>'),
    "string": mjcf(
        '<site name="o" pos="0 0 .5"/>' + ARM.replace('<body name="hand"', '<site name="e" pos=".3 0 0"/><body name="hand"'),
        '<tendon><spatial name="s" range="0 .6" damping=".1"><site site="o"/><site site="e"/></spatial></tendon>'),
    "couplings": mjcf(
        ARM + f'<body pos="0 1 0"><joint name="s" axis="0 1 0"/><geom {ROD}/></body>',
        '<tendon><fixed name="t"><joint joint="s" coef="2"/></fixed></tendon>'
        '<equality><joint joint1="q" joint2="r" polycoef="0 -2 0 0 0"/></equality>'),
    "weld and connect": mjcf(
        f'<body name="base" pos="0 0 1"><freejoint/><geom {ROD}/></body><body name="ground" pos="0 0 1" mocap="true"/>'
        f'<body name="p" pos="0 1 0"><joint axis="0 1 0"/><geom {ROD}/></body><body name="s" pos=".3 1 0"><freejoint/><geom {ROD}/></body>',
        '<equality><weld body1="ground" body2="base"/><connect body1="p" body2="s" anchor=".3 0 0"/></equality>'),
    "open by 1e-7": mjcf(FOURBAR.replace("GAP", "1e-7"), '<equality><connect site1="end" site2="top"/></equality>'),
}  # fmt: skip


def read(text: str, folder: Path) -> tuple[ModelFile, mujoco.MjModel]:
    path = written(text, folder)
    return read_file(path), compiled(path)


def written(text: str, folder: Path) -> Path:
    path = folder / "model.xml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("cause", WHOLE)
def test_what_is_read_with_nothing_lost_is_the_files_own_mechanics(cause: str, tmp_path: Path) -> None:
    """Motion of an open loop starts in the closed pose, from rest; a coupling of joints is written as one of tendons, whose
    softness MuJoCo estimates with another weight: its motion is left out."""
    file, model = read(WHOLE[cause], tmp_path)
    assert file.lost == ()
    pair = Pair(model, file)
    worst = pair.differences(np.random.default_rng(3))
    assert max(worst.values()) < 1e-10, worst
    if cause != "couplings":
        assert pair.motion(np.random.default_rng(4)) < 1e-9


def test_an_include_is_read_beside_its_file(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(f"<mujocoinclude>{ARM}</mujocoinclude>")
    file, model = read(mjcf('<include file="part.xml"/>'), tmp_path)
    assert [j.name for j in file.mechanism.joints] == ["q", "r"] and not file.remarks
    assert max(Pair(model, file).differences(np.random.default_rng(3)).values()) < 1e-10


def test_a_loop_open_by_a_tenth_of_a_micrometre_is_closed_and_said(tmp_path: Path) -> None:
    """The reference pose moves by about the gap; the file's coordinates of it are kept, and close the file's own loop."""
    file, model = read(WHOLE["open by 1e-7"], tmp_path)
    assert any("is open by 1e-07 in the pose of the file" in note for note in file.notes)
    data = mujoco.MjData(model)
    gaps = []
    for qpos in (model.qpos0, np.array(file.reference)):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        gaps.append(float(np.linalg.norm(data.site("end").xpos - data.site("top").xpos)))
    assert gaps[0] == pytest.approx(1e-7, rel=1e-6) and gaps[1] < 1e-13
    assert 0.0 < np.max(np.abs(np.array(file.reference) - model.qpos0)) < 1e-5


def test_the_control_keeps_the_units_of_the_file(tmp_path: Path) -> None:
    """A gear of 25 and the gain of a velocity servo are not folded away: in the model that is written the same control gives the
    same force, and reading it again, and its JSON, give the same drives."""
    file, _ = read(actuated('<motor joint="q" gear="25" ctrlrange="-4.5 4.5"/><velocity joint="r" kv="5" ctrlrange="-10 10"/>'), tmp_path)
    motor, servo = file.mechanism.drives
    assert motor.control is not None and servo.control is not None
    assert (motor.control.gear, motor.control.range, motor.limit) == (25.0, (-4.5, 4.5), 112.5)
    assert (servo.control.gain, servo.damping, servo.control.range) == (5.0, 5.0, (-10.0, 10.0))
    text = to_mjcf(file.mechanism)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.ctrl[:] = 2.0, 20.0  # the second beyond its range
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator.tolist() == [50.0, 50.0]
    assert from_mjcf(text).drives == from_json(to_json(file.mechanism)).drives == file.mechanism.drives


def test_a_plain_dc_motor_is_a_winding(tmp_path: Path) -> None:
    file, _ = read(actuated('<dcmotor joint="q" gear="3" motorconst="2" resistance="1.5" inductance=".1"/>'), tmp_path)
    winding = file.mechanism.drives[0].winding
    assert winding is not None and not file.lost
    assert (winding.constant, winding.resistance) == (6.0, 1.5) and winding.inductance == pytest.approx(0.1, rel=1e-15)


LOST = {
    "fluid": (mjcf(ARM, '<option density="1.2"/>'), "fluid", ("density",)),
    "gravcomp": (mjcf(ARM.replace('name="hand"', 'name="hand" gravcomp="1"')), "gravcomp", ("hand",)),
    "lag": (actuated('<position name="p" joint="q" kp="9" timeconst=".1"/>'), "activation of an actuator", ("p",)),
    "muscle": (actuated('<muscle name="m" joint="q" lengthrange="0 1"/>'), "actuator", ("m",)),
    "locked": (mjcf(ARM.replace('name="q" axis="0 1 0"', 'name="q" type="ball" limited="true"')), "joint range", ("q",)),
    "curved coupling": (mjcf(ARM, '<tendon><fixed name="t"><joint joint="q" coef="1"/></fixed><fixed name="u"><joint joint="r" coef="1"/>'
                             '</fixed></tendon><equality><tendon name="c" tendon1="t" tendon2="u" polycoef="0 1 1 0 0"/></equality>'),
                        "tendon equality", ("c",)),
    "sum of actuators": (mjcf(ARM.replace('name="q"', 'name="q" actuatorfrcrange="-1 1"'),
                              '<actuator><motor joint="q"/><motor joint="q"/></actuator>'), "actuatorfrcrange", ("q",)),
}  # fmt: skip


@pytest.mark.parametrize("cause", LOST)
def test_lost_mechanics_is_named(cause: str, tmp_path: Path) -> None:
    text, what, names = LOST[cause]
    file, _ = read(text, tmp_path)
    assert [(x.what, x.names) for x in file.lost] == [(what, names)]


def test_a_polynomial_of_two_joints_is_a_curve(tmp_path: Path) -> None:
    """Its rows are those of MuJoCo itself, efc_pos and efc_J, also away from the pose of the file."""
    coupled = '<equality><joint name="c" joint1="q" joint2="r" polycoef="0 0.5 1 -0.3 0.2"/></equality>'
    file, _ = read(mjcf(ARM.replace('name="r"', 'name="r" ref="0.4"'), coupled), tmp_path)
    m = file.mechanism
    assert not file.lost and [(x.name, x.output, x.input) for x in m.curves] == [("c", "q", "r")]
    model = mujoco.MjModel.from_xml_path(str(file.path))
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0 + np.array([0.3, -0.8])
    mujoco.mj_fwdPosition(model, data)
    constraints, tree = ConstraintSet(m), TreeKinematics(m, np.array([0.3, -0.8]))
    np.testing.assert_allclose(constraints.residual(tree), data.efc_pos[: data.ne], atol=1e-15)
    np.testing.assert_allclose(constraints.jacobian(tree).ravel(), data.efc_J[: data.ne * model.nv], atol=1e-15)


KEPT = f"""<mujoco model="kept"><asset><mesh name="m" vertex="{TETRAHEDRON}"/><material name="red"/></asset>
<worldbody><geom name="floor" type="plane" size="1 1 1"/><light name="sun"/><camera name="eye"/>
  <body name="p" pos="0 0 1"><joint name="q"/><geom name="ball" size=".1"/><geom name="part" type="mesh" mesh="m"/>
    <site name="s"/></body></worldbody>
<contact><exclude name="e" body1="world" body2="p"/></contact>
<sensor><gyro name="g" site="s"/></sensor><keyframe><key name="home" qpos="1"/></keyframe></mujoco>"""


def test_contacts_drawings_sensors_and_keyframes_are_named_in_python_and_in_verbs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "kept.xml"
    path.write_text(KEPT)
    file = read_file(path)
    assert file.lost == () and all(x.kept for x in file.left_out)
    names = {x.what: x.names for x in file.left_out}
    assert names["contact"] == ("floor", "ball", "part") and not {"mesh", "plane"} & set(names)
    assert [names[k] for k in ("exclude", "sensor", "keyframe", "light", "camera", "material")] == [
        ("e",), ("g",), ("home",), ("sun",), ("eye",), ("red",)]  # fmt: skip
    with pytest.warns(LeftOutWarning, match="contact"):
        ml.load(path)
    assert main(["show", str(path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {x["what"] for x in document["left_out"]} == set(names)


def test_names_and_states_go_over_and_back(tmp_path: Path) -> None:
    """Names that a Mechanism does not allow are changed and said; elements without a name have numbers; states of ball, free
    and scalar joints convert to the mechanism and back."""
    world = mjcf(
        f'<body name="a b" pos="1 2 3" euler=".1 .2 .3"><freejoint name="root"/><geom {ROD}/>'
        f'<body pos="0 0 .1"><joint type="ball"/><geom {ROD}/><body><joint name="x:1" ref=".3"/><geom {ROD}/></body></body></body>'
    )
    file, model = read(world, tmp_path)
    assert file.joints == {"root": ("root_x", "root_y", "root_z", "root_turn"), "#1": ("joint_2",), "x:1": ("x_1",)}
    assert file.bodies["a b"] == "a_b" and any("'a b' is 'a_b'" in n and "'x:1' is 'x_1'" in n for n in file.notes)
    coordinates = FileCoordinates(file, model)
    rng = np.random.default_rng(5)
    qpos, qvel = np.array(model.qpos0), rng.normal(size=model.nv)
    mujoco.mj_integratePos(model, qpos, rng.normal(size=model.nv), 1.0)
    there = coordinates.to_file(*coordinates.to_mechanism(qpos, qvel))
    assert there[0] == pytest.approx(qpos, abs=1e-15) and there[1].tolist() == qvel.tolist()
    other = mujoco.MjModel.from_xml_string(mjcf(ARM))
    with pytest.raises(MechlabError, match="has other joints"):
        FileCoordinates(file, other)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (mjcf("<body/>"), "nothing moves"),
        (mjcf('<include file="none.xml"/>'), "MuJoCo refuses model.xml"),
        (mjcf(ARM).replace("capsule", "capsul"), "MuJoCo refuses model.xml.*capsul"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(MechlabError, match=words):
        read(text, tmp_path)


def test_a_mesh_that_is_missing_is_named_where_the_body_does_not_need_it(tmp_path: Path) -> None:
    """With an <inertial> the mesh only draws; without one MuJoCo's refusal stands."""
    asset = '<asset><mesh name="m" file="none.stl"/></asset>'
    inertial = '<inertial pos=".1 0 0" mass="1" diaginertia=".1 .2 .2"/>'
    body = '<body><joint name="q"/>{}<frame pos="0 0 1"><geom type="mesh" mesh="m"/></frame></body>'
    file = read_file(written(mjcf(body.format(inertial), asset), tmp_path))
    assert not file.lost and "the meshes m cannot be loaded" in file.notes[0] and "none.stl" in file.notes[0]
    assert file.mechanism.bodies[0].inertia.tensor[:3] == (0.1, 0.2, 0.2)
    with pytest.raises(MechlabError, match="MuJoCo refuses model.xml.*none.stl"):
        read_file(written(mjcf(body.format(""), asset), tmp_path))
