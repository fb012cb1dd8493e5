"""URDF with loops: each dialect gives the four-bar that is built by hand; open poses are assembled and said; nothing is silent."""

import json
import math
import warnings

import numpy as np
import pytest

import mechlab as ml
from mechlab.api.finding import read_file
from mechlab.cli import main
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.formats import from_urdf, write_files
from mechlab.formats.exports import to_extended_urdf
from mechlab.formats.urdf_closing_rows import closing_rows
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Placement, TreeKinematics, close, revolute
from mechlab.mechanism.structure import sample_poses, structure

GROUND, CRANK, COUPLER, ROCKER = 0.4, 0.1, 0.35, 0.25
"""Lengths [m] of the four-bar of these tests: a crank-rocker."""


def angles(crank):
    """Angles of coupler and rocker of the open four-bar, to the ground, by the cosine rule."""
    x, y = CRANK * math.cos(crank) - GROUND, CRANK * math.sin(crank)
    d = math.hypot(x, y)
    to_pin = math.atan2(y, x)
    rocker = to_pin - math.acos((ROCKER**2 + d**2 - COUPLER**2) / (2 * ROCKER * d))
    px, py = GROUND + ROCKER * math.cos(rocker), ROCKER * math.sin(rocker)
    return math.atan2(py - CRANK * math.sin(crank), px - CRANK * math.cos(crank)), rocker


THETA = 1.0
PHI, PSI = angles(THETA)


def link(name, mass=0.5):
    inertia = "".join(f' i{k}="{v}"' for k, v in (("xx", 1e-3), ("yy", 1e-3), ("zz", 1e-3), ("xy", 0), ("xz", 0), ("yz", 0)))
    return f'<link name="{name}"><inertial><mass value="{mass}"/><inertia{inertia}/></inertial></link>'


def joint(name, parent, child, x, angle, kind="continuous", axis="0 0 1"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{x!r} 0 0" rpy="0 0 {angle!r}"/><axis xyz="{axis}"/></joint>'
    )


def fourbar(extra="", closed=True):
    """The tree of the four-bar: crank, coupler, and rocker on the ground; in its zero pose closed, or folded on x."""
    at = (THETA, PHI - THETA, PSI) if closed else (0.0, 0.0, 0.0)
    return (
        '<robot name="bars"><link name="base_link"/>' + link("crank") + link("coupler") + link("rocker")
        + joint("j_crank", "base_link", "crank", 0.0, at[0]) + joint("j_coupler", "crank", "coupler", CRANK, at[1])
        + joint("j_rocker", "base_link", "rocker", GROUND, at[2]) + extra + "</robot>"
    )  # fmt: skip


def marks(a="pin_A", b="pin_B"):
    """Two frames at the pin between coupler and rocker."""
    return (
        f'<link name="{a}"/><link name="{b}"/>' + joint("at_a", "coupler", a, COUPLER, 0.0, "fixed")
        + joint("at_b", "rocker", b, ROCKER, 0.0, "fixed")
    )  # fmt: skip


ENDS = f'<{{0}} link="coupler" xyz="{COUPLER} 0 0" rpy="0 0 0"/><{{1}} link="rocker" xyz="{ROCKER} 0 0" rpy="0 0 0"/>'
PIN = (GROUND + ROCKER * math.cos(PSI), ROCKER * math.sin(PSI))
DIALECTS = {
    "second parent": joint("pin", "coupler", "rocker_end", COUPLER, 0.0) + '<link name="rocker_end"/>'
    + joint("weld", "rocker", "rocker_end", ROCKER, 0.0, "fixed"),
    "loop_joint": f'<loop_joint name="pin" type="revolute">{ENDS.format("link1", "link2")}<axis xyz="0 0 1"/></loop_joint>',
    "loop_joint, both ends link1": f'<loop_joint name="pin" type="spherical">{ENDS.format("link1", "link1")}</loop_joint>',
    "loop": f'<loop name="pin" type="continuous"><predecessor link="coupler"><origin xyz="{COUPLER} 0 0"/></predecessor>'
    f'<successor link="rocker"><origin xyz="{ROCKER} 0 0"/></successor><axis xyz="0 0 1"/></loop>',
    "constraint": '<constraint name="pin" type="revolute"><parent link="coupler"/>'
    f'<parent_origin xyz="{COUPLER} 0 0"/><parent_axis xyz="0 0 1"/><child link="rocker"/><child_origin xyz="{ROCKER} 0 0"/>'
    '<child_axis xyz="0 0 1"/></constraint>',
    "gazebo": f'<gazebo><joint name="pin" type="revolute"><parent>coupler</parent><child>rocker</child><pose>{ROCKER} 0 0 0 0 0</pose>'
    "<axis><xyz>0 0 1</xyz></axis></joint></gazebo>",
    "closing frames": marks("closing_pin_1", "closing_pin_2"),
}  # fmt: skip


