"""The ways of a parameter and of an option through the code are those that CONTRIBUTING.md lists."""

from __future__ import annotations

import dataclasses
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from mechlab.cli import main

ROOT = Path(__file__).resolve().parents[1]
DEEP = 4
"""Levels of tuples, mappings and dataclasses in which a number is looked for."""


def lists_of_files() -> list[list[str]]:
    """The numbered lists of the section, each as the files at the beginning of its lines."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = text.split("## A parameter's way\n")[1].split("\n## ")[0]
    found: list[list[str]] = []
    for number, file in re.findall(r"^(\d+)\. `(mechlab/[\w/]+\.py)`", section, re.M):
        if number == "1":
            found.append([])
        found[-1].append(file)
    return found


def holds(value: Any, number: float, deep: int = DEEP) -> bool:
    """Whether a value is the number, its text, or contains it."""
    if isinstance(value, float):
        return abs(value - number) < 1e-15
    if isinstance(value, str):
        return str(number) in value
    if deep == 0 or isinstance(value, type):
        return False
    if isinstance(value, Mapping):
        return any(holds(x, number, deep - 1) for x in value.values())
    if isinstance(value, tuple | list):
        return any(holds(x, number, deep - 1) for x in value)
    if dataclasses.is_dataclass(value):
        return any(holds(getattr(value, f.name, None), number, deep - 1) for f in dataclasses.fields(value))
    return False


def arguments(frame: FrameType) -> Iterator[Any]:
    code = frame.f_code
    count = code.co_argcount + code.co_kwonlyargcount + bool(code.co_flags & 4) + bool(code.co_flags & 8)
    return (frame.f_locals[name] for name in code.co_varnames[:count] if name in frame.f_locals)


def files_passed(command: list[str], number: float, files: list[str]) -> list[str]:
    """Those of the files whose functions are called with the number, in the order of the first call."""
    left = {str(ROOT / file): file for file in files}
    passed: list[str] = []

    def watch(frame: FrameType, event: str, _: Any) -> None:
        file = frame.f_code.co_filename
        if event == "call" and file in left and any(holds(x, number) for x in arguments(frame)):
            passed.append(left.pop(file))

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        assert main(command) == 0
    finally:
        sys.setprofile(before)
    return passed


@pytest.mark.parametrize(("way", "number", "command"), [
    (0, 0.1234567, "generate fourbar crank=0.1234567 -o {out}"),
    (1, 0.000234567, "simulate n_fourbar --max-error 0.000234567 --duration 0.2"),
])  # fmt: skip
def test_a_number_passes_the_files_that_are_listed_in_their_order(way, number, command, tmp_path, capsys):
    files = lists_of_files()[way]
    assert len(files) >= 8
    assert len(set(files)) == len(files)  # no file twice
    assert files_passed(command.format(out=tmp_path / "out").split(), number, files) == files
