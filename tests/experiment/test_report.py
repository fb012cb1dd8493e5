"""How results are printed: one line in a shell, and the same table from Python as from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechlab as ml
from mechlab.cli import main


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    capsys.readouterr()
    main(list(arguments))
    return capsys.readouterr().out


def without_cost(text: str) -> list[str]:
    """The CPU time differs from one run to the next."""
    return [line for line in text.splitlines() if not line.startswith("cost:")]


def test_a_recording_is_one_line_and_prints_the_table_of_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    run = ml.simulate("pendulum", duration=0.1, at=(0.05,))
    assert repr(run) == f"Recording of pendulum, scene {run.scene}, 0.1 s, {len(run.t)} samples, trusted"
    assert without_cost(f"{run}\n") == without_cost(
        printed(capsys, "simulate", "pendulum", "--duration", "0.1", "--at", "0.05")
    )
    assert [s["t"] for s in run.samples()] == [0.05] and run.samples()[0]["angle"] == run.at("angle", 0.05)


def test_answers_are_one_line_and_print_the_table_of_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    answers = ml.solve("fourbar", crank_angle=1.0)
    assert repr(answers).startswith("Answers of analytic, pinocchio, mujoco to the question ") and "\n" not in repr(
        answers
    )
    assert f"{answers}\n" == printed(capsys, "solve", "fourbar", "crank_angle=1")


def test_a_design_is_one_line_and_prints_what_show_shows(capsys: pytest.CaptureFixture[str]) -> None:
    design = ml.load("fourbar", crank=0.03)
    assert repr(design).startswith("Design of fourbar: ") and repr(design).endswith(" with crank=0.03")
    assert f"{design}\n" == printed(capsys, "show", "fourbar", "crank=0.03")
    design.show("minimal")
    assert "Fidelity minimal" in capsys.readouterr().out


def test_a_recording_saves_itself(tmp_path: Path) -> None:
    run = ml.simulate("pendulum", duration=0.1)
    again = ml.load_recording(run.save(tmp_path / "run.npz"))
    assert (again.t == run.t).all() and repr(again) == repr(run)