def travel(m):
    """Rocker angle over a quarter turn of the crank, by numpy."""
    out = []
    for crank in np.linspace(THETA, THETA + 1.5, 5):
        found = close(m, None, {"j_crank": m.zero("j_crank") + crank - THETA}, steps=8)
        assert found.closed
        out.append(TreeKinematics(m, found.q).pose("rocker")[0])
    return [math.atan2(r[1, 0], r[0, 0]) for r in out]


EXPECTED = [angles(c)[1] for c in np.linspace(THETA, THETA + 1.5, 5)]


@pytest.mark.parametrize("dialect", DIALECTS)
def test_each_dialect_moves_as_the_cosine_rule_says(dialect):
    m = from_urdf(fourbar(DIALECTS[dialect]))
    assert len(m.loops) == 1 and structure(m).freedoms == 1
    # Newton stops at 1e-13; the angle follows within the condition of the pose
    assert np.abs(np.array(travel(m)) - EXPECTED).max() < 1e-11


def closed_by(tmp_path, text, **files):
    path = tmp_path / "bars.urdf"
    path.write_text(text)
    for name, content in files.items():
        (tmp_path / name.replace("__", ".")).write_text(content)
    return path


EXTENDED = "closed_loop: [['pin_A', 'pin_B']]\ntype: ['3d']\nname_mot: ['j_crank']\n"


@pytest.mark.parametrize("name", ["bars__yaml", "robot__yaml", "other__yml"])
def test_a_yaml_beside_it_is_read_and_said(tmp_path, name):
    file = read_file(closed_by(tmp_path, fourbar(marks()), **{name: EXTENDED}))
    m = file.mechanism
    assert [(x.kind, x.body_a, x.body_b) for x in m.loops] == [("spherical", "coupler", "rocker")]
    assert [d.name for d in m.drives] == ["j_crank"]
    assert any(name.replace("__", ".") in note and "pin (spherical)" in note for note in file.notes)
    assert np.abs(np.array(travel(m)) - EXPECTED).max() < 1e-11


def test_the_doctor_does_not_count_the_freedoms_of_the_tree_that_mujoco_reads_against_the_loops(tmp_path):
    found = ml.doctor(closed_by(tmp_path, fourbar(marks()), robot__yaml=EXTENDED))
    assert (found.freedoms, found.loops) == (1, 1)
    assert "freedoms_differ" not in {f.name for f in found.findings}


def test_loop_closures_of_the_relay(tmp_path):
    point = f"point: [{PIN[0]!r}, {PIN[1]!r}, 0.0], axis: [0, 0, 1]"
    relay = f"closures:\n- {{link_a: coupler, link_b: rocker, {point}}}\nindependent: [j_crank]\n"
    (tmp_path / "config").mkdir()
    path = closed_by(tmp_path, fourbar())
    (tmp_path / "config" / "loop_closures.yaml").write_text(relay)
    m = read_file(path).mechanism
    assert m.loops[0].kind == "revolute"
    # the point is written with 17 digits, its ends are placed by the inverse pose
    assert np.abs(np.array(travel(m)) - EXPECTED).max() < 1e-11


def test_an_open_pose_is_assembled_and_the_branch_is_said(tmp_path):
    file = read_file(closed_by(tmp_path, fourbar(marks(), closed=False), robot__yaml=EXTENDED))
    m = file.mechanism
    residual = ConstraintSet(m).residual(TreeKinematics(m))
    assert np.abs(residual).max() < 1e-12
    words = " ".join(file.notes)
    assert "open in the zero pose by 0.2 (pin.x [m])" in words and "branch of pin: of " in words  # 0.45 - 0.65 m on one line
    moved = {j.name: j.zero for j in m.joints}
    d = math.hypot(CRANK * math.cos(moved["j_crank"]) - GROUND, CRANK * math.sin(moved["j_crank"]))
    between = math.acos((ROCKER**2 + COUPLER**2 - d**2) / (2 * ROCKER * COUPLER))  # the cosine rule at the pin
    at_pin = moved["j_rocker"] - moved["j_crank"] - moved["j_coupler"]
    assert math.cos(at_pin) == pytest.approx(math.cos(between), abs=1e-11)


