"""Files that are broken, mean nothing, or attack the reader: every verb answers with the culprit's name, soon, without a traceback."""

import io
import json
import os
import re
import time
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.formats import to_json

CPU = 60.0
"""CPU time of one answer in this process [s] that counts as never; the slowest, 20000 visuals, take 3 s, under load three times that."""

ARM = '<body name="arm"><joint name="j" axis="0 1 0"/><geom name="g" type="capsule" size=".02" fromto="0 0 0 0 0 1"/></body>'


CONNECT = '<connect body1="arm" body2="world" anchor="0 0 0"/>'
SPHERE = '<geom size=".01"/>'
VISUAL = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'


def mjcf(world=ARM, rest=""):
    return f'<mujoco model="m">{rest}<worldbody>{world}</worldbody></mujoco>'


def arm(old, new):
    assert old in ARM
    return mjcf(ARM.replace(old, new))


INERTIAL = '<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
ROBOT = (
    f'<robot name="r"><link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link><joint name="j" type="revolute">'
    f'<parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 1 0"/>{LIMIT}</joint></robot>'
)


def robot(old, new):
    assert old in ROBOT
    return ROBOT.replace(old, new)


def chain(links, mimics=False):
    leader = '<mimic joint="j{}"/>' if mimics else ""
    joints = (
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="1 0 0"/>'
        f"{leader.format(k + 1) if k < links - 2 else ''}</joint>"
        for k in range(links - 1)
    )
    parts = (f'<link name="l{k}">{INERTIAL}</link>' for k in range(links))
    return f'<robot name="r">{"".join(parts)}{"".join(joints)}</robot>'


def laughs():
    """The entity expansion known as billion laughs."""
    entities = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    return f'<!DOCTYPE m [<!ENTITY l0 "ha">{entities}]><mujoco model="&l9;"/>'


