"""The public API: its names, its types, the keys beside its options, and what its results print."""

import ast
import importlib
import inspect
import os
import re
import subprocess
import sys
import typing
from collections.abc import Callable, Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.api.arguments import Engine, as_range, key_values
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.scene import ENGINES
from mechlab.results import Shown
from mechlab.values import Range

ROOT = Path(__file__).resolve().parents[1]
FUNCTIONS = {n: f for n in ml.__all__ if inspect.isfunction(f := getattr(ml, n))}


def typed_names(path: Path) -> Iterator[tuple[str, str]]:
    """(module, name) of what a file imports for type checkers alone."""
    for node in ast.parse(path.read_text("utf-8")).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            for line in node.body:
                if isinstance(line, ast.ImportFrom) and line.module:
                    yield from ((line.module, alias.name) for alias in line.names)


# -- names ------------------------------------------------------------------------------------------------------------------


def test_the_names_that_run_are_those_that_type_checkers_see() -> None:
    homes = {(home, name) for home, names in ml._HOMES.items() for name in names}
    assert homes == set(typed_names(ROOT / "mechlab" / "__init__.py"))
    assert sorted([name for _, name in homes] + ["__version__"]) == sorted(ml.__all__) == dir(ml)
    assert all(getattr(ml, name) is not None for name in ml.__all__) and re.match(r"\d+\.\d+", ml.__version__)
    assert (ROOT / "mechlab" / "py.typed").is_file()
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = ml.no_such_name  # type: ignore[attr-defined]


@pytest.mark.parametrize("package", ["api", "formats", "integrate"])
def test_names_found_on_demand_are_those_that_type_checkers_see(package: str) -> None:
    found = importlib.import_module(f"mechlab.{package}")
    homes = {(f"mechlab.{package}.{home}", name) for home, names in found._HOMES.items() for name in names}
    assert homes == set(typed_names(ROOT / "mechlab" / package / "__init__.py"))
    assert all(getattr(found, name) is not None for name in found.__all__)
    assert {*found.__all__} <= {name for _, name in homes}
    with pytest.raises(AttributeError, match="no_such_name"):
        found.no_such_name  # noqa: B018


def test_an_own_mechanism_scene_or_law_needs_no_other_module() -> None:
    wanted = (
        "Builder Inertia Placement revolute prismatic spherical universal floating shape Spring GearMesh belt screw mimic "
        "relation LOOP_ROWS Entry Check Claim Question Scene SceneRecipe Constant Harmonic TableLaw Servo DcMotor Settings "
        "PRESETS Recording Answers MechlabError NoSolution UsageError parameter load load_recording save_recording __version__"
    )
    assert set(wanted.split()) <= set(ml.__all__)


def test_old_names_warn_and_work() -> None:
    """Each warning stands at the line of the caller: Python shows a DeprecationWarning there alone."""
    for old, new in (("solve_values", ml.solve), ("simulate_values", ml.simulate)):
        with pytest.warns(DeprecationWarning, match=f"mechlab.{new.__name__}") as told:
            assert getattr(api, old) is new
        assert told[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="scene=") as told:
        run = ml.simulate("fourbar", "free-run", duration=0.01)
    assert run.scene == "free-run" and told[0].filename == __file__


def test_health_an_environment_and_a_builder_print_as_sentences() -> None:
    run = ml.simulate("fourbar", scene="free-run", duration=0.01)
    assert str(run.health).splitlines()[0] == "  ok      all values are finite"
    assert repr(run.health) == f"Health, {len(run.health.findings)} findings, trusted"
    env = ml.environment("fourbar", reward=lambda seen, action, session: 0.0, seconds=1.0)
    assert str(env).startswith("Environment of Session of fourbar") and str(env).endswith(", 1 s an episode")
    b = ml.Builder("arm").body("link", ml.revolute("angle"), inertia=ml.Inertia(1.0))
    assert repr(b) == "Builder of arm: 1 body; .build() or .assemble(guess) makes the Mechanism"