def test_a_weld_is_not_closed_at_a_half_turn(tmp_path):
    """The rows of a weld, sines between axes, vanish at half turns, too; frames 3 rad apart would end there."""
    eye = link("eye", 0.01) + joint("j_eye", "rocker", "eye", ROCKER, 0.0)
    text = fourbar(eye + '<link name="pin_A"/>' + joint("at_a", "coupler", "pin_A", COUPLER, 3.0, "fixed"))
    m = read_file(closed_by(tmp_path, text, robot__yaml="closed_loop: [[pin_A, eye]]\ntype: [6d]\n")).mechanism
    (loop,), kin = m.loops, TreeKinematics(m)
    ends = [kin.pose(b)[0] @ p.rotation for b, p in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b))]
    assert loop.kind == "fixed" and np.abs(ends[0] - ends[1]).max() < 1e-12


def test_frames_on_a_link_that_becomes_a_loop_are_kept_or_named(tmp_path):
    """A frame on the filler link of a pin stands on the other side of the pin; one between two joints of it stands on no body."""
    eye = '<link name="slider"/><link name="eye"/>' + joint("j_slider", "rocker", "slider", ROCKER, 0.0, "prismatic")
    eye += joint("j_eye", "slider", "eye", 0.0, 0.0) + '<link name="pin_A"/>' + joint("at_a", "coupler", "pin_A", COUPLER, 0.3, "fixed")
    eye += '<link name="between"/>' + joint("at_slider", "slider", "between", 0.0, 0.0, "fixed")
    eye += '<link name="marker"/>' + joint("at_eye", "eye", "marker", 0.03, 0.0, "fixed")
    file = read_file(closed_by(tmp_path, fourbar(eye), robot__yaml="closed_loop: [[pin_A, eye]]\ntype: [6d]\n"))
    m = file.mechanism
    assert [x.kind for x in m.loops] == ["cylindrical"] and [b.name for b in m.bodies] == ["crank", "coupler", "rocker"]
    assert {x.what: x.names for x in file.left_out}["frame"] == ("between",)
    rotation, origin = TreeKinematics(m).pose(m.frame("marker").body)
    there = (PIN[0] + 0.03 * math.cos(PHI + 0.3), PIN[1] + 0.03 * math.sin(PHI + 0.3), 0.0)
    assert rotation @ m.frame("marker").placement.translation + origin == pytest.approx(there, abs=1e-12)


@pytest.mark.parametrize(
    ("yaml", "message"),
    [
        ("closed_loop: [[pin_A, pin_C]]\ntype: [3d]\n", "robot.yaml beside it closes loops of other links: pin_C is not"),
        ("closed_loop: [[pin_A, pin_B]]\ntype: [3d, 3d]\n", "closed_loop has 1 entries, type 2"),
        ("closed_loop: [[pin_A, pin_B]]\ntype: [5d]\n", "robot.yaml: type '5d' does not exist"),
        ("closed_loop: pin_A\n", "must be a list of pairs"),
        ("closed_loop: [[pin_A, pin_B]\n", "robot.yaml, line 2: this is not YAML"),
        ("closed_loop: &a [[pin_A, pin_B]]\nx: *a\n", "aliases"),
        ("closed_loop: [[pin_A, pin_B]]\njoint_name: [j_crank]\njoint_type: [BALL]\n", "joint_type of j_crank 'BALL' does not exist"),
        ("closed_loop: [[pin_A, pin_B]]\njoint_name: [j_crank]\n", "joint_name has 1 entries, joint_type 0"),
        ("closures: [{link_a: coupler}]\n", "link_b must be the name of a link"),
    ],
)
def test_faults_of_the_yaml_are_named(tmp_path, yaml, message):
    with pytest.raises(MechlabError, match=message):
        read_file(closed_by(tmp_path, fourbar(marks()), robot__yaml=yaml))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0 0 0 0 0</pose>", "0 0 0 0 up</pose>", "<joint name='pin'>: pose='.*up' is not a list of numbers"),
        ("0 0 0 0 0</pose>", "0 0</pose>", "<joint name='pin'>: pose='.*' has 3 numbers, expected 6"),
        ("<xyz>0 0 1</xyz>", "<xyz>0 0 z</xyz>", "<joint name='pin'>: axis/xyz='0 0 z' is not a list of numbers"),
    ],
)
def test_numbers_of_an_sdf_joint_that_are_none_are_named(old, new, message):
    assert old in DIALECTS["gazebo"]
    with pytest.raises(MechlabError, match=message):
        from_urdf(fourbar(DIALECTS["gazebo"].replace(old, new)))


