"""A user's own mechanism: the file that the README shows, through every verb; its mistakes told in its own names."""

import re
from pathlib import Path

import pytest

from mechlab.cli import main

README = Path(__file__).parents[2] / "README.md"


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    code = re.search(r"```python\n(import mechlab as ml\n\n.*?)```", README.read_text(), re.S)
    assert code, "README.md shows no mechanism"
    assert len(code[1].splitlines()) <= 24
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "my.py"
    path.write_text(code[1])
    return path


@pytest.mark.parametrize(
    "words",
    [
        "show my.py:rocker",
        "solve my.py:rocker motor=0.2 motor_rate=1 --json",
        "simulate my.py:rocker crank_angle_rate_0=2 --duration 0.3",
        "generate my.py:rocker -o g",
        "check my.py:rocker",
        "view my.py:rocker --html page.html",
    ],
)
def test_every_verb_works_on_it(source: Path, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 0, capsys.readouterr().err


def test_run(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main("run my.py:rocker -o out".split()) == 0, capsys.readouterr().err
    assert {"rocker.xml", "rocker.urdf", "rocker.json", "run.npz", "rocker.html"} <= {
        p.name for p in Path("out").iterdir()
    }
    assert main("show out/rocker.json".split()) == 0
    assert main("show out/rocker.xml".split()) == 0
    assert main("show out/rocker.urdf".split()) == 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('parent="crank"', 'parent="crnk"', "'crnk' does not exist"),
        ('"motor", "crank_angle"', '"motr", "crank_angle"', "'motr' does not exist. Did you mean 'motor'"),
        ("rocker=0.25", "rocker=0.01", "pin"),
        ("inertia=ml.Inertia.cylinder(0.2, 0.04, 0.015), ", "", "'pinion' moves but has no mass"),
        ("def rocker(crank=0.1", "def rocker(crank", "needs a default"),
        ("return b.assemble", "b.assemble", "returned NoneType"),
        ("import mechlab as ml", "import mechlab as ml\nx = 1 +", "line 2"),
    ],
)
def test_mistakes_are_told_in_its_own_names(
    source: Path, old: str, new: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = source.read_text()
    assert old in text
    source.write_text(text.replace(old, new, 1))
    assert main("generate my.py:rocker -o g".split()) == 1
    error = capsys.readouterr().err
    assert message in error and "Traceback" not in error
    assert not Path("g").exists()


def test_show_tells_the_grashof_class(capsys: pytest.CaptureFixture[str]) -> None:
    assert main("show fourbar".split()) == 0  # 0.1 + 0.3 < 0.25 + 0.3, the crank is shortest
    assert "crank-rocker" in capsys.readouterr().out
    assert main("show fourbar crank=0.29 --json".split()) == 0  # 0.25 + 0.3 < 0.29 + 0.3, the rocker is shortest
    assert "crank-rocker" not in capsys.readouterr().out
