"""Exports, read back by readers of their own: SDF by its specification, the ROS package by yourdfpy, parts by trimesh, USD by pxr."""

import ast
import json
import math
import re
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yourdfpy

import mechlab as ml
from mechlab import catalog
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.formats.exports import EXPORTS, sdf_left_out, to_sdf
from mechlab.mechanism import Mechanism, Spring, TreeKinematics, Winding
from mechlab.mechanism.geometry import Array, axis_rotation, quaternion_to_matrix
from mechlab.mechanism.parts import LOOP_ROWS
from mechlab.shapes import mesh, volume
from tests.formats import mechanism_zoo as zoo

ZOO: dict[str, Mechanism] = {f"tree_{s}": zoo.tree(s) for s in range(4)} | {k: zoo.looped(k) for k in zoo.LOOPS}
REAL = ("fourbar", "delta6", "planetary", "andrews", "bricard", "slider_crank")
FREEDOMS = {"revolute": 1, "prismatic": 1, "ball": 3, "fixed": 0}


def mechanism(name: str) -> Mechanism:
    return ZOO[name] if name in ZOO else ml.load(name).mechanism()


# -- SDF --------------------------------------------------------------------------------------------------------------------


class Sdf:
    """A reader of SDF models that have their poses in links and joints, after the specification."""

    def __init__(self, text: str) -> None:
        self.model = ET.fromstring(text).find("model")
        assert self.model is not None
        self.links = {str(x.get("name")): self.pose(x) for x in self.model.findall("link")}
        self.tree: dict[str, ET.Element] = {}
        self.closing: list[ET.Element] = []
        for joint in self.model.findall("joint"):
            child = str(joint.findtext("child"))
            assert child in self.links and joint.findtext("parent") in {*self.links, "world"}
            if child in self.tree:
                self.closing.append(joint)
            else:
                self.tree[child] = joint

    @staticmethod
    def pose(element: ET.Element) -> Array:
        found = element.find("pose")
        out = np.eye(4)
        if found is not None:
            assert found.get("rotation_format") == "quat_xyzw"
            x, y, z, qx, qy, qz, qw = map(float, str(found.text).split())
            out[:3, 3], out[:3, :3] = (x, y, z), quaternion_to_matrix((qw, qx, qy, qz))
        return out

    def axis(self, joint: ET.Element) -> Array:
        return np.array([float(v) for v in str(joint.findtext("axis/xyz")).split()])

    def moved(self, m: Mechanism, q: Array) -> dict[str, Array]:
        """Link -> its pose when the joints of the tree have the coordinates of the mechanism."""
        out = {"world": np.eye(4)}

        def place(link: str) -> Array:
            if link not in out:
                joint = self.tree[link]
                parent = str(joint.findtext("parent"))
                before = np.eye(4) if parent == "world" else self.links[parent]
                own = self.pose(joint)
                turn = self.motion(joint, m, q)
                at = place(parent) @ np.linalg.inv(before) @ self.links[link] @ own
                out[link] = at @ turn @ np.linalg.inv(own)
            return out[link]

        return {link: place(link) for link in self.links}

    def motion(self, joint: ET.Element, m: Mechanism, q: Array) -> Array:
        out, kind = np.eye(4), joint.get("type")
        name = str(joint.get("name"))
        name = name if name in m.q_slice else name.removesuffix("_joint")  # of a joint that is called like its link
        if kind == "fixed" or name not in m.q_slice:
            return out
        x = q[m.q_slice[name]]
        if kind == "ball":
            out[:3, :3] = quaternion_to_matrix(x)
        elif kind == "revolute":
            out[:3, :3] = axis_rotation(self.axis(joint), x[0])
        else:
            out[:3, 3] = self.axis(joint) * x[0]
        return out