def test_loops_that_cannot_close_are_refused_by_name(tmp_path):
    short = fourbar(marks()).replace(f'xyz="{ROCKER!r} 0 0"', 'xyz="0.01 0 0"').replace(f'xyz="{COUPLER!r} 0 0"', 'xyz="0.02 0 0"')
    with pytest.raises(MechlabError, match="pin does not even close alone: its 3 rows over the joints j_crank, j_coupler, j_rocker"):
        read_file(closed_by(tmp_path, short, robot__yaml=EXTENDED))


def test_names_that_suggest_a_loop_are_told_what_to_add(tmp_path):
    file = read_file(closed_by(tmp_path, fourbar(marks("closedloop1_A", "closedloop1_B"))))
    assert not file.mechanism.loops
    told = next(n for n in file.notes if "this looks like a loop" in n)
    assert "closed_loop: [[closedloop1_A, closedloop1_B]]" in told
    (tmp_path / "bars.yaml").write_text("closed_loop: [[closedloop1_A, closedloop1_B]]\ntype: [3d]\n")
    again = read_file(tmp_path / "bars.urdf")
    assert len(again.mechanism.loops) == 1 and not any("looks like" in n for n in again.notes)


def test_joints_of_another_type(tmp_path):
    yaml = EXTENDED + "joint_name: [j_coupler, j_rocker, j_gone]\njoint_type: [SPHERICAL, UJOINT_ZY, FIXED]\n"
    file = read_file(closed_by(tmp_path, fourbar(marks()), robot__yaml=yaml))
    kinds = {b.name: [(j.name, j.kind) for j in b.joints] for b in file.mechanism.bodies}
    assert kinds["coupler"] == [("j_coupler", "spherical")]
    assert kinds["rocker"] == [("j_rocker_Z", "revolute"), ("j_rocker_Y", "revolute")]
    assert [x.names for x in file.left_out] == [("j_gone",)]


def test_ball_joints_that_a_yaml_forgets(tmp_path):
    """The closed pose needs a coupler out of the plane: with its revolute joint the loop stays open."""
    tilted = marks().replace(f'<origin xyz="{ROCKER!r} 0 0"', f'<origin xyz="{ROCKER!r} 0 0.05"')
    text = fourbar(tilted).replace("j_coupler", "spherical_coupler")
    file = read_file(closed_by(tmp_path, text, robot__yaml=EXTENDED))
    assert file.mechanism.joint("spherical_coupler").kind == "spherical"
    assert any("joint_name: [spherical_coupler]" in n for n in file.notes)


# -- written and read back -----------------------------------------------------------------------------------------------


def chain_with(kind):
    """A crank and a rocker, closed by a loop of this kind with its ends turned against each other in the reference pose."""
    b = Builder("pair")
    heavy = Inertia.cylinder(1.0, 0.05, 0.2)
    b.body("left", revolute("a", "z"), inertia=heavy)
    b.body("right", revolute("b", "y"), revolute("c", "x"), at=(0.3, 0, 0), inertia=heavy)
    b.body("elbow", revolute("d", "z"), revolute("e", "y"), parent="right", at=(-0.05, 0.01, 0.1), inertia=heavy)
    b.body("tip", revolute("f", "x"), revolute("g", "z"), parent="elbow", at=(-0.05, 0.01, -0.1), inertia=heavy)
    b.drive("a")
    at_a, at_b = Placement((0.2, 0.02, 0.0)), Placement()
    if kind == "universal":  # x of a and y of b are at right angles; turned by 0.4 about x
        at_b = Placement((0.0, 0.0, 0.0), (math.cos(0.2), math.sin(0.2), 0.0, 0.0))
    elif kind in ("revolute", "cylindrical"):
        at_b = Placement((0.0, 0.0, 0.0), (math.cos(0.3), 0.0, 0.0, math.sin(0.3)))
    if kind in ("prismatic", "cylindrical"):
        at_a = Placement((0.2, 0.02, -0.07))
    from mechlab.mechanism import Loop

    b.close_here(Loop("shut", kind, "left", "tip", at_a, at_b))
    return b.build()


