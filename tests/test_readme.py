"""The README against what is measured: its commands run, its limits are seen in the product, its numbers have a source."""

import re
import shlex
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab import errors
from mechlab.cli import main
from mechlab.experiment.question import TOLERANCE
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.formats.urdf import to_urdf
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
SHORTER = {
    "--duration 3 --at 1,3": "--duration 0.02 --at 0.01,0.02",
    "check delta6": "check pendulum",
    "claims delta6": "claims pendulum",
    "doctor model.xml": "doctor model/delta6.xml",
}
"""What is run in place of a command that takes long, or that needs a file of the reader's."""
NOT_RUN = ("chart", "optimize")
"""Half a minute each; that their options exist is tested here, that they work in tests/test_options.py."""


def commands() -> list[str]:
    """The commands of the section Use, without their remarks."""
    block = re.search(r"## Use\n+```sh\n(.*?)```", TEXT, re.S)
    assert block is not None
    lines = [line.split("#")[0] for line in block[1].splitlines()]
    return [c.strip() for line in lines for c in line.split(";") if c.strip()]


@pytest.mark.parametrize("command", commands())
def test_every_option_of_the_readme_exists(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    program, verb, *words = shlex.split(command)
    assert program == "mechlab"
    try:
        assert main([verb, "--help"]) == 0
    except SystemExit as stop:
        assert stop.code == 0
    known = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", capsys.readouterr().out))
    assert {w.split("=")[0] for w in words if w.startswith("-")} <= known


def test_the_commands_of_the_readme_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for command in commands():
        for given, short in SHORTER.items():
            command = command.replace(given, short)
        words = shlex.split(command)[1:]
        if words[0] not in NOT_RUN:
            assert main(words) == 0, f"{command}\n{capsys.readouterr().err}"
    for name in ("run.npz", "run.html", "model/delta6.xml", "cycle.svg", "sweep.png", "modes.html"):
        assert (tmp_path / name).stat().st_size > 1000, name


def closed(kind: str) -> Mechanism:
    """A four-bar that a loop of the kind closes, or a bar of constant length in place of the coupler."""
    b = Builder("closed", gravity=(0.0, -9.81, 0.0))
    b.bar("crank", revolute("a"), 0.1)
    b.bar("rocker", revolute("r"), 0.3, at=(0.35, 0.0, 0.0))
    if kind == "distance":
        b.loop("rod", "crank", "rocker", (0.1, 0.0, 0.0), (0.3, 0.0, 0.0), kind="distance", length=0.4)
        return b.assemble({"a": 1.0, "r": 1.3}, hold=["a"])
    b.bar("coupler", revolute("c"), 0.4, parent="crank", at=(0.1, 0.0, 0.0))
    b.loop("pin", "coupler", "rocker", (0.4, 0.0, 0.0), (0.3, 0.0, 0.0), kind=kind)
    return b.assemble({"a": 1.0, "c": -0.3, "r": 1.3}, hold=["a"])


def geared() -> Mechanism:
    """Three wheels on the ground and one gear mesh among three joints: two joints are free."""
    b = Builder("geared")
    for k, name in enumerate("abc"):
        b.body(name, revolute(f"{name}_angle"), at=(float(k), 0.0, 0.0), inertia=Inertia.cylinder(1.0, 0.1, 0.1))
    b.relation("sum", a_angle=1, b_angle=1, c_angle=-2)
    return b.build()


def rigid_ideal_and_without_contacts() -> None:
    text = to_mjcf(closed("spherical"))
    assert 'contype="0" conaffinity="0"' in text
    assert "contype" not in to_mjcf(closed("spherical"), contacts=True)
    assert "flexcomp" not in text and "deformable" not in text and "backlash" not in text


def gaps_of_mujoco_are_small_and_not_zero() -> None:
    """The gap of the loop is measured by our own kinematics, at the recorded coordinates."""
    m = closed("spherical")
    run = ml.simulate(m, scene="free-motion", engine="mujoco", duration=0.3)
    crank, coupler, rocker = (np.asarray(run.channels[n]) for n in ("a", "c", "r"))
    end = 0.1 * np.exp(1j * crank) + 0.4 * np.exp(1j * (crank + coupler))
    gap = float(np.abs(end - 0.35 - 0.3 * np.exp(1j * rocker)).max())
    assert 1e-12 < gap < 1e-4
    stated = next(f.value for f in run.health.findings if f.name == "loop_gap")
    assert 0.5 * gap < stated < 2.0 * gap  # the finding takes the largest coordinate, at more times


def a_distance_loop_is_a_tendon() -> None:
    text = to_mjcf(closed("distance"))
    assert re.search(r'<tendon name="rod" tendon1=', text) and "<connect" not in text


def urdf_has_a_tree_alone() -> None:
    text = to_urdf(closed("spherical")) + to_urdf(geared())
    assert "pin" not in re.findall(r'name="(\w+)"', text) and "<mimic" not in text and "loop" not in text


def times_are_those_of_a_machine() -> None:
    page = (ROOT / "assets" / "chart_n_fourbar.svg").read_text(encoding="utf-8")
    assert "CPU time" in page and "no error printed" in page


LIMITS: dict[str, Callable[[], None]] = {
    "Rigid bodies with constant mass; ideal joints; gear meshes without backlash": rigid_ideal_and_without_contacts,
    "the gap is small and reported, never zero": gaps_of_mujoco_are_small_and_not_zero,
    "A `distance` loop is a tendon in MJCF": a_distance_loop_is_a_tendon,
    "URDF has no loops and no gears": urdf_has_a_tree_alone,
    "Times in charts are those of the machine": times_are_those_of_a_machine,
}
"""Each item of the section Limitations, by words of it, and the measurement that shows it."""


def limitations() -> list[str]:
    section = TEXT.split("## Limitations\n")[1].split("\n[CONTRIBUTING")[0]
    return re.findall(r"^- (.*)$", section, re.M)


def test_readme_is_honest_about_every_limit() -> None:
    """No limit without a measurement, and no measured limit that the README leaves out."""
    for item in limitations():
        assert sum(words in item for words in LIMITS) == 1, item
    for words in LIMITS:
        assert sum(words in item for item in limitations()) == 1, words


@pytest.mark.parametrize("words", LIMITS)
def test_a_limit_is_as_the_readme_says(words: str) -> None:
    LIMITS[words]()


def test_numbers_of_the_readme_have_a_source() -> None:
    log = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").replace("\n", " ")
    campaign = re.search(
        r"Of (\d+) random runs.*?never below a third of the true one.*?of (\d+) channels (\d+) were below a\s+third",
        log,
    )
    assert campaign is not None
    runs, channels, low = map(int, campaign.groups())
    stated = re.search(r"In (\d+) random runs .*?never below a third .*?of all channels in ([\d.]+) %", TEXT, re.S)
    assert stated is not None and int(stated[1]) == runs
    assert float(stated[2]) == round(100.0 * low / channels, 1)
    agree = re.search(r"its witnesses agree to (\S+?)\.", TEXT)
    assert agree is not None and float(agree[1]) == TOLERANCE
    python = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["requires-python"]
    assert f"Python {python.removeprefix('>=')} or newer" in TEXT
    chart = (ROOT / "assets" / "chart_n_fourbar.svg").read_text(encoding="utf-8")
    headline = re.search(r"\[!\[(.*?)\]\(assets/chart_n_fourbar.svg\)", TEXT)
    assert headline is not None and headline[1] in chart


def test_the_readme_counts_the_mechanisms() -> None:
    from mechlab import catalog

    assert f": {len(catalog.NAMES)} mechanisms" in TEXT


def test_exit_codes_of_the_readme_are_those_of_the_errors() -> None:
    stated = {
        int(code): words
        for code, words in re.findall(r"(\d) ([a-z][\w' ]+)", TEXT.split("Exit codes: ")[1].split("\n")[0])
    }
    assert set(stated) == {0, 1, 2, 3, 4}
    for error, words in (
        (errors.MechlabError, "bad input"), (errors.UsageError, "usage"), (errors.Untrustworthy, "do not trust"),
        (errors.NoSolution, "no solution"),
    ):  # fmt: skip
        assert words in stated[error.exit_code]