@pytest.mark.parametrize("name", [*ZOO, *REAL])
def test_sdf_has_the_poses_masses_and_loops(name: str) -> None:
    m = mechanism(name)
    sdf = Sdf(to_sdf(m))
    q, _ = zoo.state(m, 7)
    tree, poses = TreeKinematics(m, q), sdf.moved(m, q)
    for body in m.bodies:
        np.testing.assert_allclose(poses[body.name], tree.matrix(body.name), atol=1e-12)
    masses = [float(str(x.text)) for x in sdf.model.findall("link/inertial/mass")]
    assert len(masses) == len(sdf.links)  # a link without would weigh 1 kg
    # links in between weigh a millionth of the lightest body each
    assert sum(masses) == pytest.approx(m.total_mass, rel=1e-6 * (1 + len(masses)))
    kept = [x for x in m.loops if x.kind != "distance"]
    assert len(sdf.closing) == len(kept)
    # Gruebler's count of both: links and the freedoms of joints against coordinates and rows
    joints = [*sdf.tree.values(), *sdf.closing]
    count = 6 * len(sdf.links) - sum(6 - FREEDOMS[str(j.get("type"))] for j in joints)
    assert count == m.nv - sum(LOOP_ROWS[x.kind] for x in kept)
    assert {n for x in sdf_left_out(m) for n in x.names} >= {x.name for x in m.loops if x.kind == "distance"}


@pytest.mark.parametrize("name", [*zoo.LOOPS[:-1], *REAL])
def test_sdf_loops_stand_where_both_bodies_say(name: str) -> None:
    m = mechanism(name)
    sdf, tree = Sdf(to_sdf(m)), TreeKinematics(m)
    by_name = {str(j.get("name")): j for j in [*sdf.tree.values(), *sdf.closing]}
    for loop in m.loops:
        a = tree.matrix(loop.body_a) @ loop.placement_a.matrix()
        b = tree.matrix(loop.body_b) @ loop.placement_b.matrix()
        joint = by_name[loop.name]
        found = sdf.links[str(joint.findtext("child"))] @ sdf.pose(joint)
        np.testing.assert_allclose(found[:3, 3], b[:3, 3], atol=1e-12)
        wanted = {"universal": b[:3, 1], "revolute": a[:3, 2], "prismatic": a[:3, 2], "cylindrical": a[:3, 2]}
        if loop.kind in wanted:
            np.testing.assert_allclose(found[:3, :3] @ sdf.axis(joint), wanted[loop.kind], atol=1e-11)
        if loop.kind in ("universal", "cylindrical"):
            first = by_name[f"{loop.name}__1"]
            place = sdf.links[str(first.findtext("child"))] @ sdf.pose(first)
            np.testing.assert_allclose(place[:3, 3], a[:3, 3], atol=1e-12)
            np.testing.assert_allclose(
                place[:3, :3] @ sdf.axis(first), a[:3, 0 if loop.kind == "universal" else 2], atol=1e-12
            )


def test_sdf_mimics_limits_and_springs_of_joints() -> None:
    b = ml.Builder("pair").bar(
        "a", ml.revolute("qa", range=(-1, 2), zero=0.5, damping=0.1, stiffness=3.0, spring_rest=0.7), 0.1
    )
    m = b.bar("b", ml.revolute("qb"), 0.1, at=(0.3, 0, 0)).gears("teeth", "qa", "qb", (20, 40)).build()
    joints = {str(j.get("name")): j for j in Sdf(to_sdf(m)).tree.values()}
    limits = [float(str(joints["qa"].findtext(f"axis/limit/{k}"))) for k in ("lower", "upper")]
    assert limits == [-1.5, 1.5] and float(str(joints["qb"].findtext("axis/limit/upper"))) == math.inf
    spring = [float(str(joints["qa"].findtext(f"axis/dynamics/spring_{k}"))) for k in ("stiffness", "reference")]
    assert spring == pytest.approx([3.0, 0.2])
    follower = next(j for j in joints.values() if j.find("axis/mimic") is not None)
    leader = str(follower.find("axis/mimic").get("joint"))  # type: ignore[union-attr]
    ratio = float(str(follower.findtext("axis/mimic/multiplier")))
    given = {n: float(c) for n, c in m.relations[0].coefficients}
    assert given[str(follower.get("name"))] * ratio + given[leader] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("name", ["tree_0", "universal", "fourbar", "delta6", "bricard"])