@pytest.mark.parametrize("kind", ["fixed", "spherical", "revolute", "universal", "cylindrical", "prismatic"])
def test_rows_far_from_closure_have_their_jacobian(kind):
    m = chain_with(kind)
    (constraint,) = ConstraintSet(m).items
    rows, kin, h = closing_rows(constraint), TreeKinematics(m), 1e-6
    q = 0.4 * np.random.default_rng(8).standard_normal(m.nq)
    there = [rows.residual(kin.set(q + h * e)) - rows.residual(kin.set(q - h * e)) for e in np.eye(m.nv)]
    # central differences: h^2 of the third derivative, and rounding over h
    assert np.abs(np.array(there).T / (2.0 * h) - rows.jacobian(kin.set(q))).max() < 1e-8


@pytest.mark.parametrize("kind", ["fixed", "spherical", "revolute", "universal", "cylindrical", "prismatic"])
def test_an_extended_urdf_reads_back_with_the_same_freedoms(kind, tmp_path):
    m = chain_with(kind)
    made = to_extended_urdf(m)
    assert set(made.save(tmp_path)) == {"robot.urdf", "robot.yaml"}
    file = read_file(tmp_path / "robot.urdf")
    again = file.mechanism
    assert structure(again).freedoms == structure(m).freedoms
    assert not any("open in the zero pose" in n for n in file.notes)
    assert {d.on for d in again.drives} == {"a"}
    # the same closed poses: those of the first close the second at the same joint values, to the rounding of roll, pitch, yaw
    poses = sample_poses(m, count=4)
    assert len(poses) == 5 and max(np.abs(q).max() for q in poses) > 0.05
    for q in poses:
        there = again.reference()
        for j in again.joints:
            there[again.q_slice[j.name]] = m.value(j.name, q) - again.zero(j.name)
        assert np.abs(ConstraintSet(again).residual(TreeKinematics(again, there))).max() < 1e-11


def test_a_ball_joint_reads_back(tmp_path):
    m = from_urdf(fourbar(marks("closing_pin_1", "closing_pin_2")))
    path = closed_by(tmp_path, fourbar(marks()), robot__yaml=EXTENDED + "joint_name: [j_coupler]\njoint_type: [SPHERICAL]\n")
    first = read_file(path).mechanism
    to_extended_urdf(first).save(tmp_path / "again")
    second = read_file(tmp_path / "again" / "robot.urdf").mechanism
    assert [(b.name, b.joints) for b in second.bodies] == [(b.name, b.joints) for b in first.bodies]
    assert [(x.kind, x.body_a, x.body_b) for x in second.loops] == [(x.kind, x.body_a, x.body_b) for x in first.loops]
    mass = TreeKinematics(first).mass_matrix()
    assert np.abs(TreeKinematics(second).mass_matrix() - mass).max() < 1e-15
    assert len(m.loops) == 1


def test_a_distance_has_no_word_in_it():
    b = Builder("rod").body("a", revolute("a"), inertia=Inertia.cylinder(1, 0.1, 0.1))
    b.body("b", revolute("b"), at=(1, 0, 0), inertia=Inertia.cylinder(1, 0.1, 0.1))
    from mechlab.mechanism import Loop

    b.close_here(Loop("rod", "distance", "a", "b", Placement((0, 0.1, 0)), Placement((0, 0.1, 0)), 1.0))
    with pytest.raises(MechlabError, match="loop 'rod' keeps a distance"):
        to_extended_urdf(b.build())


def test_generate_writes_both_files(tmp_path, capsys):
    assert main(["generate", "fourbar", "-o", str(tmp_path), "--also", "extended-urdf", "--json"]) == 0
    json.loads(capsys.readouterr().out)
    m = read_file(tmp_path / "extended_urdf" / "robot.urdf").mechanism
    assert structure(m).freedoms == 1