MJCF = {
    "no text": ("", "no element found"),
    "cut": (mjcf()[:80], "is not XML"),
    "binary": ("\x01\x02\x00<mujoco/>", "is not XML"),
    "other root": ("<html/>", "root element is <html>"),
    "entities": (laughs(), "declares entities"),
    "outer entity": ('<!DOCTYPE m SYSTEM "file:///etc/passwd"><mujoco/>', "declares entities"),
    "attribute twice": (arm('name="j"', 'name="j" name="k"'), "duplicate attribute"),
    "nesting of 1000": (mjcf("<body>" * 1000 + "</body>" * 1000), "nested more than 500"),
    "2000 bodies": (mjcf('<body><joint/><geom size=".1"/></body>' * 2000), "500 bodies|of at most 600|memory"),
    "NaN position": (arm('name="arm"', 'name="arm" pos="nan 0 0"'), "<body name='arm'>: pos='nan 0 0' is not finite"),
    "NaN axis": (arm("0 1 0", "0 nan 0"), "<joint name='j'>: axis"),
    "NaN size": (arm('size=".02"', 'size="NaN"'), "<geom name='g'>: size"),
    "NaN range": (arm("axis", 'range="nan 1" axis'), "<joint name='j'>: range"),
    "NaN damping": (arm("axis", 'damping="nan" axis'), "<joint name='j'>: damping"),
    "NaN colour": (arm("size", 'rgba="nan 0 0 1" size'), "<geom name='g'>: rgba"),
    "NaN friction of contacts": (arm("size", 'friction="nan 0 0" size'), "<geom name='g'>: friction"),
    "infinite armature": (arm("axis", 'armature="inf" axis'), "<joint name='j'>: armature"),
    "number beyond doubles": (arm("axis", 'stiffness="1e999" axis'), "<joint name='j'>: stiffness"),
    "number of 400 digits": (arm("axis", f'ref="{"9" * 400}" axis'), "<joint name='j'>: ref"),
    "number beyond measure": (arm("axis", 'armature="1e200" axis'), "beyond 1e\\+50"),
    "NaN timestep": (mjcf(rest='<option timestep="nan"/>'), "<option>: timestep='nan' is not finite"),
    "negative timestep": (mjcf(rest='<option timestep="-0.001"/>'), "<option>: timestep='-0.001' must be above 0"),
    "zero timestep": (mjcf(rest='<option timestep="0"/>'), "<option>: timestep='0' must be above 0"),
    "NaN gravity": (mjcf(rest='<option gravity="0 0 nan"/>'), "<option>: gravity"),
    "NaN solref of a default": (mjcf(rest='<default><joint solreflimit="nan 1"/></default>'), "<joint>: solreflimit"),
    "zero solref": (arm("size", 'solref="0 1" size'), "<geom name='g'>: solref='0 1'"),
    "solref of two signs": (arm("size", 'solref="0.02 -1" size'), "<geom name='g'>: solref"),
    "NaN polycoef": (mjcf(rest='<equality><joint joint1="j" polycoef="0 nan 0 0 0"/></equality>'), "<joint>.*: polycoef|<joint>: polycoef"),
    "NaN keyframe": (mjcf(rest='<keyframe><key qpos="nan"/></keyframe>'), "<key>: qpos"),
    "negative mass": (arm("size", 'mass="-2" size'), "<geom name='g'>: mass='-2' must not be negative"),
    "negative inertial mass": (arm("<joint", '<inertial mass="-1" diaginertia="1 1 1"/><joint'), "mass='-1' must not be negative"),
    "negative inertia": (arm("<joint", '<inertial pos="0 0 0" mass="1" diaginertia="1 -1 1"/><joint'), "diaginertia='1 -1 1'"),
    "negative density": (arm("size", 'density="-1" size'), "<geom name='g'>: density"),
    "negative armature": (arm("axis", 'armature="-1" axis'), "<joint name='j'>: armature='-1' must not be negative"),
    "negative damping": (arm("axis", 'damping="-1" axis'), "<joint name='j'>: damping"),
    "limits upside down": (arm("axis", 'range="2 -2" axis'), "<joint name='j'>: range='2 -2' is upside down"),
    "control upside down": (
        mjcf(rest='<actuator><motor name="m" joint="j" ctrlrange="1 -1"/></actuator>'), "<motor name='m'>: ctrlrange='1 -1' is upside down"
    ),
    "unknown attribute": (arm("axis", 'frictionlos="1" axis'), "no attribute 'frictionlos' here. Did you mean 'frictionloss'"),
    "unknown attribute of an option": (mjcf(rest='<option timesteps="1"/>'), "'timesteps' here. Did you mean 'timestep'"),
    "attribute of another element": (arm("axis", 'mass="1" axis'), "<joint name='j'>: MuJoCo knows no attribute 'mass' here"),
    "unknown element": (mjcf("<bodi/>" + ARM), "bodi"),
    "unknown section": (mjcf(rest="<aktuator/>"), "aktuator"),
    "body twice": (mjcf(ARM + '<body name="arm"/>'), "<body name='arm'>: the name is used twice"),
    "joint twice": (mjcf(ARM + '<body><joint name="j"/><geom size=".1"/></body>'), "<joint name='j'>: the name is used twice"),
    "actuator twice": (mjcf(rest='<actuator><motor name="a" joint="j"/><motor name="a" joint="j"/></actuator>'), "<motor name='a'>: the"),
    "motor on nothing": (mjcf(rest='<actuator><motor name="a" joint="nobody"/></actuator>'), "nobody"),
    "loop to nobody": (mjcf(rest='<equality><connect name="c" body1="arm" body2="nobody" anchor="0 0 0"/></equality>'), "nobody"),
    "class of nobody": (arm("axis", 'class="nobody" axis'), "nobody"),
    "too few numbers": (arm("0 1 0", "0 1"), "<joint name='j'>: axis|axis"),
    "words for numbers": (arm("0 1 0", "zero one zero"), "axis|j"),
    "axis without length": (arm("0 1 0", "0 0 0"), "axis"),
    "quaternion of zeros": (arm('name="arm"', 'name="arm" quat="0 0 0 0"'), "quat"),
    "negative size": (arm('size=".02"', 'size="-.02"'), "size"),
    "no mass": (mjcf('<body name="arm"><joint name="j"/></body>'), "arm|mass"),
    "nothing moves": (mjcf('<body name="arm"><geom size=".1"/></body>'), "moves|no joints|0 coordinates"),
    "missing mesh": (mjcf(rest='<asset><mesh name="m" file="gone.stl"/></asset>'), "gone.stl"),
    "missing include": (mjcf(rest='<include file="gone.xml"/>'), "gone.xml"),
    "includes itself": (mjcf(rest='<include file="model.xml"/>'), "model.xml"),
    "mesh by its place": (mjcf(rest='<asset><mesh name="m" file="/etc/passwd"/></asset>'), "<mesh name='m'>: file='/etc/passwd' leads out"),
    "mesh by the root": (mjcf(rest='<asset><mesh name="m" file="../../../../../../../../../../../etc/passwd"/></asset>'), "leads out"),
    "folder by its place": (mjcf(rest='<compiler meshdir="/etc"/><asset><mesh file="passwd"/></asset>'), "meshdir='/etc' leads out"),
    "include by its place": (mjcf(rest='<include file="/etc/hostname"/>'), "<include>: file='/etc/hostname' leads out"),
    "texture of a URL": (mjcf(rest='<asset><texture type="2d" name="t" file="http://a/b.png"/></asset>'), "is a URL"),
    "mesh of a pipe": (mjcf(rest='<asset><mesh name="m" file="pipe"/></asset>'), "is no ordinary file"),
    "mesh of random bytes": (mjcf(rest='<asset><mesh name="m" file="noise.stl"/></asset>'), "noise|STL|stl"),
    "texture of 10 GB": (mjcf(rest='<asset><texture type="2d" name="t" builtin="flat" width="60000" height="60000"/></asset>'), "texture"),
    "height field of 14 GB": (mjcf(rest='<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>'), "memory|crashes"),
    "arena of 200 GB": (mjcf(rest='<size memory="200G"/>'), "memory"),
    "700 loops": (mjcf(ARM, f"<equality>{CONNECT * 700}</equality>"), "'m' has 2100 constraint rows, the limit is 1800"),
    "20000 geoms": (mjcf(ARM + SPHERE * 20_000), "'m' has 20001 shapes \\(geoms, visuals\\), the limit is 10000"),
    "700 copies": (
        mjcf('<replicate count="700" offset="1 0 0"><body><joint/><geom size=".1"/></body></replicate>'), "500 bodies|of at most 600"
    ),
}  # fmt: skip
URDF = {
    "no text": ("", "no element found"),
    "no link": ('<robot name="r"/>', "link"),
    "nesting of 1000": (f'<robot name="r">{"<link>" * 1000}{"</link>" * 1000}</robot>', "nested more than 500"),
    "700 links": (chain(700), "500 bodies|of at most 600"),
    "entities": (laughs(), "declares entities"),
    "NaN origin": (robot("0 0 1", "0 nan 1"), "<origin>: xyz='0 nan 1' is not finite"),
    "NaN mass": (robot('mass value="1"', 'mass value="nan"'), "<mass>: value='nan' is not finite"),
    "NaN limit": (robot('upper="1"', 'upper="nan"'), "<limit>: upper='nan' is not finite"),
    "infinite inertia": (robot('ixx=".1"', 'ixx="inf"'), "<inertia>: ixx='inf' is not finite"),
    "negative mass": (robot('mass value="1"', 'mass value="-1"'), "<link name='a'>: its mass -1 must not be negative"),
    "mass without value": (robot('<mass value="1"/>', "<mass/>"), "<link name='a'>: its <mass> has no number"),
    "mass in words": (robot('mass value="1"', 'mass value="one"'), "value='one' is not a list of numbers"),
    "inertia that no body has": (robot('ixx=".1"', 'ixx="9"'), "'b'|link b|b \\("),
    "limits upside down": (robot('lower="-1" upper="1"', 'lower="1" upper="-1"'), "<joint name='j'>: its limits are upside down"),
    "axis without direction": (robot("0 1 0", "0 0 0"), "<joint name='j'>: its axis has no direction"),
    "two origins": (robot("<axis", '<origin xyz="1 1 1"/><axis'), "<joint name='j'>: it has 2 elements <origin>"),
    "two inertials": (robot(INERTIAL, INERTIAL + INERTIAL), "<link name='a'>: it has 2 elements <inertial>"),
    "mistyped attribute": (robot('xyz="0 0 1"', 'xzy="0 0 1"'), "'xzy' here. Did you mean 'xyz'"),
    "too few numbers": (robot("0 0 1", "0 0"), "xyz='0 0' has 2 numbers"),
    "link twice": (robot('link name="b"', 'link name="a"'), "<link name='a'>"),
    "parent that is missing": (robot('parent link="a"', 'parent link="x"'), "'x'"),
    "own parent": (robot('parent link="a"', 'parent link="b"'), "b"),
    "two roots": (robot("<joint", f'<link name="c">{INERTIAL}</link><joint'), "root"),
    "unknown type": (robot("revolute", "twisting"), "twisting"),
    "no type": (robot(' type="revolute"', ""), "<joint name='j'>|joint 'j'|j"),
    "mimic of nobody": (robot(LIMIT, LIMIT + '<mimic joint="nobody"/>'), "nobody"),
    "700 mimics of each other": (chain(700, mimics=True), "500 bodies|of at most 600"),
    "20000 visuals": (robot("</inertial></link><joint", "</inertial>" + VISUAL * 20_000 + "</link><joint"), "'r' has 20000 shapes"),
    "mimic of itself": (robot(LIMIT, LIMIT + '<mimic joint="j"/>'), "j"),
}  # fmt: skip
JSON = {
    "no text": ("", "is not JSON"),
    "nesting of 100000": ("[" * 100000, "nested too deeply|is not JSON"),
    "list": ("[]", "expected a JSON object"),
    "key twice": ('{"format": 1, "format": 2}', "written twice"),
    "NaN": ('{"format": NaN}', "NaN"),
    "other format": ('{"format": "x"}', "holds no mechanism"),
    "number of 5000 digits": (f'{{"format": {"9" * 5000}}}', "is not JSON"),
}


