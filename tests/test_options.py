"""Every option of every verb changes what comes back, or is refused with a sentence that names it; none is passed over.

The tables are held against the argument parsers and the signatures: an option that is in no table fails the test.
"""

import inspect
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.cli import main
from mechlab.cli.options import parser_of, routes_of
from mechlab.cli.verbs import VERBS
from mechlab.errors import MechlabError
from mechlab.values import Range

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


SWEEP = "sweep pendulum length=0.5,1.5 --duration 0.05"
CHART = "chart pendulum --duration 0.1"
VIEW = "view pendulum duration=0.2"
STABLE = "stability fourbar coupler_mass=1e-3:1e3:3 --budget 1 --scene free-run --methods RK4"

COMMANDS: dict[tuple[str, str], list[Differ | Writes | Refused]] = {
    ("run", "-o"): [Writes("run pendulum duration=0.2 -o {}/r", "r/pendulum.xml", slow=True)],
    ("show", "--fidelity"): [Differ("show delta6", "--fidelity full"), Refused("show fourbar --fidelity no", "'no'")],
    ("generate", "-o"): [Writes("generate pendulum -o {}", "pendulum.xml")],
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
    ("cycle", "-o"): [Writes("cycle fourbar --points 4 -o {}/a.csv", "a.csv")],
    ("claims", "--figure"): [Refused("claims pendulum --figure {}/a.png", "figure"), Refused("claims crank=1", "crank")],
    ("chart", "--scene"): [Refused(f"{CHART} --scene no", "'no'"), Differ("chart fourbar --duration 0.02", "--scene free-run", slow=True)],
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
    ("optimize", "--evaluations"): [Refused("optimize pendulum length=.5:1 --maximize length --evaluations 4", "at least 40")],
    ("optimize", "--seed"): [Differ("optimize pendulum length=.5:1 --maximize length --evaluations 40", "--seed 3")],
    ("optimize", "-o"): [Writes("optimize pendulum length=.5:1 --maximize length --evaluations 40 -o {}/o", "o/optimum.json")],
    ("workspace", "--against"): [Differ("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9", "--against rod_length=.4")],
    ("workspace", "--witness"): [
        Differ("workspace delta6 x=-.05:.05:2 y=0:.01:2 z=0:.1:2 alpha=0 beta=0 gamma=0", "--witness pinocchio"),
    ],
    ("workspace", "--stl"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 --stl {}/w.stl", "w.stl")],
    ("workspace", "--glb"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 --glb {}/w.glb", "w.glb")],
    ("workspace", "--html"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 --html {}/w.html", "w.html")],
    ("workspace", "-o"): [Writes("workspace delta6 x=-.3:.3:9 y=-.3:.3:9 z=-.3:.3:9 -o {}/w.npz", "w.npz")],
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
    ("view", "--studio"): [Refused("view pendulum --studio --png {}/v.png", "--png")],
    ("view", "--catalog"): [Refused("view --catalog", "--html"), Refused("view --catalog --html {}/g --png {}/v.png", "--png")],
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


# -- keywords of the API ----------------------------------------------------------------------------------------------------

NOT_AN_OPTION = {"source", "sources", "values", "progress", "task", "kind", "path"}
"""What is asked about, and where progress is told."""
ONLY_FOR_THE_COMMAND_LINE = {("sweep", "command")}
"""The command that a dataset remembers."""
LIKE: dict[str, dict[str, str]] = {
    "chart": {
        "scene": "--scene", "duration": "--duration", "target": "--target", "fidelity": "--fidelity", "peers": "--peers", "out": "-o",
    },
    "claims": {"figure": "--figure"},
    "cycle": {
        "drive": "--drive", "output": "--output", "points": "--points", "span": "--span", "fidelity": "--fidelity", "out": "-o",
    },
    "generate": {"out": "-o", "fidelity": "--fidelity"},
    "modes": {"scene": "--scene", "fidelity": "--fidelity", "free": "--free", "out": "-o", "html": "--html", "only": "--mode"},
    "optimize": {
        "maximize": "--maximize", "minimize": "--minimize", "subject": "--subject", "front": "--front",
        "evaluations": "--evaluations", "seed": "--seed", "out": "-o",
    },
    "run": {"out": "-o"},
    "show": {"fidelity": "--fidelity"},
    "simulate": {
        "scene": "--scene", "duration": "--duration", "timestep": "--timestep", "max_error": "--max-error", "engine": "--engine",
        "fidelity": "--fidelity", "at": "--at", "order_check": "--order-check", "out": "-o",
    },
    "stability": {
        "scene": "--scene", "kinds": "--map", "methods": "--methods", "fidelity": "--fidelity", "out": "-o", "budget": "--budget",
    },
    "sweep": {
        "quantities": "--quantity", "witness": "--witness", "scene": "--scene", "engine": "--engine", "fidelity": "--fidelity",
        "duration": "--duration", "timestep": "--timestep", "out": "-o", "plot": "--plot", "resume": "--resume",
        "scheduler": "--scheduler", "workers": "--workers",
    },
    "view": {
        "html": "--html", "png": "--png", "host": "--host", "glb": "--glb", "mp4": "--mp4", "csv": "--csv", "against": "--against",
        "explorable": "--explore", "vary": "--vary",
    },
    "workspace": {
        "against": "--against", "witness": "--witness", "stl": "--stl", "glb": "--glb", "html": "--html", "maps": "-o",
    },
}  # fmt: skip
"""Keywords that the command line passes on as they are: function -> keyword -> option of the verb of that name."""

Act = Callable[[Path], Any]


def _refused(word: str, act: Callable[[], Any]) -> str:
    with pytest.raises(MechlabError, match=word):
        act()
    return "refused"


def _run(**how: Any) -> float:
    return float(ml.simulate("pendulum", duration=0.1, **how).final()["angle"])


def _page(path: Path, **how: Any) -> str:
    api.view("pendulum", {"duration": 0.2}, html=path / "v.html", **how)
    return (path / "v.html").read_text()


def _models(path: Path) -> Path:
    """A folder with a picture of another mechanism for the pendulum."""
    (path / "pendulum").mkdir(parents=True)
    kept = Path(__file__).parents[1] / "models" / "fourbar" / "picture.png"
    (path / "pendulum" / "picture.png").write_bytes(kept.read_bytes())
    return path


def _gallery(out: Path, models: Path) -> list[bytes]:
    api.gallery(out, ["pendulum"], models=models)
    return sorted(x.read_bytes() for x in out.rglob("*.png"))


def _recorded(path: Path) -> Path:
    ml.save_recording(ml.simulate("pendulum", duration=0.1), path)
    return path


SLOW = {("gallery", "models"), ("portrait", "out"), ("generate_catalog", "pictures")}
KEYWORDS: dict[tuple[str, str], tuple[Act, Act]] = {
    ("simulate", "settings"): (lambda p: _run(), lambda p: _run(settings="draft")),
    ("sensitivity", "tolerance"): (
        lambda p: ml.sensitivity("fourbar", crank_angle=1, only=("coupler",)).spreads,
        lambda p: ml.sensitivity("fourbar", crank_angle=1, only=("coupler",), tolerance=1e-3).spreads,
    ),
    ("sensitivity", "only"): (
        lambda p: list(ml.sensitivity("fourbar", crank_angle=1, only=("coupler",)).units),
        lambda p: list(ml.sensitivity("fourbar", crank_angle=1, only=("rocker",)).units),
    ),
    ("portrait", "out"): (
        lambda p: len(list(p.rglob("*"))),
        lambda p: (api.portrait("impulse_transmission", "phase", out=p / "x"), len(list(p.rglob("*"))))[1],
    ),
    ("explore", "vary"): (
        lambda p: len(api.explore("fourbar", vary={}).variants or ()),
        lambda p: _refused("no", lambda: api.explore("fourbar", vary={"no": (1.0, 2.0)})),
    ),
    ("story", "against"): (lambda p: "", lambda p: _refused("only a run", lambda: api.story("pendulum", against="a.npz"))),
    ("fidelities", "scene"): (lambda p: "", lambda p: _refused("'no'", lambda: ml.fidelities("pendulum", scene="no"))),
    ("fidelities", "duration"): (lambda p: "", lambda p: _refused("duration", lambda: ml.fidelities("pendulum", duration=-1.0))),
    ("fidelities", "out"): (lambda p: "", lambda p: _refused("formats", lambda: ml.fidelities("pendulum", duration=0.1, out=p / "a.b"))),
    ("fidelities", "needs"): (lambda p: "", lambda p: _refused("no", lambda: ml.fidelities("pendulum", duration=0.1, needs=("no",)))),
    ("gallery", "out"): (lambda p: "", lambda p: _refused("'no'", lambda: api.gallery(p, ["no"]))),
    ("gallery", "names"): (lambda p: "", lambda p: _refused("'no'", lambda: api.gallery(p, ["no"]))),
    ("gallery", "models"): (lambda p: _gallery(p / "a", p / "no"), lambda p: _gallery(p / "b", _models(p / "models"))),
    ("load_recording", "most_bytes"): (
        lambda p: "",
        lambda p: _refused("the limit is 8", lambda: ml.load_recording(_recorded(p / "run.npz"), most_bytes=8)),
    ),
    ("generate_catalog", "out"): (lambda p: "", lambda p: _refused("'no'", lambda: api.generate_catalog(p, ["no"]))),
    ("generate_catalog", "names"): (lambda p: "", lambda p: _refused("'no'", lambda: api.generate_catalog(p, ["no"]))),
    ("generate_catalog", "pictures"): (
        lambda p: (api.generate_catalog(p / "a", ["pendulum"]), len(list((p / "a").rglob("*.png"))))[1],
        lambda p: (api.generate_catalog(p / "b", ["pendulum"], pictures=False), len(list((p / "b").rglob("*.png"))))[1],
    ),
    ("view", "port"): (lambda p: "", lambda p: _refused("port", lambda: _page(p, port=9))),
    ("view", "wait"): (
        lambda p: api.view("pendulum", wait=False).to_dict()["message"],
        lambda p: _page(p, wait=False)[:9],
    ),
}  # fmt: skip
"""Keywords with no option of their own: two calls whose results differ, or one that is refused."""


def public_keywords() -> set[tuple[str, str]]:
    """(function, keyword) of every public function."""
    functions = {n: f for n in api.__all__ if inspect.isfunction(f := getattr(api, n))}
    return {(n, k) for n, f in functions.items() for k, p in inspect.signature(f).parameters.items()
            if k not in NOT_AN_OPTION and p.kind is not p.VAR_KEYWORD}  # fmt: skip


def test_every_keyword_of_the_api_is_in_a_table() -> None:
    like = {(function, keyword) for function, row in LIKE.items() for keyword in row}
    known = like | set(KEYWORDS) | ONLY_FOR_THE_COMMAND_LINE
    assert public_keywords() - known == set() and known - public_keywords() == set()
    verbs = {(f, option) for f, row in LIKE.items() for option in row.values()}
    assert verbs <= set(COMMANDS)


@pytest.mark.parametrize(
    "key", [pytest.param(k, id=".".join(k), marks=[pytest.mark.slow] if k in SLOW else []) for k in KEYWORDS]
)
def test_a_keyword_acts_or_is_refused(key: tuple[str, str], tmp_path: Path) -> None:
    one, two = KEYWORDS[key]
    assert one(tmp_path) != two(tmp_path)


# -- combinations that make no sense ----------------------------------------------------------------------------------------


def test_values_and_sliders_are_refused_for_a_recording(tmp_path: Path) -> None:
    run = ml.simulate("pendulum", duration=0.1)
    for act, word in (
        (lambda: api.view(run, {"length": 2.0}, html=tmp_path / "a.html"), "length"),
        (lambda: api.story(run, {"length": 2.0}), "length"),
        (lambda: api.view(run, html=tmp_path / "a.html", explorable=True), "mechanism"),
        (lambda: api.view("pendulum", html=tmp_path / "a.html", vary={"length": (1.0, 2.0)}), "vary"),
    ):
        with pytest.raises(MechlabError, match=word):
            act()
    assert not list(tmp_path.iterdir())


def test_parameters_of_scenes_are_refused_in_a_cycle_and_both_spellings_of_a_rate_taken() -> None:
    for name in ("speed", "torque"):
        with pytest.raises(MechlabError, match=name):
            ml.cycle("fourbar", {name: 7.0}, points=4)
    short, long = (ml.cycle("fourbar", {key: 5.0}, points=4) for key in ("crank_rate", "crank_angle_rate"))
    assert np.array_equal(short["rocker_angle_rate"], long["rocker_angle_rate"])
    short, long = (ml.solve("fourbar", crank_angle=1.0, **{key: 5.0}) for key in ("crank_rate", "crank_angle_rate"))
    assert list(long.answers) == list(short.answers) == ["analytic", "pinocchio", "mujoco"]
    assert short["analytic"]["rocker_rate"] == long["analytic"]["rocker_rate"]
    for act in (ml.cycle, lambda source, values: ml.solve(source, crank_angle=1.0, **values)):
        with pytest.raises(MechlabError, match="crank_angle_rate"):
            act("fourbar", {"crank_rate": 1.0, "crank_angle_rate": 2.0})


def test_a_timestep_beside_an_error_and_an_unknown_preset_are_refused() -> None:
    with pytest.raises(MechlabError, match="timestep"):
        _run(timestep=1e-3, max_error=1e-4)
    with pytest.raises(MechlabError, match="accurate"):
        _run(settings="accurat")


def test_a_list_and_a_tuple_of_ends_mean_the_same_by_keyword_and_mapping() -> None:
    for ends in ((0.5, 1.0), [0.5, 1.0], Range(0.5, 1.0)):
        found = ml.optimize("pendulum", {"length": ends}, maximize="length", evaluations=40)
        assert found.parameters["length"] == pytest.approx(1.0)
