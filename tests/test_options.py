"""Every option of every verb changes what comes back, or is refused with a sentence that names it; none is passed over.

The table is held against the argument parsers: an option that is not in it fails the test. Keywords: test_keywords.py.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from mechlab import api
from mechlab.cli import main
from mechlab.cli.options import parser_of, routes_of
from mechlab.cli.verbs import VERBS

IGNORED = {
    "parameters",
    "names",
    "versions",
    "files",
    "cost",
    "command",
    "fingerprint",
    "message",
    "wall_time",
    "evaluations",
}
"""What a document says about the question or the machine, and not about the answer."""


@dataclass(frozen=True)
class Differ:
    """Two command lines whose answers must differ: `plain`, and the same with `more`. slow: left to the slow tests."""

    plain: str
    more: str
    slow: bool = False


@dataclass(frozen=True)
class Writes:
    """A command line that writes a file."""

    words: str
    file: str
    slow: bool = False


@dataclass(frozen=True)
class Refused:
    """A command line that is refused with a message in which `text` stands."""

    words: str
    text: str
    slow: bool = False


MODELS = f"{Path(__file__).parents[1]}/models/pendulum"
SWEEP = "sweep pendulum length=0.5,1.5 --duration 0.05"
CHART = "chart pendulum --duration 0.1"
VIEW = "view pendulum duration=0.2"
TRACK = "track fourbar crank_angle=1:2:5"
FIT = f"fit fourbar {Path(__file__).parent}/studies/measured_angles.csv crank=.05:.2"
FIT_RUN = f"fit pendulum {Path(__file__).parent}/studies/measured_swing.csv length=.5:2"
STABLE = "stability fourbar coupler_mass=1e-3:1e3:3 --budget 1 --scene free-run --methods RK4"

COMMANDS: dict[tuple[str, str], list[Differ | Writes | Refused]] = {
    ("run", "-o"): [Writes("run pendulum duration=0.2 -o {}/r", "r/pendulum.xml", slow=True)],
    ("list", "--family"): [Differ("list", "--family press"), Refused("list --family no", "family 'no'")],
    ("list", "--freedoms"): [Differ("list", "--freedoms 2"), Refused("list --freedoms 5", "5 freedoms")],
    ("list", "--motion"): [Differ("list", "--motion spatial"), Refused("list --motion no", "'no'")],
    ("list", "--search"): [Differ("list", "--search dwell")],
    ("show", "--fidelity"): [Differ("show delta6", "--fidelity full"), Refused("show fourbar --fidelity no", "'no'")],
    ("generate", "-o"): [Writes("generate pendulum -o {}", "pendulum.xml")],
    ("generate", "--also"): [
        Differ("generate fourbar -o {}", "--also ros2"), Refused("generate fourbar -o {} --also stp", "'stp'"),
        Refused("generate --catalog -o {} --also sdf", "--also"),
    ],
    ("generate", "--fidelity"): [
        Differ("generate closed_differential -o {}", "--fidelity minimal"),
        Refused("generate --catalog -o {} --fidelity full", "--fidelity"),
    ],
    ("generate", "--catalog"): [
        Refused("generate crank=2 --catalog -o {}", "crank"),
        Writes("generate pendulum --catalog -o {}", "pendulum/README.md", slow=True),
    ],
    ("solve", "--sensitivity"): [Differ("solve fourbar crank_angle=1", "--sensitivity --of coupler")],
    ("solve", "--tolerance"): [Differ("solve fourbar crank_angle=1 --of coupler", "--tolerance coupler=1mm")],
    ("solve", "--of"): [Differ("solve fourbar crank_angle=1 --sensitivity", "--of coupler")],
    ("simulate", "--scene"): [Differ("simulate fourbar --duration 0.05", "--scene free-run")],
    ("simulate", "--duration"): [Differ("simulate pendulum --duration 0.1", "--duration 0.2")],
    ("simulate", "--timestep"): [
        Differ("simulate pendulum --duration 0.1", "--timestep 0.02"),
        Refused("simulate pendulum --duration 0.1 --engine analytic --timestep 0.01", "timestep"),
        Refused("simulate pendulum --timestep 0.01 --max-error 1e-3", "--timestep"),
    ],
    ("simulate", "--max-error"): [
        Differ("simulate pendulum --duration 0.1", "--max-error 1e-6"),
        Refused("simulate pendulum --duration 0.1 --engine analytic --max-error 1e-3", "max_error"),
    ],
    ("simulate", "--budget"): [
        Differ("simulate fourbar --duration 0.1 --max-error 1e-10", "--budget 0.01"),
        Refused("simulate pendulum --budget 1", "budget"),
    ],
    ("simulate", "--engine"): [Differ("simulate pendulum --duration 0.1", "--engine pinocchio")],
    ("simulate", "--order-check"): [
        Differ("simulate pendulum --duration 0.1", "--order-check"),
        Refused("simulate pendulum --duration 0.1 --engine analytic --order-check", "order"),
    ],
    ("simulate", "--fidelity"): [Differ("simulate closed_differential --duration 0.05", "--fidelity parts")],
    ("simulate", "--at"): [
        Differ("simulate pendulum --duration 0.1", "--at 0.05"),
        Refused("simulate pendulum --duration 0.1 --at 9", "outside"),
    ],
    ("simulate", "-o"): [Writes("simulate pendulum --duration 0.1 -o {}/a.npz", "a.npz")],
    ("sweep", "--quantity"): [Differ(SWEEP, "--quantity angle_rate")],
    ("sweep", "--witness"): [
        Differ("sweep fourbar crank_angle=0:1:3", "--witness pinocchio"), Refused(f"{SWEEP} --witness mujoco", "--witness"),
    ],
    ("sweep", "--scene"): [
        Differ("sweep fourbar crank=.09,.1 --duration 0.02 --quantity rocker_angle_rate", "--scene free-run"),
        Refused("sweep fourbar crank_angle=0:1:3 --scene free-run", "--scene"),
    ],
    ("sweep", "--duration"): [Differ(SWEEP, "--duration 0.1"), Refused("sweep fourbar crank_angle=0:1:3 --duration 1", "--duration")],
    ("sweep", "--timestep"): [Differ(SWEEP, "--timestep 0.025"), Refused("sweep fourbar crank_angle=0:1:3 --timestep 1", "--timestep")],
    ("sweep", "--engine"): [Differ(SWEEP, "--engine pinocchio"), Refused("sweep fourbar crank_angle=0:1:3 --engine mujoco", "--engine")],
    ("sweep", "--fidelity"): [
        Refused("sweep fourbar crank_angle=0:1:3 --fidelity minimal", "--fidelity"), Refused(f"{SWEEP} --fidelity no", "'no'"),
    ],
    ("sweep", "--backend"): [
        Differ(SWEEP, "--backend mujoco"), Refused(f"{SWEEP} --backend no", "'no'"),
        Refused("sweep fourbar crank_angle=0:1:3 --backend warp", "--backend"),
        Refused(f"{SWEEP} --quantity angle_accel --backend warp", "angle_accel takes more than the states"),
    ],
    ("sweep", "-o"): [Writes(f"{SWEEP} -o {{}}/a.nc", "a.nc")],
    ("sweep", "--plot"): [Writes(f"{SWEEP} --plot {{}}/a.svg", "a.svg")],
    ("sweep", "--resume"): [Refused(f"{SWEEP} --resume", "-o FILE.nc")],
    ("sweep", "--scheduler"): [
        Refused(f"{SWEEP} --scheduler tcp://x:1 --workers 2", "--workers"),
        Refused("sweep pendulum --portrait phase --scheduler tcp://x:1", "--scheduler"),
    ],
    ("sweep", "--workers"): [
        Refused(f"{SWEEP} --workers 0", "workers"),
        Refused("sweep pendulum --portrait phase --workers 2", "--workers"),
    ],
    ("sweep", "--portrait"): [
        Refused("sweep pendulum --portrait no", "'no'"),
        Refused("sweep pendulum --portrait no --scene swing", "--scene"),
    ],
    ("cycle", "--drive"): [
        Differ("cycle fourbar --points 4", "--drive rocker_angle"),
        Refused("cycle fourbar crank_angle_rate=5 --drive rocker_angle", "crank_angle"),
    ],
    ("cycle", "--output"): [Differ("cycle fourbar --points 4", "--output coupler_joint")],
    ("cycle", "--points"): [Differ("cycle fourbar --points 4", "--points 5")],
    ("cycle", "--span"): [Differ("cycle fourbar --points 4", "--span 1,2")],
    ("cycle", "--fidelity"): [Refused("cycle fourbar --points 4 --fidelity kinematic", "kinematic")],
    ("compare", "-o"): [
        Writes("compare walking -o {}/a.html", "a.html"), Refused("compare walking -o {}/a.txt", "none of the endings"),
    ],
    ("cycle", "-o"): [Writes("cycle fourbar --points 4 -o {}/a.csv", "a.csv")],
    ("track", "--duration"): [Differ(TRACK, "--duration 2"), Refused(f"{TRACK} --duration 0", "duration")],
    ("track", "--wishes"): [
        Differ(f"{TRACK} middle_x=0.1", "--wishes middle_x"), Refused(f"{TRACK} --wishes middle_x", "middle_x"),
    ],
    ("track", "--tolerance"): [Differ(TRACK, "--tolerance 1e-3"), Refused(f"{TRACK} --tolerance 0", "tolerance")],
    ("track", "--max-rate"): [
        Differ(TRACK, "--max-rate crank_angle=20deg/s"), Refused(f"{TRACK} --max-rate crank_angle=1mm/s", "crank_angle"),
    ],
    ("track", "--clearance"): [Differ(TRACK, "--clearance 0.9"), Refused(f"{TRACK} --clearance 3mm", "clearance")],
    ("track", "--fidelity"): [
        Differ("track delta6 D_x=0:0.01:3", "--fidelity full"), Refused(f"{TRACK} --fidelity no", "'no'"),
    ],
    ("track", "-o"): [Writes(f"{TRACK} -o {{}}/a.npz", "a.npz"), Refused(f"{TRACK} -o {{}}/a.csv", ".npz")],
    ("claims", "--figure"): [
        Refused("claims pendulum --figure {}/a.png", "figure"), Refused("claims closed_differential --figure 99", "99"),
        Refused("claims crank=1", "crank"),
    ],
    ("claims", "-o"): [
        Writes("claims planetary --figure all -o {}/a.png", "a.png"), Refused("claims planetary -o {}/a.gif", ".svg"),
        Refused("claims pendulum -o {}/a.png", "pendulum"),
    ],
    ("chart", "--scene"): [Refused(f"{CHART} --scene no", "'no'"), Differ("chart pendulum --duration 0.02", "--scene swing", slow=True)],
    ("chart", "--duration"): [Differ(CHART, "--duration 0.2", slow=True), Refused("chart pendulum --duration -1", "duration")],
    ("chart", "--target"): [Differ(CHART, "--target 1e-7", slow=True), Refused(f"{CHART} --fidelities --target 1e-3", "--target")],
    ("chart", "--fidelity"): [Refused(f"{CHART} --fidelity no", "'no'"), Refused(f"{CHART} --fidelities --fidelity full", "--fidelity")],
    ("chart", "--fidelities"): [Differ(CHART, "--fidelities", slow=True), Refused(f"{CHART} --fidelities --peers", "--peers")],
    ("chart", "--needs"): [Refused(f"{CHART} --needs poses", "--needs"), Refused(f"{CHART} --fidelities --needs no", "no")],
    ("chart", "--peers"): [Refused(f"{CHART} --fidelities --peers", "--peers")],
    ("chart", "-o"): [Writes(f"{CHART} -o {{}}/a.json", "a.json", slow=True)],
    ("modes", "--scene"): [Differ("modes fourbar", "--scene free-run --free"), Refused("modes fourbar --scene no", "'no'")],
    ("modes", "--fidelity"): [Refused("modes fourbar --fidelity no", "'no'")],
    ("modes", "--free"): [Differ("modes fourbar", "--free")],
    ("modes", "-o"): [Writes("modes pendulum -o {}/m", "m/modes.json")],
    ("modes", "--html"): [Writes("modes pendulum --html {}/m.html", "m.html")],
    ("modes", "--mode"): [Refused("modes pendulum --mode 1", "--html"), Refused("modes pendulum --mode 7 --html {}/m.html", "mode 7")],
    ("stability", "--scene"): [Refused("stability pendulum --scene no --budget 1", "'no'")],
    ("stability", "--map"): [Refused("stability pendulum --map no --budget 1", "'no'")],
    ("stability", "--methods"): [Refused("stability flyball --methods leapfrog --budget 1", "leapfrog")],
    ("stability", "--fidelity"): [Refused("stability pendulum --fidelity no --budget 1", "'no'")],
    ("stability", "--budget"): [Refused("stability pendulum --budget -1", "budget")],
    ("stability", "-o"): [Writes(f"{STABLE} -o {{}}/s", "s/*.json", slow=True)],
    ("optimize", "--maximize"): [
        Refused("optimize pendulum length=.5:1 --maximize no", "'no'"),
        Refused("optimize pendulum --maximize a --minimize b", "one goal"),
    ],
    ("optimize", "--minimize"): [Refused("optimize pendulum length=.5:1 --minimize no", "'no'")],
    ("optimize", "--subject"): [Differ("optimize pendulum length=.5:1 --maximize length --evaluations 40", "--subject length<=.7")],
    ("optimize", "--front"): [Differ("optimize pendulum length=.5:1 --maximize length --evaluations 40", "--front min:length")],
    ("optimize", "--evaluations"): [Refused("optimize pendulum length=.5:1 --maximize length --evaluations 4", "expected 40 or more")],
    ("optimize", "--seed"): [Differ("optimize pendulum length=.5:1 --maximize length --evaluations 40", "--seed 3")],
    ("optimize", "-o"): [Writes("optimize pendulum length=.5:1 --maximize length --evaluations 40 -o {}/o", "o/optimum.json")],
    ("fit", "--free"): [Differ(FIT, "--free coupler"), Refused(f"{FIT} --free mode", "a whole number")],
    ("fit", "--noise"): [Differ(FIT, "--noise rocker_angle=3deg"), Refused(f"{FIT} --noise crank=1mm", "rocker_angle")],
    ("fit", "--scene"): [Refused(f"{FIT} --scene free-run", "over time"), Refused(f"{FIT_RUN} --scene no", "'no'")],
    ("fit", "--fidelity"): [Refused(f"{FIT} --fidelity minimal", "over time"), Refused(f"{FIT_RUN} --fidelity no", "'no'")],
    ("fit", "--engine"): [Differ(FIT, "--engine mujoco"), Differ(FIT_RUN, "--engine pinocchio")],
    ("fit", "--starts"): [Differ(FIT, "--starts 3"), Refused(f"{FIT} --starts 0", "at least 1")],
    ("fit", "-o"): [Writes(f"{FIT} -o {{}}/f", "f/fit.png")],
    ("workspace", "--against"): [Differ("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9", "--against rod_length=.4")],
    ("workspace", "--witness"): [
        Differ("workspace delta6 x=-.05:.05:2 y=0:.01:2 z=0:.1:2 alpha=0 beta=0 gamma=0", "--witness pinocchio"),
    ],
    ("workspace", "--stl"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 --stl {}/w.stl", "w.stl")],
    ("workspace", "--glb"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 --glb {}/w.glb", "w.glb")],
    ("workspace", "--html"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 --html {}/w.html", "w.html")],
    ("workspace", "-o"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 -o {}/w.npz", "w.npz")],
    ("doctor", "--fix"): [Writes(f"doctor {MODELS}/pendulum.xml --fix -o {{}}/c.xml", "c.xml")],
    ("doctor", "--audit"): [Differ(f"doctor {MODELS}/pendulum.xml", "--audit")],
    ("doctor", "--overwrite"): [Refused(f"doctor {MODELS}/pendulum.xml --overwrite", "--fix")],
    ("doctor", "--pick"): [Refused(f"doctor {MODELS} --pick {{}}/none.txt", "none.txt")],
    ("doctor", "--licences"): [Refused(f"doctor {MODELS} --licences {{}}/none.json", "none.json")],
    ("doctor", "--time-limit"): [Differ(f"doctor {MODELS}/pendulum.xml --audit", "--time-limit 0.01")],
    ("doctor", "--jobs"): [Refused(f"doctor {MODELS} --jobs 0", "--jobs")],
    ("doctor", "-o"): [Writes(f"doctor {MODELS}/pendulum.xml --audit -o {{}}/a.html", "a.html")],
    ("view", "--html"): [Writes(f"{VIEW} --html {{}}/v.html", "v.html")],
    ("view", "--png"): [Writes(f"{VIEW} --png {{}}/v.png", "v.png")],
    ("view", "--glb"): [Writes(f"{VIEW} --glb {{}}/v.glb", "v.glb")],
    ("view", "--mp4"): [Refused(f"{VIEW} --studio --mp4 {{}}/v.mp4", "--mp4")],
    ("view", "--csv"): [Writes(f"{VIEW} --csv {{}}/v.csv", "v.csv")],
    ("view", "--against"): [
        Refused(f"{VIEW} --html {{}}/v.html --against no.npz", "no.npz"),
        Refused(f"{VIEW} --studio --against no.npz", "--against"),
    ],
    ("view", "--explore"): [Refused("view pendulum --explore", "--html"), Refused("view pendulum --studio --explore", "--explore")],
    ("view", "--vary"): [Refused("view pendulum --vary length=1:2:3 --html {}/v.html", "--explore")],
    ("view", "--fidelity"): [
        Writes("view planetary_stage --fidelity minimal --png {}/v.png", "v.png"),
        Refused("view planetary_stage --fidelity no --png {}/v.png", "Existing: full"),
    ],
    ("view", "--studio"): [Refused("view pendulum --studio --png {}/v.png", "--png")],
    ("view", "--catalog"): [Refused("view --catalog", "--html"), Refused("view --catalog --html {}/g --png {}/v.png", "--png")],
    ("view", "--new"): [Writes("view --new --html {}/v.html", "v.html"), Refused("view --new --png {}/v.png", "--png")],
    ("view", "--host"): [Refused("view pendulum --host 0.0.0.0 --html {}/v.html", "--host")],
}  # fmt: skip
"""Verb and option -> what must come of it."""


def options_of(verb: str) -> list[str]:
    """The options of a verb, by their first name, from its parser."""
    parser = parser_of(verb, VERBS[verb], routes_of(verb, VERBS[verb], api))
    return [a.option_strings[0] for a in parser._actions if a.option_strings and a.dest not in ("help", "json")]


def test_every_option_of_the_command_line_is_in_the_table() -> None:
    exists = {(verb, option) for verb in VERBS for option in options_of(verb)}
    assert exists - set(COMMANDS) == set() and set(COMMANDS) - exists == set()


def _flat(item: Any) -> Any:
    if isinstance(item, dict):
        return {k: _flat(v) for k, v in item.items() if k not in IGNORED}
    return [_flat(x) for x in item] if isinstance(item, list) else item


_KNOWN: dict[str, tuple[int, Any, dict[str, bytes], str]] = {}
"""The chart that several options are compared with, made once."""


def said(words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, Any, dict[str, bytes], str]:
    """Exit code, what the document answers, the model files that were written, the message."""
    folder.mkdir()
    if words in _KNOWN:
        return _KNOWN[words]
    code = main([w.replace("{}", str(folder)) for w in words.split()] + ["--json"])
    captured = capsys.readouterr()
    models = {p.name: p.read_bytes() for p in folder.rglob("*.xml")}
    answer = (code, _flat(json.loads(captured.out)), models, captured.err)
    if words == CHART:
        _KNOWN[words] = answer
    return answer


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(c, id=" ".join(key), marks=[pytest.mark.slow] if c.slow else [])
        for key, cases in COMMANDS.items()
        for c in cases
    ],
)
def test_an_option_acts_or_is_refused(
    case: Differ | Writes | Refused, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if isinstance(case, Refused):
        code, _, _, message = said(case.words, tmp_path / "a", capsys)
        assert code in (1, 2) and case.text in message and "internal error" not in message
        assert not list((tmp_path / "a").rglob("*"))
    elif isinstance(case, Writes):
        code, _, _, _ = said(case.words, tmp_path / "a", capsys)
        assert code == 0 and [p.stat().st_size > 0 for p in (tmp_path / "a").glob(case.file)] == [True]
    else:
        one, two = (said(w, tmp_path / k, capsys) for k, w in (("a", case.plain), ("b", f"{case.plain} {case.more}")))
        assert one[0] in (0, 3) and two[0] in (0, 3)
        assert one[1] != two[1] or one[2] != two[2]
