"""The two commands that the help of a verb ends with run; an option that does not exist gets the nearest name; the greeting."""

from __future__ import annotations

import itertools
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main, output
from mechlab.cli.examples import EXAMPLES
from mechlab.cli.verbs import VERBS

SAMPLE = ("list", "solve", "simulate", "check")
"""Verbs whose examples plain `pytest` runs; `pytest -m printed` runs all others."""
NEEDS = {"doctor": EXAMPLES["generate"][0], "view": EXAMPLES["simulate"][0]}
"""Verb -> the command that makes the file which its examples read."""


def measure() -> None:
    """measured.csv: a crank angle of the four-bar with the noise of an encoder."""
    run = ml.simulate("fourbar", scene="constant-torque", crank=0.105, duration=0.4)
    noise = np.random.default_rng(3).normal(0.0, 1e-3, 41)
    rows = [f"{t:.3f},{run.at('crank_angle', t) + e:.6f}" for t, e in zip(np.linspace(0.0, 0.4, 41), noise, strict=True)]
    Path("measured.csv").write_text("\n".join(["t [s],crank_angle [rad]", *rows, ""]))


def rows_of_tables(text: str) -> list[str]:
    """The lines around each rule, up to the next line without a gap of two columns."""
    lines = text.split("\n")
    out: list[str] = []
    for k, line in enumerate(lines):
        if re.fullmatch(r" *(-{2,}|\u2500{2,})( +(-+|\u2500+))* *", line):
            out += [lines[k - 1], line, *itertools.takewhile(lambda row: "  " in row.strip(), lines[k + 1 :])]
    return out


def test_every_verb_has_two() -> None:
    assert EXAMPLES.keys() == VERBS.keys()
    for verb, commands in EXAMPLES.items():
        assert len(set(commands)) == 2 and all(c.startswith(f"mechlab {verb}") for c in commands)


@pytest.mark.parametrize("verb", [v if v in SAMPLE else pytest.param(v, marks=pytest.mark.printed) for v in VERBS])
def test_they_run(verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """And their tables fit a terminal of 80 columns."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(output, "width_of_stdout", lambda: 80)
    if verb == "fit":
        measure()
    for command in (*([NEEDS[verb]] if verb in NEEDS else []), *EXAMPLES[verb]):
        assert main(shlex.split(command)[1:]) == 0, (command, capsys.readouterr().err)
        assert not [row for row in rows_of_tables(capsys.readouterr().out) if len(row) > 80], command
    for command in EXAMPLES[verb]:
        words = shlex.split(command)
        if "-o" in words:
            assert (tmp_path / words[words.index("-o") + 1]).exists()


def test_the_help_ends_with_them(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for width in ("80", "120"):
        monkeypatch.setenv("COLUMNS", width)
        assert main(["solve", "--help"]) == 0
        assert capsys.readouterr().out.splitlines()[-3:] == ["examples:", *(f"  {c}" for c in EXAMPLES["solve"])]


@pytest.mark.parametrize(
    ("command", "near"),
    [
        ("simulate fourbar --timstep 1e-3", "--timestep"),
        ("simulate fourbar --max_error=1mm", "--max-error"),
        ("sweep fourbar crank=1:2 --quantiy x", "--quantity"),
        ("doctor a.xml --fxi", "--fix"),
    ],
)
def test_the_nearest_option_is_suggested(command: str, near: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(command.split()) == 2
    said = capsys.readouterr().err
    assert f"Did you mean '{near}'?" in said and said.count("\n") == 1


def test_the_bare_command_greets_with_three_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    lines = [x.strip() for x in capsys.readouterr().out.splitlines()]
    commands = [x.split("  ")[0].split()[1:] for x in lines if x.startswith("mechlab ") and "  " in x]
    assert [c[0] for c in commands] == ["solve", "run", "list"]
    assert main(commands[0]) == 0 and main(commands[2]) == 0  # run: see test_they_run
    assert "run " + " ".join(commands[1][1:]) == EXAMPLES["run"][0].removeprefix("mechlab ")