def test_our_own_json_beside_it_is_the_whole_mechanism(tmp_path):
    m = ml.load("fourbar").mechanism()
    write_files(m, tmp_path)
    path = tmp_path / f"{m.name}.urdf"
    file = read_file(path)
    assert file.mechanism == m and f"{m.name}.json" in file.notes[0] and not file.left_out
    path.write_text(path.read_text().replace('mass value="', 'mass value="1'))
    with pytest.raises(MechlabError, match="says another mechanism than this URDF"):
        read_file(path)


# -- trees ---------------------------------------------------------------------------------------------------------------


def test_a_link_called_base_that_is_not_the_root(tmp_path, capsys):
    path = closed_by(tmp_path, fourbar().replace('"coupler"', '"base"').replace('"crank"', '"ground"'))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        m = read_file(path).mechanism
    assert {"base", "ground_2"} <= {b.name for b in m.bodies}
    assert main(["generate", str(path), "-o", str(tmp_path / "out")]) == 0
    assert '<link name="world" />' in (tmp_path / "out" / "bars.urdf").read_text()
    capsys.readouterr()


DRAWN = """<visual><geometry><box size="0 0 0"/></geometry></visual><visual><geometry><mesh filename="package://a/b.stl"/></geometry>
</visual><collision><geometry><box size="1 1 1"/></geometry></collision>"""


def test_what_is_not_read_is_listed_by_name(tmp_path):
    text = fourbar('<gazebo reference="crank"/><transmission name="t1"/><frobnicate name="x"/>')
    text = text.replace("<inertial>", DRAWN + "<inertial>", 1).replace("</joint>", '<safety_controller soft_lower_limit="1"/></joint>', 1)
    found = {x.what: x.names for x in read_file(closed_by(tmp_path, text)).left_out}
    assert found == {
        "gazebo": ("crank",), "transmission": ("t1",), "frobnicate": ("x",), "visual without size": ("crank",),
        "mesh": ("package://a/b.stl",), "collision": ("crank",), "safety_controller of a joint": ("j_crank",),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('<link name="base_link"/>', '<link name="base_link"/><link name="lost"/>'), "exactly one root link; .* has 2: base_link, lost"),
        (('xyz="0.1 0 0"', 'xyz="${l} 0 0"'), "xacro text.*xacro robot.urdf.xacro > robot.urdf"),
        (("<link", '<xacro:macro name="a"/><link'), "xacro text"),
        (('parent link="base_link"', 'parent link="coupler"'), "form a cycle that does not hang on the root link|in a cycle"),
    ],
)
def test_one_clear_message(change, message):
    with pytest.raises(MechlabError, match=message):
        from_urdf(fourbar().replace(*change))


def test_impossible_moments_of_inertia_are_raised_and_said(tmp_path):
    file = read_file(closed_by(tmp_path, fourbar().replace('izz="0.001"', 'izz="0.003"', 1)))
    moments = np.linalg.eigvalsh(np.diag(file.mechanism.body("crank").inertia.tensor[:3]))
    assert moments[0] + moments[1] >= moments[2] == pytest.approx(0.003) and "crank (by at most 0.0005" in " ".join(file.notes)
    with pytest.raises(MechlabError, match="negative"):
        from_urdf(fourbar().replace('izz="0.001"', 'izz="-0.003"', 1))


def test_small_products_of_inertia_survive_in_mujoco():
    """MuJoCo drops products of inertia whose principal axes are within 1e-6 rad of the body axes; exporters write such ones."""
    text = fourbar(DIALECTS["loop_joint"]).replace('ixy="0" ixz="0" iyz="0"', 'ixy="2e-10" ixz="-3e-10" iyz="1e-10"')
    text = text.replace('ixx="0.001" iyy="0.001"', 'ixx="0.002" iyy="0.0015"').replace('axis xyz="0 0 1"', 'axis xyz="0.6 0 0.8"')
    m = from_urdf(text.partition("<loop_joint")[0] + "</robot>")
    q = m.reference() + 0.3
    expected = TreeKinematics(m, q).mass_matrix()
    found = engine("mujoco").state(m, q, np.zeros(m.nv)).mass_matrix
    # rounding; with the products dropped it is 2e-10 / 0.1 of the largest entry
    assert np.abs(found - expected).max() < 1e-14 * np.abs(expected).max() * 10
