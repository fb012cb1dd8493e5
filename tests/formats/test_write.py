"""The files of a mechanism: all or none, other files untouched, loaded by MuJoCo, Pinocchio and yourdfpy."""

import json
import os

import mujoco
import numpy as np
import pytest
from mechanism_zoo import ALL, arm, fourbar, planetary

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.formats import from_json, load_recording, save_recording, scene_mjcf, write_files
from mechlab.mechanism import Builder, Inertia, revolute, shape


def listing(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_exactly_these_files(tmp_path):
    files = write_files(fourbar(), tmp_path / "out")
    names = set(listing(tmp_path / "out"))
    assert {"fourbar.xml", "scene.xml", "fourbar.urdf", "fourbar.json"} == {n for n in names if "/" not in n}
    assert {p.relative_to(tmp_path / "out").as_posix() for p in files.values()} == names
    solids = {s.size for b in fourbar().bodies for s in b.shapes if s.kind == "link"}
    assert len([n for n in names if n.startswith("meshes/link_")]) == len(solids)
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


@pytest.mark.parametrize("name", ALL)
def test_consumers_load_them(name, tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy")
    m = ALL[name]()
    files = write_files(m, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(files["scene"]))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert np.isclose(model.body_mass.sum(), m.total_mass, rtol=1e-12)
    assert mujoco.MjModel.from_xml_path(str(files["urdf"])).nbody > 1
    yourdfpy.URDF.load(str(files["urdf"]))
    assert from_json(files["json"].read_text("utf-8")) == m


def test_meshes_of_the_urdf_in_pinocchio(tmp_path):
    pin = pytest.importorskip("pinocchio")
    m = fourbar()
    files = write_files(m, tmp_path)
    model = pin.buildModelFromUrdf(str(files["urdf"]))
    looks = pin.buildGeomFromUrdf(model, str(files["urdf"]), pin.GeometryType.VISUAL, package_dirs=[str(tmp_path)])
    assert looks.ngeoms == sum(len(b.shapes) for b in m.bodies) + len(m.ground_shapes)


def test_the_sidecar_maps_names(tmp_path):
    m = planetary()
    data = json.loads(write_files(m, tmp_path)["json"].read_text("utf-8"))["urdf"]
    assert data["root"] == "base" and data["joints"]["sun"] == ["sun"] and data["gravity"] == [0, 0, -9.81]


def test_the_same_byte_for_byte(tmp_path):
    write_files(fourbar(), tmp_path / "a")
    write_files(fourbar(), tmp_path / "b")
    write_files(fourbar(), tmp_path / "b")
    assert listing(tmp_path / "a") == listing(tmp_path / "b")


def wheels(*sizes, names=None):
    """A row of gears of these modules [m]."""
    b = Builder("wheels")
    for k, size in enumerate(sizes):
        name = names[k] if names else f"wheel_{k}"
        gear = shape("spur_gear", module=size, teeth=12, width=0.01)
        b.body(name, revolute(f"turn_{k}"), inertia=Inertia.cylinder(1, 0.02, 0.01), shapes=[gear])
    return b.build()


def mesh_names(folder, *sizes, names=None):
    write_files(wheels(*sizes, names=names), folder)
    return sorted(p.name for p in (folder / "meshes").iterdir())


def test_names_and_sharing_of_meshes_do_not_hang_on_the_last_bits_of_sizes(tmp_path):
    """Computed sizes differ by that between processors."""
    size, other = 0.0416, 0.0417
    above = np.nextafter(size, 1.0)
    expected = ["spur_gear_wheel_0.obj", "spur_gear_wheel_2.obj"]
    assert mesh_names(tmp_path / "a", size, size, other) == expected
    assert mesh_names(tmp_path / "b", above, size, other) == expected
    assert mesh_names(tmp_path / "c", size, above, np.nextafter(other, 0.0)) == expected
    assert len(mesh_names(tmp_path / "d", size, size * (1 + 1e-6))) == 2


def test_meshes_of_bodies_that_differ_in_capitals_or_letters_beyond_ascii_have_files_of_their_own(tmp_path):
    assert mesh_names(tmp_path, 0.01, 0.02, 0.03, 0.04, names=["A", "a", "\u00e4", "\u00f6"]) == [
        "spur_gear_A.obj", "spur_gear__.obj", "spur_gear___2.obj", "spur_gear_a_2.obj",
    ]  # fmt: skip
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "wheels.xml")).nmesh == 4


def test_other_files_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "own.obj").write_text("mine too")
    write_files(arm(), tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine" and (
        tmp_path / "meshes" / "own.obj"
    ).read_text() == "mine too"


def test_a_refusal_leaves_nothing_behind(tmp_path):
    def refuse(folder, m):
        assert (folder / "fourbar.xml").is_file() and m.name == "fourbar"
        raise MechlabError("refused")

    (tmp_path / "fourbar.xml").write_text("old")
    with pytest.raises(MechlabError, match="refused"):
        write_files(fourbar(), tmp_path, verify=refuse)
    assert listing(tmp_path) == {"fourbar.xml": b"old"}
    with pytest.raises(MechlabError, match="refused"):
        write_files(fourbar(), tmp_path / "new" / "deep", verify=refuse)
    assert not (tmp_path / "new").exists()


def test_a_target_that_is_a_file(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(MechlabError, match="is a file, expected a folder"):
        write_files(fourbar(), tmp_path / "out")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(MechlabError, match="cannot write"):
        write_files(fourbar(), tmp_path / "out")
    tmp_path.chmod(0o700)


def test_a_path_through_a_file_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(MechlabError, match="cannot write"):
        write_files(fourbar(), tmp_path / "file" / "out")


def test_a_move_that_fails_is_taken_back(tmp_path):
    (tmp_path / "fourbar.xml").write_text("old")
    (tmp_path / "fourbar.json").mkdir()  # a folder cannot be replaced by a file
    before = listing(tmp_path)
    with pytest.raises(MechlabError, match="cannot write"):
        write_files(fourbar(), tmp_path)
    assert listing(tmp_path) == before


@pytest.mark.parametrize("name", ["arm", "fourbar"])
def test_the_scene_has_a_floor_below(name):
    text = scene_mjcf(ALL[name]())
    assert f'<include file="{name}.xml" />' in text and 'name="scene:floor"' in text
    assert text == scene_mjcf(ALL[name]())


def test_recordings_round_trip(tmp_path):
    m = fourbar()
    t = np.linspace(0, 1, 5)
    q = np.outer(t, [1.0, 2.0, 3.0])
    run = Recording(m, t, q, 2 * q, {"crank": q[:, 0]}, {"crank": "rad"}, scene="test", parameters={"length": 0.1})
    path = save_recording(run, tmp_path / "run.npz")
    again = load_recording(path)
    assert again.mechanism == m and again.settings == run.settings and again.health == run.health
    assert np.array_equal(again.q, q) and np.array_equal(again.channel("crank"), q[:, 0])
    assert again.parameters == run.parameters and again.units == run.units
    first = path.read_bytes()
    assert save_recording(run, path).read_bytes() == first
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x03\x04broken"])
def test_what_is_no_recording(tmp_path, content):
    path = tmp_path / "run.npz"
    path.write_bytes(content)
    with pytest.raises(MechlabError, match="not a recording"):
        load_recording(path)
    with pytest.raises(MechlabError, match="not a recording"):
        load_recording(tmp_path / "missing.npz")


def test_a_recording_without_channels(tmp_path):
    m = fourbar()
    run = Recording(m, np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))
    assert load_recording(save_recording(run, tmp_path / "run.npz")).channels == {}