def cases():
    for suffix, table in (("xml", MJCF), ("urdf", URDF), ("json", JSON)):
        yield from (pytest.param(suffix, *case, id=f"{suffix}: {name}") for name, case in table.items())


def answer(words, capsys):
    """Exit code, all that was printed, and the CPU time of a command."""
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numpy's, about huge numbers; none is the answer
        code = main([str(w) for w in words])
    out, err = capsys.readouterr()
    return code, out, err, time.process_time() - start


@pytest.fixture
def folder(tmp_path):
    """A folder with a pipe and a mesh of random bytes beside the model."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "noise.stl").write_bytes(np.random.default_rng(1).bytes(4000))
    return tmp_path


def test_the_table_is_long_enough():
    assert len(list(cases())) >= 100


@pytest.mark.parametrize(("suffix", "content", "culprit"), cases())
def test_the_culprit_is_named(suffix, content, culprit, folder, capsys):
    path = folder / f"model.{suffix}"
    path.write_text(content)
    for verb in ("show", "doctor", "simulate") if suffix != "json" else ("show", "simulate"):
        more = ["--duration", "0.01"] if verb == "simulate" else []
        code, out, err, cpu = answer([verb, path, *more], capsys)
        assert code in (0, 1, 2, 3, 4)
        assert "internal error" not in err and "Traceback" not in err, (verb, err)
        assert re.search(culprit, out + err), (verb, code, err or out)
        assert (code == 0) == (err == ""), (verb, code, err)
        assert cpu < CPU, verb


@pytest.mark.parametrize(("suffix", "intact"), [("xml", mjcf()), ("urdf", ROBOT), ("json", "")])
def test_what_the_broken_files_are_made_of_is_sound(suffix, intact, folder, capsys):
    path = folder / f"model.{suffix}"
    path.write_text(intact or to_json(ml.load("fourbar").mechanism()))
    code, _, err, _ = answer(["show", path], capsys)
    assert (code, err) == (0, "")


@pytest.mark.parametrize("links", [40, 292])
def test_joints_that_follow_each_other_in_a_row_are_one_freedom(links, folder, capsys):
    (folder / "model.urdf").write_text(chain(links, mimics=True))
    code, out, err, cpu = answer(["show", folder / "model.urdf"], capsys)
    assert (code, err) == (0, "") and cpu < CPU
    rows = links - 2
    assert f"{links - 1} coordinates, {rows} constraint rows of rank {rows}: 1 degree of freedom" in out


def test_many_loops_on_many_bodies_are_answered_soon(folder, capsys):
    """A chain of 60 links, each of them pinned to the world by 10 loops, which is as many rows as there may be: nothing moves."""
    links = "".join(f'<body name="b{k}"><joint axis="0 1 0"/><geom size=".1"/>' for k in range(60)) + "</body>" * 60
    loops = "".join(f'<connect body1="b{k % 60}" body2="world" anchor="0 0 .1"/>' for k in range(600))
    (folder / "model.xml").write_text(mjcf(links, f"<equality>{loops}</equality>"))
    code, out, err, cpu = answer(["show", folder / "model.xml"], capsys)
    assert cpu < CPU and "1800 constraint rows of rank 60" in out + err, (code, err)


def test_a_pipe_a_folder_and_a_huge_file_are_not_read(folder, capsys):
    os.mkfifo(folder / "pipe.xml")
    (folder / "folder.xml").mkdir()
    with open(folder / "huge.xml", "wb") as huge:
        huge.truncate(2**40)  # takes no place on the disk
    for name, words in {"pipe": "no ordinary file", "folder": "directory|no MJCF", "huge": "bytes, the limit is"}.items():
        for verb in ("show", "doctor"):
            code, _, err, cpu = answer([verb, folder / f"{name}.xml"], capsys)
            assert code == 1 and f"{name}.xml" in err and re.search(words, err) and cpu < CPU


def test_an_include_has_its_own_faults(folder, capsys):
    (folder / "model.xml").write_text(mjcf('<include file="part.xml"/>'))
    (folder / "part.xml").write_text('<mujocoinclude><body name="b"><joint name="j" axis="0 nan 1"/></body></mujocoinclude>')
    for verb in ("show", "doctor", "simulate"):
        code, _, err, _ = answer([verb, folder / "model.xml"], capsys)
        assert code == 1 and "part.xml" in err and "<joint name='j'>: axis='0 nan 1' is not finite" in err


def test_assets_beside_the_folder_of_the_model_are_read(folder, capsys):
    (folder / "robot" / "xml").mkdir(parents=True)
    (folder / "parts").mkdir()
    (folder / "parts" / "arm.xml").write_text(f"<mujocoinclude>{ARM}</mujocoinclude>")
    (folder / "robot" / "xml" / "model.xml").write_text(mjcf('<include file="../../parts/arm.xml"/>'))
    code, out, err, _ = answer(["show", folder / "robot" / "xml" / "model.xml"], capsys)
    assert code == 0 and err == "" and "arm" in out


# -- recordings ----------------------------------------------------------------------------------------------------------


def entries_of(path):
    with zipfile.ZipFile(path) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist()}


def pickled():
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    return stream.getvalue()


def npy(array):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array)
    return stream.getvalue()


def bomb(shape):
    """The head of an array of that shape, with zeros of a few kilobytes once packed."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue() + bytes(2**24)


