"""Every keyword of the API acts or is refused, like the options of the command line; combinations that make no sense are refused.

The tables are held against the signatures: a keyword that is in no table fails the test.
"""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.errors import MechlabError
from mechlab.values import Range
from tests.test_options import COMMANDS

NOT_AN_OPTION = {"source", "sources", "data", "values", "progress", "task", "kind", "path"}
"""What is asked about, and where progress is told."""
ONLY_FOR_THE_COMMAND_LINE = {("sweep", "command")}
"""The command that a dataset remembers."""
LIKE: dict[str, dict[str, str]] = {
    "chart": {
        "scene": "--scene", "duration": "--duration", "target": "--target", "fidelity": "--fidelity", "peers": "--peers", "out": "-o",
    },
    "claims": {"figure": "--figure", "out": "-o"},
    "cycle": {
        "drive": "--drive", "output": "--output", "points": "--points", "span": "--span", "fidelity": "--fidelity", "out": "-o",
    },
    "fit": {
        "free": "--free", "noise": "--noise", "scene": "--scene", "fidelity": "--fidelity", "engine": "--engine", "starts": "--starts",
        "out": "-o",
    },
    "generate": {"out": "-o", "fidelity": "--fidelity", "also": "--also"},
    "modes": {"scene": "--scene", "fidelity": "--fidelity", "free": "--free", "out": "-o", "html": "--html", "only": "--mode"},
    "optimize": {
        "maximize": "--maximize", "minimize": "--minimize", "subject": "--subject", "front": "--front",
        "evaluations": "--evaluations", "seed": "--seed", "out": "-o",
    },
    "run": {"out": "-o"},
    "show": {"fidelity": "--fidelity"},
    "simulate": {
        "scene": "--scene", "duration": "--duration", "timestep": "--timestep", "max_error": "--max-error", "budget": "--budget",
        "engine": "--engine", "fidelity": "--fidelity", "at": "--at", "order_check": "--order-check", "out": "-o",
    },
    "stability": {
        "scene": "--scene", "kinds": "--map", "methods": "--methods", "fidelity": "--fidelity", "out": "-o", "budget": "--budget",
    },
    "sweep": {
        "quantities": "--quantity", "witness": "--witness", "scene": "--scene", "engine": "--engine", "fidelity": "--fidelity",
        "duration": "--duration", "timestep": "--timestep", "out": "-o", "plot": "--plot", "resume": "--resume",
        "scheduler": "--scheduler", "workers": "--workers", "backend": "--backend",
    },
    "track": {
        "duration": "--duration", "wishes": "--wishes", "tolerance": "--tolerance", "max_rate": "--max-rate",
        "clearance": "--clearance", "fidelity": "--fidelity", "out": "-o",
    },
    "view": {
        "html": "--html", "png": "--png", "host": "--host", "glb": "--glb", "mp4": "--mp4", "csv": "--csv", "against": "--against",
        "explorable": "--explore", "vary": "--vary", "fidelity": "--fidelity",
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


def _session(**how: Any) -> list[float]:
    """What a session of the pendulum sees after some actions."""
    with ml.session("pendulum", **{"angle_0": 0.3, **how}) as s:
        return [s.time, *s.reset(), *[float(x) for _ in range(3) for x in s.step()], s.rng.random()]


def _episode(make: Callable[..., Any] = ml.environment, **how: Any) -> str:
    """What an environment of the four-bar gives, and when it ends, under constant actions."""
    env = make("fourbar", **{"reward": lambda o, a, s: -o[0], "seconds": 0.05, **how})
    first = env.reset(seed=1)[0]
    steps = [env.step(np.full(env.action_space.shape, 1.1)) for _ in range(6)]
    env.close()
    return repr((first.tolist(), [[np.asarray(x).tolist() for x in step[:4]] for step in steps]))


def _episodes(**how: Any) -> str:
    return _episode(ml.environments, **{"count": 1, **how})


def _of_episode(act: Callable[..., str], name: str) -> dict[tuple[str, str], tuple[Act, Act]]:
    """The keywords that both kinds of environment have."""
    changes: dict[str, Any] = {
        "reward": lambda o, a, s: 1.0, "terminated": lambda o, s: True, "seconds": 0.02, "hold": 0.02, "observe": ["rocker_angle"],
        "start": lambda rng: {"crank_angle_0": 1.2}, "settings": ml.Settings(timestep=1.25e-4), "scene": "free-run",
    }  # fmt: skip
    made = {(name, key): (lambda p: act(), lambda p, k=key, v=value: act(**{k: v})) for key, value in changes.items()}
    made[name, "scene"] = (lambda p: "", lambda p: _refused("'no'", lambda: act(scene="no")))
    made[name, "fidelity"] = (lambda p: "", lambda p: _refused("'no'", lambda: act(fidelity="no")))
    return made


SLOW = {("gallery", "models"), ("portrait", "out"), ("generate_catalog", "pictures")}
PENDULUM = Path(__file__).parents[1] / "models" / "pendulum" / "pendulum.xml"


def _cured(folder: Path, name: str) -> list[str]:
    ml.cure(PENDULUM, folder / name)
    return sorted(p.name for p in folder.iterdir())


KEYWORDS: dict[tuple[str, str], tuple[Act, Act]] = {
    ("simulate", "laws"): (lambda p: _run(), lambda p: _run(laws={"angle": lambda t, plant: 0.5})),
    ("simulate", "drives"): (lambda p: "", lambda p: _refused("drive", lambda: _run(drives={"no": 1.0}))),
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
    ("story", "rebuild"): (
        lambda p: api.story(api.simulate("planetary_stage", duration=0.01)).bodies,
        lambda p: api.story(api.simulate("planetary_stage", duration=0.01), rebuild=False).bodies,
    ),
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
    ("edit", "fidelity"): (
        lambda p: len(api.edit("planetary").bodies),
        lambda p: len(api.edit("planetary", fidelity="full").bodies),
    ),
    ("generate_catalog", "out"): (lambda p: "", lambda p: _refused("'no'", lambda: api.generate_catalog(p, ["no"]))),
    ("generate_catalog", "names"): (lambda p: "", lambda p: _refused("'no'", lambda: api.generate_catalog(p, ["no"]))),
    ("generate_catalog", "pictures"): (
        lambda p: (api.generate_catalog(p / "a", ["pendulum"]), len(list((p / "a").rglob("*.png"))))[1],
        lambda p: (api.generate_catalog(p / "b", ["pendulum"], pictures=False), len(list((p / "b").rglob("*.png"))))[1],
    ),
    ("cure", "out"): (lambda p: _cured(p, "a.xml"), lambda p: _cured(p, "b.xml")),
    ("cure", "overwrite"): (lambda p: "", lambda p: _refused("overwrite", lambda: ml.cure(PENDULUM, PENDULUM))),
    ("audit", "out"): (lambda p: ml.audit([PENDULUM]).paths, lambda p: ml.audit([PENDULUM], out=p / "a.json").paths),
    ("audit", "pick"): (lambda p: "", lambda p: _refused("none.txt", lambda: ml.audit([PENDULUM], pick=p / "none.txt"))),
    ("audit", "licences"): (lambda p: "", lambda p: _refused("none.json", lambda: ml.audit([PENDULUM], licences=p / "none.json"))),
    ("audit", "time_limit"): (lambda p: ml.audit([PENDULUM]).counts, lambda p: ml.audit([PENDULUM], time_limit=0.01).counts),
    ("audit", "jobs"): (lambda p: "", lambda p: _refused("jobs", lambda: ml.audit([PENDULUM], jobs=0))),
    ("linearize", "fidelity"): (lambda p: "", lambda p: _refused("'no'", lambda: ml.linearize("fourbar", fidelity="no"))),
    ("linearize", "witness"): (lambda p: "", lambda p: _refused("'no'", lambda: ml.linearize("fourbar", witness="no"))),
    **_of_episode(_episode, "environment"), **_of_episode(_episodes, "environments"),
    ("environments", "count"): (lambda p: _episodes(), lambda p: _episodes(count=2)),
    ("environments", "threads"): (lambda p: "", lambda p: _refused("threads", lambda: _episodes(threads=-1))),
    ("session", "seed"): (lambda p: _session(seed=1), lambda p: _session(seed=2)),
    ("session", "hold"): (lambda p: _session(seed=1), lambda p: _session(seed=1, hold=0.02)),
    ("session", "observe"): (lambda p: _session(seed=1), lambda p: _session(seed=1, observe=["angle"])),
    ("session", "start"): (lambda p: _session(seed=1), lambda p: _session(seed=1, start=lambda rng: {"angle_0": 0.5})),
    ("session", "settings"): (lambda p: _session(seed=1), lambda p: _session(seed=1, settings="stiff")),
    ("session", "engine"): (lambda p: "", lambda p: _refused("'file'", lambda: ml.session("pendulum", engine="file"))),
    ("environment", "engine"): (lambda p: "", lambda p: _refused("'file'", lambda: _episode(engine="file"))),
    ("environments", "engine"): (lambda p: "", lambda p: _refused("'file'", lambda: _episodes(engine="file"))),
    ("session", "scene"): (lambda p: "", lambda p: _refused("'no'", lambda: ml.session("pendulum", scene="no"))),
    ("session", "fidelity"): (lambda p: "", lambda p: _refused("'no'", lambda: ml.session("pendulum", fidelity="no"))),
    ("track", "times"): (
        lambda p: ml.track("fourbar", crank_angle=(1.0, 2.0)).t[-1],
        lambda p: ml.track("fourbar", crank_angle=(1.0, 2.0), times=[0.0, 3.0]).t[-1],
    ),
    ("track", "tasks"): (
        lambda p: ml.track("fourbar", crank_angle=1.0)["crank_angle_error"][0],
        lambda p: ml.track("fourbar", {}, [ml.PostureTask({"crank_angle": 1.0})])["crank_angle"][0],
    ),
    ("compare", "out"): (
        lambda p: [], lambda p: [api.compare("walking", out=p / "a.csv"), [x.name for x in p.iterdir()]][1],
    ),
    ("draw", "html"): (
        lambda p: api.draw(wait=False).to_dict()["message"][:9],
        lambda p: api.draw(html=p / "new.html").files["page"].name,
    ),
    ("draw", "port"): (lambda p: "", lambda p: _refused("port", lambda: api.draw(html=p / "new.html", port=9))),
    ("draw", "wait"): (
        lambda p: api.draw(wait=False).to_dict()["message"][:9],
        lambda p: api.draw(html=p / "new.html", wait=False).to_dict()["message"][:9],
    ),
    ("list_entries", "family"): (lambda p: len(api.list_entries().rows), lambda p: len(api.list_entries(family="press").rows)),
    ("list_entries", "freedoms"): (lambda p: len(api.list_entries().rows), lambda p: len(api.list_entries(freedoms=2).rows)),
    ("list_entries", "motion"): (lambda p: len(api.list_entries().rows), lambda p: len(api.list_entries(motion="spatial").rows)),
    ("list_entries", "search"): (lambda p: len(api.list_entries().rows), lambda p: len(api.list_entries(search="dwell").rows)),
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


def test_an_option_that_is_spelled_wrong_is_suggested():
    for call, wrong, right in ((ml.simulate, {"timstep": 1e-3}, "timestep"), (ml.session, {"hodl": 0.01}, "hold")):
        with pytest.raises(MechlabError, match=f"{next(iter(wrong))}' does not exist. Did you mean the option '{right}'"):
            call("fourbar", **wrong)
    with pytest.raises(MechlabError, match="Did you mean 'coupler'") as found:
        ml.simulate("fourbar", couplr=1.0)
    assert "the option" not in str(found.value)


def test_an_option_that_is_written_as_a_key_is_suggested_as_it_is_typed(capsys: pytest.CaptureFixture[str]) -> None:
    from mechlab.cli import main

    assert main(["simulate", "fourbar", "duration=.05"]) == 1 and "the option --duration?" in capsys.readouterr().err
    assert main(["simulate", "fourbar", "maxerror=1e-3"]) == 1 and "the option --max-error?" in capsys.readouterr().err
