"""Strangers' files are compiled in a child process first: crashes, endless runs and huge sizes end in words, and cost little."""

from pathlib import Path

import mujoco
import pytest

from mechlab.engines.mujoco.model_file import guarded
from mechlab.engines.mujoco.model_file.guarded import ModelCrashed, ModelRefused, load_file, load_text
from mechlab.errors import MechlabError

ARM = '<body><joint/><geom size=".1"/></body>'


def mjcf(body=ARM, before=""):
    return f"<mujoco>{before}<worldbody>{body}</worldbody></mujoco>"


CRASHING = {
    "height field of 14 GB": mjcf(
        ARM + '<geom type="hfield" hfield="h"/>', '<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>'
    ),
}
REFUSED = {
    "arena of 200 GB": (mjcf(before='<size memory="200G"/>'), "Could not allocate memory"),
    "texture of 10 GB": (
        mjcf(before='<asset><texture type="2d" name="t" builtin="flat" width="60000" height="60000"/></asset>'),
        "Could not allocate memory for texture",
    ),
    "geom without size": (mjcf("<body><joint/><geom/></body>"), "Error"),
}


def both(text, tmp_path):
    """The error for the text as a file and as a text."""
    path = tmp_path / "model.xml"
    path.write_text(text)
    found = []
    for load in (lambda: load_file(path), lambda: load_text(text)):
        with pytest.raises(ModelRefused) as error:
            load()
        found.append(error.value)
    return found


@pytest.mark.parametrize("name", CRASHING)
def test_a_crash_ends_in_words(name, tmp_path):
    for error in both(CRASHING[name], tmp_path):
        assert isinstance(error, ModelCrashed) and "MuJoCo" in str(error)


@pytest.mark.parametrize("name", REFUSED)
def test_a_refusal_has_the_words_of_the_engine(name, tmp_path):
    text, words = REFUSED[name]
    for error in both(text, tmp_path):
        assert words in str(error) and not isinstance(error, ModelCrashed)


def test_refusals_in_the_child_read_as_in_this_process():
    text = mjcf("<body><joint/></body>")
    with pytest.raises(ValueError) as here:
        mujoco.MjModel.from_xml_string(text)
    with pytest.raises(ModelRefused) as there:
        load_text(text)
    assert str(there.value) == " ".join(str(here.value).split())


@pytest.fixture
def children(monkeypatch):
    """A list that grows by one with each child process."""
    started = []
    run = guarded.subprocess.run
    monkeypatch.setattr(guarded.subprocess, "run", lambda *a, **k: started.append(1) or run(*a, **k))
    return started


def test_an_endless_compilation_ends_and_is_remembered(monkeypatch, children, tmp_path):
    path = tmp_path / "copies.xml"
    path.write_text(mjcf(f'<replicate count="100000000">{ARM}</replicate>'))
    monkeypatch.setattr(guarded, "WALL", 0.5)
    for _ in range(3):
        with pytest.raises(ModelCrashed, match="does not end compiling it within"):
            load_file(path)
    assert len(children) == 1


def test_the_verdict_holds_for_the_same_bytes_at_the_same_place(children, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(mjcf() + "<!-- once -->")
    models = [load_file(path) for _ in range(3)]
    assert len(children) == 1 and {m.nv for m in models} == {1}
    path.write_text(mjcf(ARM + ARM) + "<!-- changed -->")
    assert load_file(path).nv == 2 and len(children) == 2


def test_includes_beside_a_linked_file_are_found(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "here").mkdir()
    (tmp_path / "there" / "model.xml").write_text(mjcf('<include file="part.xml"/>'))
    (tmp_path / "here" / "part.xml").write_text(f"<mujocoinclude>{ARM}</mujocoinclude>")
    link = tmp_path / "here" / "model.xml"
    link.symlink_to(tmp_path / "there" / "model.xml")
    assert load_file(link).nv == mujoco.MjModel.from_xml_path(str(link)).nv == 1


def test_faults_and_far_files_are_refused_before_the_engine_sees_them(children, tmp_path):
    path = tmp_path / "model.xml"
    for text, words in {
        mjcf("<body>" * 5000 + "</body>" * 5000): "nested more than 500 deep",
        mjcf('<body foo="1"/>'): "MuJoCo knows no attribute 'foo' here",
        mjcf(before='<asset><mesh file="/dev/zero"/></asset>'): "leads out of the folder of the model",
    }.items():
        path.write_text(text)
        with pytest.raises(MechlabError, match=words):
            load_file(path)
    assert not children


def test_a_missing_file_is_named():
    with pytest.raises(ModelRefused, match="No such file"):
        load_file(Path("nowhere.xml"))