def header(change):
    def changed(entries):
        stream = io.BytesIO(entries["header.npy"])
        data = json.loads(str(np.lib.format.read_array(stream)))
        change(data)
        return {"header.npy": npy(np.array(json.dumps(data)))}

    return changed


RECORDINGS = {
    "pickle as header": (lambda e: {"header.npy": pickled()}, "Object arrays cannot be loaded|not a recording"),
    "pickle as numbers": (lambda e: {"q.npy": pickled()}, "q: expected doubles"),
    "bomb as times": (lambda e: {"t.npy": bomb((2**40,))}, "t.npy has 16777344 bytes, its shape"),
    "bomb as coordinates": (lambda e: {"q.npy": bomb((2**21, 1))}, "q: expected the shape"),
    "bomb as header": (lambda e: {"header.npy": bytes(2**27)}, "its header has 134217728 bytes, the limit"),
    "bomb beside": (lambda e: {"other.npy": bytes(2**27)}, None),
    "times of 2**62": (lambda e: {"t.npy": bomb((2**62,))}, "its shape"),
    "negative shape": (lambda e: {"t.npy": bomb((-1,))}, "not a recording"),
    "nested header": (lambda e: {"header.npy": npy(np.array("[" * 100000))}, "nested too deeply|is not JSON"),
    "words as numbers": (lambda e: {"q.npy": npy(np.array(["a"]))}, "q: expected doubles"),
    "wrong shape": (lambda e: {"v.npy": npy(np.zeros((3, 3)))}, "v: expected the shape"),
    "NaN times": (lambda e: {"t.npy": npy(np.full(np.load(io.BytesIO(e["t.npy"])).shape, np.nan))}, "t: expected finite times"),
    "times backwards": (lambda e: {"t.npy": npy(np.load(io.BytesIO(e["t.npy"]))[::-1].copy())}, "increase strictly"),
    "schema of tomorrow": (header(lambda d: d.update(schema=99)), "schema 99"),
    "unknown key": (header(lambda d: d.update(other=1)), "'other'"),
    "no mechanism": (header(lambda d: d.pop("mechanism")), "lacks mechanism"),
    "NaN in the mechanism": (header(lambda d: d["mechanism"].update(gravity=[0, 0, float("nan")])), "mechanism"),
    "huge number": (header(lambda d: d["mechanism"].update(gravity=[0, 0, 1e200])), "beyond 1e\\+50"),
}  # fmt: skip


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return ml.simulate("pendulum", duration=0.05).save(tmp_path_factory.mktemp("recording") / "run.npz")


@pytest.mark.parametrize("name", RECORDINGS)
def test_a_hostile_recording_is_refused(name, recording, tmp_path, capsys):
    change, words = RECORDINGS[name]
    entries = entries_of(recording)
    path = tmp_path / "run.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, data in (entries | change(entries)).items():
            archive.writestr(entry, data)
    code, _, err, cpu = answer(["view", path, "--html", tmp_path / "page.html"], capsys)
    assert "internal error" not in err and cpu < CPU
    if words is None:  # what nobody asks for is not unpacked
        assert code == 0
        return
    assert code == 1 and re.search(words, err), err


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.99])
def test_a_recording_that_is_cut_is_refused(share, recording, tmp_path, capsys):
    data = Path(recording).read_bytes()
    (tmp_path / "run.npz").write_bytes(data[: int(share * len(data))])
    code, _, err, _ = answer(["view", tmp_path / "run.npz", "--html", tmp_path / "page.html"], capsys)
    assert code == 1 and "run.npz" in err and "internal error" not in err