def test_drake_reads_the_same_sdf(name: str, tmp_path: Path) -> None:
    """Drake's parser is libsdformat. It counts all joints; it moves trees only, so loops are cut before the poses."""
    plants = pytest.importorskip("pydrake.multibody.plant")
    parsing = pytest.importorskip("pydrake.multibody.parsing")
    m = mechanism(name)
    EXPORTS["sdf"](m, tmp_path)
    file = tmp_path / "sdf" / m.name / "model.sdf"
    whole = plants.MultibodyPlant(0.0)
    parsing.Parser(whole).AddModels(str(file))
    sdf = Sdf(file.read_text())
    assert whole.num_joints() == len(sdf.tree) + len(sdf.closing)
    root = ET.fromstring(file.read_text())
    model = root.find("model")
    assert model is not None
    for joint in model.findall("joint"):
        if joint.get("name") in {j.get("name") for j in sdf.closing}:
            model.remove(joint)
    file.write_text(ET.tostring(root, encoding="unicode"))
    plant = plants.MultibodyPlant(0.0)
    parsing.Parser(plant).AddModels(str(file))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    q, _ = zoo.state(m, 3)
    for joint in m.joints:
        if joint.kind == "spherical":
            q[m.q_slice[joint.name]] = (1.0, 0.0, 0.0, 0.0)
            continue
        drake = plant.GetJointByName(joint.name)
        (drake.set_angle if joint.kind == "revolute" else drake.set_translation)(context, q[m.q_slice[joint.name]][0])
    tree = TreeKinematics(m, q)
    assert plant.CalcTotalMass(context) == pytest.approx(m.total_mass, rel=1e-4)
    for body in m.bodies:
        found = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(body.name)).GetAsMatrix4()
        np.testing.assert_allclose(found, tree.matrix(body.name), atol=1e-12)


def test_sdf_names_that_mean_something_else(tmp_path: Path) -> None:
    b = ml.Builder("..").bar("world", ml.revolute("base"), 0.1).bar("base", ml.revolute("world"), 0.1, parent="world")
    m = b.frame("tip", "world", (0.1, 0, 0)).build()
    file = tmp_path / EXPORTS["sdf"](m, tmp_path).files["sdf"]
    root = ET.fromstring(file.read_text())
    names = [str(x.get("name")) for tag in ("link", "joint", "frame") for x in root.findall(f"model/{tag}")]
    assert len(names) == len(set(names)) and "world" not in names and "tip" in names
    assert file.is_relative_to(tmp_path / "sdf" / "model") and len([n for n in names if n.startswith("base")]) >= 3