# -- types ------------------------------------------------------------------------------------------------------------------


def hints(function: Any) -> dict[str, Any]:
    """The types of a function, with the names that its module imports for type checkers."""
    module = sys.modules[function.__module__]
    names = dict(vars(typing)) | {n: getattr(ml, n) for n in ml.__all__}
    for home in (module, sys.modules["mechlab.api.finding"]):
        names |= {n: getattr(importlib.import_module(m), n) for m, n in typed_names(Path(home.__file__ or ""))}
    return typing.get_type_hints(function, localns=names | vars(module), include_extras=True)


def has_any(hint: Any) -> bool:
    return hint is Any or any(has_any(x) for x in typing.get_args(hint) if x is not ...)


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_no_public_function_takes_or_gives_any(name: str) -> None:
    found = hints(FUNCTIONS[name])
    signature = inspect.signature(FUNCTIONS[name])
    assert found.keys() == {*signature.parameters, "return"}
    assert not {k for k, hint in found.items() if has_any(hint)}


def test_the_engines_of_the_type_are_those_that_run() -> None:
    assert set(typing.get_args(Engine)) == set(ENGINES)


@pytest.mark.slow
def test_a_users_script_is_typed(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--follow-imports=silent", "--ignore-missing-imports",
         "--cache-dir", str(tmp_path), str(ROOT / "tests" / "typed_script.py")],
        cwd=ROOT, env=os.environ | {"MYPYPATH": str(ROOT)}, capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    shape = "tuple[Any, ...], numpy"  # of every array of numpy
    revealed = [r.replace(shape, "numpy") for r in re.findall(r'Revealed type is "(.*)"', done.stdout)]
    assert len(revealed) == 9 and not [r for r in revealed if re.search(r"\bAny\b", r)], revealed


def test_a_users_script_runs(tmp_path: Path) -> None:
    script = ROOT / "tests" / "typed_script.py"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.png").stat().st_size > 1000 and "rocker, scene driven" in done.stdout


# -- keys -------------------------------------------------------------------------------------------------------------------


def test_a_key_is_given_once_and_an_option_wins() -> None:
    with pytest.raises(MechlabError, match="second argument: expected a mapping of keys to values, got 'out'"):
        ml.generate("fourbar", "out")  # type: ignore[arg-type]
    with pytest.raises(MechlabError, match="crank: given in the mapping and as a keyword"):
        ml.solve("fourbar", {"crank": 0.1}, crank=0.1, crank_angle=1.0)
    with pytest.raises(MechlabError, match="second argument"):
        ml.solve("fourbar", values={"crank_angle": 1.0})  # type: ignore[arg-type]
    assert ml.simulate("pendulum", {"duration": 2.0}, duration=0.1).t[-1] == pytest.approx(0.1)
    assert ml.simulate("pendulum", {"duration": 0.2}).t[-1] == pytest.approx(0.2)


SAME = (
    "0.1:0.4:4",
    Range(0.1, 0.4, 4),
    (0.1, 0.2, 0.3, 0.4),
    [0.1, 0.2, 0.3, 0.4],
    np.linspace(0.1, 0.4, 4),
    "0.1,0.2,0.3,0.4",
)


@pytest.mark.parametrize("values", SAME, ids=lambda x: type(x).__name__)
def test_a_text_a_range_a_tuple_a_list_and_an_array_mean_the_same(values: Any) -> None:
    angles = np.linspace(0.1, 0.4, 4)
    truth = ml.solve("fourbar", crank_angle=angles)["analytic"]["rocker_angle"]
    np.testing.assert_allclose(ml.solve("fourbar", crank_angle=values)["analytic"]["rocker_angle"], truth, atol=1e-14)
    np.testing.assert_allclose(
        ml.sweep("fourbar", {"crank_angle": values}, "rocker_angle")["rocker_angle"], truth, atol=1e-9
    )
    read = key_values({"x": values}, {})["x"]
    assert as_range("x", read) == Range(0.1, 0.4, 4)


