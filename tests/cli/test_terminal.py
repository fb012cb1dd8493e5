"""On a terminal a table fits the width; elsewhere the text is as it was. And the words for the TAB key."""

import shutil
import subprocess

import pytest

from mechlab.cli import main, output
from mechlab.cli.completion import script
from mechlab.cli.terminal import fitted
from mechlab.cli.verbs import VERBS
from mechlab.tables import table

HEADS = ("name", "what it is", "")
ROWS = [("first", "a sentence that is longer than the terminal is wide", "x"), ("second", "[short]", "yes")]
TEXT = "\n".join(
    [
        "Title",
        "=====",
        table(HEADS, ROWS),
        "a line behind it that is as long as it likes to be, and no table",
        "",
        "end",
    ]
)


def words(text: str) -> list[str]:
    return [w for w in text.replace("─", " ").replace("-", " ").split() if w]


@pytest.mark.parametrize("width", [30, 40, 50])
def test_a_wide_table_is_laid_out_to_the_width(width: int) -> None:
    lines = fitted(TEXT, width).split("\n")
    behind = next(k for k, line in enumerate(lines) if line.startswith("a line behind"))
    assert all(len(line) <= width for line in lines[:behind]) and len(lines) > TEXT.count("\n") + 1
    assert sorted(words("\n".join(lines))) == sorted(words(TEXT))
    assert lines[:2] == ["Title", "====="] and lines[behind:] == TEXT.split("\n")[-3:]


def test_a_table_that_fits_stays() -> None:
    assert fitted(TEXT, 200) == TEXT and fitted("", 10) == ""


def test_only_a_terminal_gets_another_text(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    piped = capsys.readouterr().out
    assert max(map(len, piped.split("\n"))) > 200
    monkeypatch.setattr(output, "width_of_stdout", lambda: 100)
    assert main(["list"]) == 0
    shown = capsys.readouterr().out
    assert max(map(len, shown.split("\n"))) <= 100
    assert all(word in shown.replace("\n", " ") for word in ("fourbar", "Class IV", "delta6"))


def test_completion_knows_verbs_options_engines_and_the_catalog() -> None:
    text = script()
    assert all(f"        {verb}) words=" in text for verb in VERBS)
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("needs bash")

    def offered(*typed: str) -> set[str]:
        line = f"COMP_WORDS=({' '.join(repr(w) for w in typed)}); COMP_CWORD={len(typed) - 1}; _mechlab; echo ${{COMPREPLY[*]}}"
        done = subprocess.run([bash, "-c", f"{text}\n{line}"], capture_output=True, text=True, check=True, timeout=60)
        return set(done.stdout.split())

    assert offered("mechlab", "s") == {"show", "solve", "simulate", "sweep", "stability", "synthesize"}
    assert offered("mechlab", "simulate", "fourbar", "--max") == {"--max-error"}
    assert offered("mechlab", "simulate", "fourbar", "--engine", "") == {
        "file",
        "mujoco",
        "pinocchio",
        "hybrid",
        "one_freedom",
        "analytic",
    }
    assert offered("mechlab", "solve", "del") == {"delta6"}


def test_the_script_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--completion"]) == 0
    assert capsys.readouterr().out == script() + "\n"