# -- ROS 2 ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["fourbar", "delta6", "planetary", "slider_crank"])
def test_ros_package(name: str, tmp_path: Path) -> None:
    m = ml.load(name).mechanism()
    home = tmp_path / EXPORTS["ros2"](m, tmp_path).files["ros2"]
    package = str(ET.fromstring((home / "package.xml").read_text()).findtext("name"))
    assert (
        home.name == package == f"{name}_description" and f"project({package}" in (home / "CMakeLists.txt").read_text()
    )
    used: list[str] = []

    def locate(fname: str, **_: object) -> str:
        assert fname.startswith(f"package://{package}/")
        used.append(fname)
        path = home / fname.removeprefix(f"package://{package}/")
        assert path.is_file()
        return str(path)

    robot = yourdfpy.URDF.load(str(home / "urdf" / f"{name}.urdf"), filename_handler=locate, load_meshes=True)
    assert bool(used) == (home / "meshes").is_dir()
    q, _ = zoo.state(m, 2)
    scalars = {j.name: float(q[m.q_slice[j.name]][0]) for j in m.joints if j.nv == 1}
    spherical = [j.name for j in m.joints if j.nv == 3]
    for joint in spherical:
        q[m.q_slice[joint]] = (1.0, 0.0, 0.0, 0.0)
    robot.update_cfg({n: scalars.get(n, 0.0) for n in robot.actuated_joint_names})
    followers = {n for n, j in robot.joint_map.items() if j.mimic is not None}
    for follower in followers:
        mimic = robot.joint_map[follower].mimic
        q[m.q_slice[follower]] = mimic.multiplier * scalars[mimic.joint]
    tree = TreeKinematics(m, q)
    for body in m.bodies:
        np.testing.assert_allclose(robot.get_transform(body.name, robot.base_link), tree.matrix(body.name), atol=1e-9)
    control = ET.parse(home / "urdf" / f"{name}.urdf").getroot().find("ros2_control")
    assert control is not None
    commanded = {str(j.get("name")) for j in control.findall("joint") if j.find("command_interface") is not None}
    driven = {d.on for d in m.drives if d.on in scalars}
    assert commanded == driven - followers
    moving = {n for n, j in robot.joint_map.items() if j.type != "fixed"}
    states = {
        str(j.get("name")): [s.get("name") for s in j.findall("state_interface")] for j in control.findall("joint")
    }
    assert states == dict.fromkeys(moving, ["position", "velocity", "effort"])
    text = (home / "README.md").read_text()
    assert ("Closed loops" in text) == bool(m.loops) and all(f"`{x.name}`" in text for x in m.loops)
    for launch in ("display", "control"):
        ast.parse((home / "launch" / f"{launch}.launch.py").read_text())
    listed = re.findall(r"joints: \[(.*)\]", (home / "config" / "controllers.yaml").read_text())
    assert {n for line in listed for n in line.split(", ")} == commanded


def test_ros_commands_and_package_names(tmp_path: Path) -> None:
    b = ml.Builder("2.Arm--X")
    for k in range(4):
        b.bar(f"b{k}", ml.revolute(f"q{k}"), 0.1)
    b.drive("q0", stiffness=9.0, damping=1.0).drive("q1", damping=1.0).drive("q2").drive(
        "q3", winding=Winding(0.1, 1.0)
    )
    home = tmp_path / EXPORTS["ros2"](b.build(), tmp_path).files["ros2"]
    assert home.name == "m2_arm_x_description"
    root = ET.parse(next((home / "urdf").glob("*.urdf"))).getroot()
    found = {
        j.get("name"): [c.get("name") for c in j.findall("command_interface")]
        for j in root.findall("ros2_control/joint")
    }
    assert found == {"q0": ["position"], "q1": ["velocity"], "q2": ["effort"], "q3": ["effort"]}


# -- parts ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["fourbar", "planetary_stage", "delta6"])
def test_stl_and_3mf_have_the_volumes_and_places(name: str, tmp_path: Path) -> None:
    m = ml.load(name).mechanism()
    for kind in ("stl", "3mf"):
        EXPORTS[kind](m, tmp_path)
    tree = TreeKinematics(m)
    scene = trimesh.load(tmp_path / f"{name}.3mf")
    with zipfile.ZipFile(tmp_path / f"{name}.3mf") as archive:
        assert re.search(rb'<model [^>]*unit="millimeter"', archive.read("3D/3dmodel.model"))
    drawn = [b for b in m.bodies if b.shapes]
    shafts = [s for s in m.shafts if s.shapes]
    assert len(list((tmp_path / "stl").iterdir())) == len(drawn) + bool(m.ground_shapes) + len(shafts)
    assert len(scene.graph.nodes_geometry) == len(drawn) + bool(m.ground_shapes) + len(shafts)
    for body in drawn:
        part = trimesh.load(tmp_path / "stl" / f"{body.name}.stl")
        expected = sum(volume(mesh(s.kind, s.parameters)) for s in body.shapes)
        assert part.volume == pytest.approx(expected * 1e9, rel=1e-4)  # coordinates of 32 bits
        points = [
            mesh(s.kind, s.parameters).vertices @ s.placement.rotation.T + s.placement.translation for s in body.shapes
        ]
        box = [np.min([p.min(0) for p in points], 0), np.max([p.max(0) for p in points], 0)]
        np.testing.assert_allclose(part.bounds, 1e3 * np.array(box), atol=1e-3)
        pose, geometry = scene.graph[body.name]
        want = tree.matrix(body.name)
        np.testing.assert_allclose(pose[:3, :3], want[:3, :3], atol=1e-6)
        np.testing.assert_allclose(pose[:3, 3], 1e3 * want[:3, 3], atol=1e-3)
        assert scene.geometry[geometry].volume == pytest.approx(expected * 1e9, rel=1e-4)