def test_whole_numbers_of_a_range_and_lists_that_are_no_range() -> None:
    assert key_values({"teeth": range(18, 21)}, {}) == {"teeth": (18, 19, 20)}
    assert (
        as_range("x", (0.5, 1.0)) == Range(0.5, 1.0) and as_range("x", 1.0) is None and as_range("x", "elbow") is None
    )
    for wrong in ((1.0, 2.0, 4.0), (1.0,), ("a", "b")):
        with pytest.raises(MechlabError, match="^x: expected"):
            as_range("x", wrong)


# -- results ----------------------------------------------------------------------------------------------------------------

RESULTS: dict[str, Any] = {
    "solve": lambda p: ml.solve("fourbar", crank_angle=1.0),
    "sensitivity": lambda p: ml.sensitivity("fourbar", crank_angle=1.0, only=("crank",)),
    "simulate": lambda p: ml.simulate("pendulum", duration=0.05),
    "load": lambda p: ml.load("pendulum", length=2.0),
    "mechanism": lambda p: ml.load("pendulum").mechanism(),
    "list": lambda p: ml.list_entries(),
    "show": lambda p: ml.show("pendulum"),
    "generate": lambda p: ml.generate("pendulum", out=p),
    "check": lambda p: ml.check("pendulum"),
    "claims": lambda p: ml.claims("class4_linkage"),
    "cycle": lambda p: ml.cycle("fourbar", points=4),
    "modes": lambda p: ml.modes("pendulum"),
    "sweep": lambda p: ml.sweep("fourbar", {"crank_angle": (0.0, 1.0)}, "rocker_angle"),
    "workspace": lambda p: ml.workspace("fivebar", {"P_x": Range(-0.3, 0.3, 4), "P_y": Range(0.1, 0.3, 4)}),
    "track": lambda p: ml.track("fourbar", crank_angle=(1.0, 1.5, 2.0)),
    "portrait": lambda p: ml.portrait(
        "impulse_transmission", "phase", beta_0=(-0.2, 0.2), beta_rate_0=(-9.0, 9.0), duration=0.01
    ),
    "fidelities": lambda p: ml.fidelities("pendulum", duration=0.1),
    "chart": lambda p: ml.chart("pendulum", duration=0.1),
    "stability": lambda p: ml.stability(
        "fourbar", coupler_mass=(1e-3, 1e3), budget=0.5, scene="free-run", methods=("RK4",)
    ),
    "run": lambda p: ml.run("pendulum", {"duration": 0.2}, p),
    "optimize": lambda p: ml.optimize("pendulum", length=(0.5, 1.0), maximize="length", evaluations=40),
    "fit": lambda p: ml.fit("fourbar", ROOT / "tests" / "studies" / "measured_angles.csv", crank=(0.05, 0.2)),
    "synthesize": lambda p: ml.synthesize("planetary", ratio=6, planets=3),
    "compare": lambda p: ml.compare("walking"),
    "doctor": lambda p: ml.doctor("pendulum"),
    "view": lambda p: ml.view("pendulum", png=p / "a.png"),
}


SLOW = ("chart", "stability", "run")


@pytest.mark.parametrize("verb", [pytest.param(v, marks=[pytest.mark.slow] if v in SLOW else []) for v in RESULTS])
def test_a_result_is_one_line_and_prints_its_table(verb: str, tmp_path: Path) -> None:
    result = RESULTS[verb](tmp_path)
    assert isinstance(result, Shown)
    line, text = repr(result), str(result)
    assert "\n" not in line and 10 < len(line) < 200 and not line.startswith("<")
    assert text == result.text() and text.count("\n") >= 1 and result._repr_html_()


