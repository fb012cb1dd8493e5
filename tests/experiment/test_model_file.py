"""What is left out of a model file: as a warning in Python, in every verb's text and JSON."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

import mechlab as ml
from mechlab.api import finding
from mechlab.cli import main
from mechlab.errors import LeftOutWarning
from mechlab.experiment.model_file import LeftOut, ModelFile
from mechlab.experiment.recording import Finding, Health

LEFT = (LeftOut("sensor", ("gyro", "touch"), "mechlab has its own channels"), LeftOut("contact", ("a", "b", "c", "d", "e"), "", True))


@pytest.fixture
def partly_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "robot.urdf"
    path.write_text(ml.to_urdf(ml.load("pendulum").mechanism()))
    whole = finding.read_file(path)
    monkeypatch.setattr(finding, "read_file", lambda p: ModelFile(p, whole.kind, whole.mechanism, LEFT, ("loop l was closed by 2e-8 m",)))
    return path


def test_a_sentence_names_four_and_counts_the_others() -> None:
    assert LEFT[0].sentence == "2 x sensor (gyro, touch): mechlab has its own channels"
    assert LEFT[1].sentence == "5 x contact (a, b, c, d and 1 more); kept in a run of the file as it is"


def test_python_gets_one_warning_that_carries_the_file(partly_read: Path) -> None:
    with pytest.warns(LeftOutWarning, match=r"robot.urdf: left out: 2 x sensor .*loop l was closed by 2e-8 m") as caught:
        design = ml.load(partly_read)
    assert design.left_out == LEFT
    assert [w.message.file.path for w in caught if isinstance(w.message, LeftOutWarning)] == [partly_read]


@pytest.mark.parametrize("verb", ["show", "simulate"])
def test_every_verb_says_it_in_text_and_json(verb: str, partly_read: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([verb, str(partly_read)]) == 0
    text = capsys.readouterr().out
    assert text.count("gyro, touch") == 1 and "loop l was closed by 2e-8 m" in text
    assert main([verb, str(partly_read), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [x["what"] for x in document["left_out"]] == ["sensor", "contact"]
    assert document["left_out"][1]["names"] == ["a", "b", "c", "d", "e"] and document["left_out"][1]["kept"]
    assert document["reading"] == ["loop l was closed by 2e-8 m"]


def test_a_file_that_was_read_whole_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(ml.to_urdf(ml.load("pendulum").mechanism()))
    assert main(["show", str(path), "--json"]) == 0
    assert "left_out" not in json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(("words", "code"), [(["show", "length=-1"], 1), (["modes", "angle_rate_0=1"], 1), (["solve", "angle_9=1"], 1)])
def test_a_document_of_a_failure_says_it_too(
    words: list[str], code: int, partly_read: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file was read, then the question was refused."""
    assert main([words[0], str(partly_read), *words[1:], "--json"]) == code
    document = json.loads(capsys.readouterr().out)
    assert document["error"]["message"] and document["exit_code"] == code
    assert [x["what"] for x in document["left_out"]] == ["sensor", "contact"]
    assert document["reading"] == ["loop l was closed by 2e-8 m"]


def test_several_files_are_all_told_of(partly_read: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "other.urdf"
    other.write_text(partly_read.read_text())
    main(["check", str(partly_read), str(other), "--json"])
    document = json.loads(capsys.readouterr().out)
    assert [x["what"] for x in document["left_out"]] == ["sensor", "contact"] * 2 and len(document["reading"]) == 2


def test_a_page_of_a_doubtful_run_says_what_is_doubtful(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ml.simulate("pendulum", duration=0.01)
    torn = Health((Finding("gap", 1.0, 1e-3, "m", "error", "the loop is open"),))
    path = ml.save_recording(replace(run, health=run.health + torn), tmp_path / "run.npz")
    assert main(["view", str(path), "--html", str(tmp_path / "page.html"), "--json"]) == 3
    document = json.loads(capsys.readouterr().out)
    assert document["status"] == "not to be trusted" and document["message"] == "the loop is open"