def test_nothing_to_print_is_said(tmp_path: Path) -> None:
    m = ml.Builder("bare").body("x", ml.revolute("q"), inertia=ml.Inertia.box(1, 1, 1, 1)).build()
    for kind in ("stl", "3mf"):
        with pytest.raises(MechlabError, match="bare: no body has a shape"):
            EXPORTS[kind](m, tmp_path)


# -- USD --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*ZOO, *REAL])
def test_usd_has_the_poses_masses_and_joints(name: str, tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    from pxr import UsdGeom, UsdPhysics

    m = mechanism(name)
    EXPORTS["usd"](m, tmp_path)
    stage = usd.Stage.Open(str(tmp_path / f"{m.name}.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0 and UsdGeom.GetStageUpAxis(stage) == "Z"
    cache, tree = UsdGeom.XformCache(), TreeKinematics(m)

    def world(path: object) -> Array:
        return np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path))).T

    bodies = {p.GetName(): p for p in stage.Traverse() if p.HasAPI(UsdPhysics.RigidBodyAPI)}
    for body in m.bodies:
        np.testing.assert_allclose(world(bodies[body.name].GetPath()), tree.matrix(body.name), atol=1e-12)
        if body.inertia.mass:
            api = UsdPhysics.MassAPI(bodies[body.name])
            turn = quaternion_to_matrix([(q := api.GetPrincipalAxesAttr().Get()).GetReal(), *q.GetImaginary()])
            tensor = turn @ np.diag(api.GetDiagonalInertiaAttr().Get()) @ turn.T
            size = float(np.abs(body.inertia.matrix()).max()) or 1.0
            assert api.GetMassAttr().Get() == pytest.approx(body.inertia.mass, rel=1e-6)  # numbers of 32 bits
            np.testing.assert_allclose(tensor, body.inertia.matrix(), atol=1e-5 * size)
            np.testing.assert_allclose(api.GetCenterOfMassAttr().Get(), body.inertia.com, atol=1e-6)
    joints = [UsdPhysics.Joint(p) for p in stage.Traverse() if p.IsA(UsdPhysics.Joint)]
    closing = [j for j in joints if j.GetExcludeFromArticulationAttr().Get()]
    assert len(closing) == len(m.loops)
    children = [j.GetBody1Rel().GetTargets()[0] for j in joints if j not in closing]
    assert len(children) == len(set(children)) == len(bodies)
    for joint in joints:
        frames = []
        for body, at, turn in (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        ):
            local = np.eye(4)
            local[:3, 3] = at.Get()
            local[:3, :3] = quaternion_to_matrix([turn.Get().GetReal(), *turn.Get().GetImaginary()])
            frames.append(world(body.GetTargets()[0]) @ local)
        if joint.GetPrim().IsA(UsdPhysics.DistanceJoint):
            apart = float(np.linalg.norm(frames[0][:3, 3] - frames[1][:3, 3]))
            assert apart == pytest.approx(UsdPhysics.DistanceJoint(joint).GetMaxDistanceAttr().Get(), rel=1e-5)
            continue
        np.testing.assert_allclose(frames[0], frames[1], atol=1e-5)
        own = next((j for j in m.joints if j.name == joint.GetPrim().GetName()), None)
        if own is not None and own.nv == 1:
            home = next(b.name for b in m.bodies if own in b.joints)
            np.testing.assert_allclose(frames[1][:3, 2], tree.matrix(home)[:3, :3] @ own.axis, atol=1e-6)