def test_a_run_that_is_not_trusted_is_saved_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["simulate", "n_fourbar", "--duration", "1", "--timestep", "0.05", "-o", str(tmp_path / "run.npz")]
    assert main(words) == 3
    assert not ml.load_recording(tmp_path / "run.npz").health.trusted and capsys.readouterr().err


# -- dependencies -----------------------------------------------------------------------------------------------------------

OTHER_NAMES = {
    "pinocchio": "pin", "pxr": "usd-core", "pydrake": "drake", "exudyn": "exudyn", "opensim": "opensim", "warp": "warp-lang",
}  # fmt: skip
"""Packages that come under another name, or that are not always installed."""


def test_what_is_imported_is_declared() -> None:
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    declared = {d.lower() for d in re.findall(r'^    "([A-Za-z0-9_.-]+)(?:>=|==)', text, re.M)}
    homes = packages_distributions()

    def undeclared(names: set[str]) -> list[str]:
        given = {n: {OTHER_NAMES.get(n, n), *homes.get(n, [])} for n in names - {"mechlab", *sys.stdlib_module_names}}
        return [n for n, others in given.items() if not {d.lower().replace("_", "-") for d in others} & declared]

    for path in (ROOT / "mechlab").rglob("*.py"):
        text = path.read_text("utf-8")
        if not undeclared(set(re.findall(r"^ *(?:import|from) (\w+)", text, re.M))):
            continue  # what looks like an import may be a word in a text
        nodes = list(ast.walk(ast.parse(text)))
        found = {a.name for n in nodes if isinstance(n, ast.Import) for a in n.names}
        found |= {n.module or "" for n in nodes if isinstance(n, ast.ImportFrom) and not n.level}
        assert not (missing := undeclared({n.split(".")[0] for n in found} - {""})), f"{path}: {missing}"


# -- files that hold no mechanism -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verb", [ml.simulate, ml.modes, ml.chart, ml.cycle])
def test_a_file_without_joints_is_shown_and_nothing_else(tmp_path: Path, verb: Callable[[str], object]) -> None:
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = f'<link name="base"/><link name="top">{mass}</link>'
    joint = '<joint name="bond" type="fixed"><parent link="base"/><child link="top"/></joint>'
    path = tmp_path / "rigid.urdf"
    path.write_text(f'<robot name="rigid">{links}{joint}</robot>')
    assert "0 degrees of freedom" in str(ml.load(str(path)))
    with pytest.raises(MechlabError, match="rigid: it has no joints"):
        verb(str(path))


def test_a_file_of_another_kind_is_named(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf.xacro"
    path.write_text("<robot/>")
    with pytest.raises(MechlabError, match="cannot read .*arm.urdf.xacro: expected a name that ends in .json, .xml, .urdf .*xacro FILE"):
        ml.load(str(path))


def test_a_recording_that_view_could_not_open_is_refused_before_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    from mechlab.api import runs

    monkeypatch.setattr(runs, "_simulated", lambda *args: pytest.fail("the run began"))
    for name in ("run.txt", "run.csv", "run"):
        with pytest.raises(MechlabError, match=f"ends in .npz, got {name}"):
            ml.simulate("fourbar", out=name)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("roberts", {"crank": 0.2, "ground": 0.5}), ("schmidt", {"offset": 0.09, "radius": 0.0376}), ("pump_jack", {"pitman": 8.7}),
        ("rssr", {"back": 0.472}), ("rrs3", {"platform": 0.0438, "height": 0.236}),
        ("berkof_lowen", {"coupler": 0.774, "ground": 0.13}),
    ],
)  # fmt: skip
def test_lengths_that_do_not_reach_each_other_are_named(name: str, parameters: dict[str, float]) -> None:
    with pytest.raises(ml.NoSolution, match="cannot be put together with " + ", ".join(f"{k}={v}" for k, v in parameters.items())):
        ml.load(name, **parameters).mechanism()