def test_usd_drives_are_in_degrees(tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    from pxr import UsdPhysics

    joint = ml.revolute("q", range=(-1.0, 2.0), zero=0.5)
    m = ml.Builder("servo").bar("a", joint, 0.2).drive("q", stiffness=9.0, damping=2.0, limit=4.0, target=1.0).build()
    EXPORTS["usd"](m, tmp_path)
    stage = usd.Stage.Open(str(tmp_path / "servo.usda"))
    prim = stage.GetPrimAtPath("/servo/joints/q")
    api, one = UsdPhysics.DriveAPI(prim, "angular"), math.pi / 180
    found = [getattr(api, f"Get{k}Attr")().Get() for k in ("Stiffness", "Damping", "MaxForce", "TargetPosition")]
    assert found == pytest.approx([9 * one, 2 * one, 4.0, 0.5 / one], rel=1e-6)
    limits = [getattr(UsdPhysics.RevoluteJoint(prim), f"Get{k}LimitAttr")().Get() for k in ("Lower", "Upper")]
    assert limits == pytest.approx([-1.5 / one, 1.5 / one], rel=1e-6)


# -- the verb ---------------------------------------------------------------------------------------------------------------


def test_generate_also(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = tmp_path / "plain"
    assert main(["generate", "fourbar", "-o", str(plain)]) == 0
    assert main(["generate", "fourbar", "-o", str(tmp_path / "more"), "--also", "ros2,sdf,stl,3mf"]) == 0
    for file in plain.rglob("*"):
        if file.is_file():
            assert (tmp_path / "more" / file.relative_to(plain)).read_bytes() == file.read_bytes()
    assert {p.name for p in (tmp_path / "more").iterdir()} - {p.name for p in plain.iterdir()} == {
        "ros2", "sdf", "stl", "fourbar.3mf",
    }  # fmt: skip
    capsys.readouterr()
    assert main(["generate", "fourbar", "-o", str(tmp_path / "bad"), "--also", "sdf,stp", "--json"]) == 1
    assert "'stp' does not exist" in json.loads(capsys.readouterr().out)["error"]["message"]
    assert not (tmp_path / "bad").exists()
    assert ml.generate("fourbar", out=tmp_path / "more", also=["stl"]).files["stl"] == tmp_path / "more" / "stl"


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    b = ml.edit("planetary", fidelity="parts").spring(Spring("coil", "ground", "carrier", (1, 0, 0), (0, 0, 0), 1.0))
    m = b.build()
    assert any(len(r.coefficients) > 2 for r in m.relations)
    for kind in ("sdf", "ros2", "usd"):
        if kind == "usd":
            pytest.importorskip("pxr")
        (tmp_path / kind).mkdir()
        lost = {n for x in EXPORTS[kind](m, tmp_path / kind).left_out for n in x.names}
        assert {"coil"} | {r.name for r in m.relations if len(r.coefficients) > 2} <= lost


@pytest.mark.slow
@pytest.mark.parametrize("name", catalog.NAMES)
def test_every_mechanism_can_be_exported(name: str, tmp_path: Path) -> None:
    m = ml.load(name).mechanism()
    for kind, writer in EXPORTS.items():
        if kind == "usd":
            pytest.importorskip("pxr")
        assert all((tmp_path / p).exists() for p in writer(m, tmp_path).files.values())
