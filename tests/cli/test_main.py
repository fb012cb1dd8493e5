"""The command line over a stand-in for the API: what each verb passes on, exit codes, messages, documents."""

import functools
import inspect
import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import mechlab
from mechlab import api as real
from mechlab.cli import VERBS, main
from mechlab.cli.output import encode
from mechlab.errors import MechlabError, NoSolution, Untrustworthy
from mechlab.values import Range

COMMANDS = {
    "run": ["run", "delta6"],
    "list": ["list"],
    "show": ["show", "delta6"],
    "generate": ["generate", "delta6", "-o", "out"],
    "solve": ["solve", "delta6", "x=1"],
    "simulate": ["simulate", "delta6"],
    "cycle": ["cycle", "fourbar"],
    "track": ["track", "fourbar", "crank_angle=0:1:5"],
    "chart": ["chart", "fourbar"],
    "check": ["check", "delta6"],
    "claims": ["claims", "delta6"],
    "sweep": ["sweep", "impulse_transmission", "--portrait", "phase"],
    "modes": ["modes", "pendulum"],
    "stability": ["stability", "flyball"],
    "synthesize": ["synthesize", "planetary", "ratio=6"],
    "compare": ["compare", "walking"],
    "optimize": ["optimize", "delta6"],
    "fit": ["fit", "fourbar", "data.csv", "crank=50mm:200mm"],
    "workspace": ["workspace", "delta6"],
    "doctor": ["doctor", "arm.xml"],
    "view": ["view", "run.npz"],
}


@dataclass
class FakeResult:
    exit_code: int = 0
    document: dict[str, Any] = field(default_factory=lambda: {"answers": {"analytic": {"q1": 0.1 + 0.2}}})

    def to_dict(self) -> dict[str, Any]:
        return self.document

    def text(self) -> str:
        return "a table"


class FakeApi(ModuleType):
    """Answers every function, with the signatures of the API; remembers the last call; raises `error` if there is one."""

    def __init__(self) -> None:
        super().__init__("mechlab.api")
        self.called: tuple[str, tuple[Any, ...], dict[str, Any]] = ("", (), {})
        self.result = FakeResult()
        self.error: BaseException | None = None
        for name in real.__all__:
            if inspect.isfunction(function := getattr(real, name)):
                setattr(self, name, self.stand_in(name, function))

    def stand_in(self, name: str, function: Any) -> Any:
        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> FakeResult:
            self.called = (name, args, kwargs)
            print("an engine is talking")
            if self.error is not None:
                raise self.error
            return self.result

        return call


@pytest.fixture
def api(monkeypatch: pytest.MonkeyPatch) -> FakeApi:
    fake = FakeApi()
    monkeypatch.setitem(sys.modules, "mechlab.api", fake)
    monkeypatch.setattr(mechlab, "api", fake, raising=False)
    monkeypatch.delenv("MECHLAB_DEBUG", raising=False)
    return fake


def only_document(capsys: pytest.CaptureFixture[str]) -> tuple[dict[str, Any], str]:
    captured = capsys.readouterr()

    def refuse(text: str) -> None:
        raise AssertionError(f"not JSON: {text}")

    document = json.loads(captured.out, parse_constant=refuse)
    assert {"schema", "command", "status", "exit_code", "units", "versions", "parameters"} <= document.keys()
    return document, captured.err


def test_options_stand_anywhere_among_the_values(api: FakeApi) -> None:
    assert main(["show", "leg=1,2", "--fidelity", "full", "delta6", "k=17/22", "--json", "x=5mm"]) == 0
    values = {"leg": (1.0, 2.0), "k": Fraction(17, 22), "x": 0.005}
    assert api.called == ("show", ("delta6", values), {"fidelity": "full"})


def test_simulate_passes_its_options_on_and_saves(api: FakeApi, tmp_path: Path) -> None:
    out = tmp_path / "run.npz"
    command = "simulate delta6 --scene s --duration 3 --timestep 1ms --engine mujoco --at 1,3 x_0=1 --fidelity full"
    assert main([*command.split(), "-o", str(out)]) == 0
    assert api.called == (
        "simulate",
        ("delta6", {"x_0": 1.0}),
        {
            "scene": "s",
            "duration": 3.0,
            "timestep": 0.001,
            "engine": "mujoco",
            "fidelity": "full",
            "at": (1.0, 3.0),
            "out": out,
        },
    )


def test_the_other_verbs_pass_their_options_on(api: FakeApi) -> None:
    main(["generate", "delta6", "-o", "out", "--fidelity", "parts", "a=1"])
    assert api.called == ("generate", ("delta6", {"a": 1.0}), {"out": Path("out"), "fidelity": "parts"})
    main(["solve", "delta6", "x=1"])
    assert api.called == ("solve", ("delta6", {"x": 1.0}), {})
    main(["check", "a", "b", "x=1"])
    assert api.called[:2] == ("check", (["a", "b"], {"x": 1.0})) and api.called[2].keys() == {"progress"}
    main(["claims"])
    assert api.called[:2] == ("claims", ([],)) and api.called[2].keys() == {"progress"}
    main(["list"])
    assert api.called == ("list_entries", (), {})
    main(["view", "run.npz", "--html", "a.html"])
    assert api.called[:2] == ("view", ("run.npz", {}))
    assert api.called[2]["html"] == Path("a.html") and "host" not in api.called[2]
    main(["run", "delta6", "-o", "there"])
    assert api.called[:2] == ("run", ("delta6", {})) and api.called[2]["out"] == Path("there")


def test_run_says_something_before_the_engines_load(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "mechlab.api.pages", None)  # what the engines come with: its import fails
    assert main(["run", "delta6"]) == 1
    assert capsys.readouterr().out.startswith("delta6: the whole pipeline, into out\n")


def test_every_verb_has_a_module_and_a_command_here(api: FakeApi) -> None:
    assert COMMANDS.keys() == VERBS.keys()
    for verb, command in COMMANDS.items():
        assert main(command) == 0, verb
        assert main([verb, "--help"]) == 0


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize(
    ("error", "code", "status"),
    [
        (MechlabError("no body 'x'"), 1, "bad input"),
        (Untrustworthy("the loop opened"), 3, "not to be trusted"),
        (NoSolution("the point is out of reach"), 4, "no solution exists"),
        (PermissionError(13, "Permission denied", "/there"), 1, "bad input"),
        (ZeroDivisionError("a bug\nof ours"), 1, "internal error"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_a_failure_is_one_message_and_one_document(
    api: FakeApi, capsys: pytest.CaptureFixture[str], verb: str, error: BaseException, code: int, status: str
) -> None:
    api.error = error
    assert main(COMMANDS[verb]) == code
    plain = capsys.readouterr().err
    assert plain.startswith("mechlab: ") and plain.count("\n") == 1 and "Traceback" not in plain
    assert main([*COMMANDS[verb], "--json"]) == code
    document, err = only_document(capsys)
    assert err.endswith(plain) and "Traceback" not in err
    assert (document["status"], document["exit_code"]) == (status, code)
    assert document["error"] == {"kind": type(error).__name__, "message": plain[9:].strip()}


@pytest.mark.parametrize(
    ("command", "code", "said"),
    [
        ("sovle delta6", 2, "'sovle' does not exist. Did you mean 'solve'?"),
        ("solve", 2, "NAME is missing"),
        ("solve a b", 2, "one NAME"),
        ("solve delta6 --nonsense", 2, "--nonsense"),
        ("generate delta6", 2, "-o"),
        ("simulate a --timestep 1 --max-error 1", 2, "not allowed with"),
        ("list delta6", 2, "takes no NAME"),
        ("claims delta6 x=1", 2, "takes no key=value"),
        ("simulate delta6 --duration nan", 1, "--duration: expected a finite number"),
        ("simulate delta6 --duration 5mm", 1, "--duration: expected a number [s]"),
        ("solve delta6 x=nan", 1, "x: expected a finite number"),
        ("solve delta6 x=1 x=2", 1, "x is given twice"),
    ],
)
def test_wrong_commands(api: FakeApi, capsys: pytest.CaptureFixture[str], command: str, code: int, said: str) -> None:
    assert main(command.split()) == code
    captured = capsys.readouterr()
    assert said in captured.err and captured.err.count("\n") == 1 and not captured.out
    assert api.called[0] == ""
    assert main([*command.split(), "--json"]) == code
    assert only_document(capsys)[0]["exit_code"] == code


def test_a_result_decides_the_exit_code_and_the_message(api: FakeApi, capsys: pytest.CaptureFixture[str]) -> None:
    api.result = FakeResult(4, {"status": "out of reach", "answers": {}})
    assert main(["solve", "delta6", "x=9"]) == 4
    captured = capsys.readouterr()
    assert captured.out.endswith("a table\n") and captured.err == "mechlab: out of reach\n"
    assert main(["solve", "delta6", "x=9", "--json"]) == 4
    document, err = only_document(capsys)
    assert document["status"] == "out of reach" and document["exit_code"] == 4 and err.endswith("out of reach\n")
    api.result = FakeResult(3, {"status": "not converged", "message": "Newton stopped at 1e-3. Try another start."})
    assert main(["solve", "delta6", "x=9"]) == 3
    assert capsys.readouterr().err == "mechlab: Newton stopped at 1e-3. Try another start.\n"


def test_a_document_repeats_what_was_asked(api: FakeApi, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "delta6", "x=0.1", "k=17/22", "r=0:1:5", "--json"]) == 0
    document, err = only_document(capsys)
    assert document["names"] == ["delta6"] and document["command"] == "solve"
    assert document["parameters"] == {"x": 0.1, "k": "17/22", "r": "0.0:1.0:5"}
    assert document["answers"]["analytic"]["q1"] == 0.30000000000000004  # all 17 digits
    assert document["versions"]["numpy"] == np.__version__
    assert err == "an engine is talking\n"


def test_the_parameters_of_a_result_win(api: FakeApi, capsys: pytest.CaptureFixture[str]) -> None:
    api.result = FakeResult(0, {"parameters": {"rod_length": 0.4}})
    assert main(["solve", "delta6", "x=1", "--json"]) == 0
    assert only_document(capsys)[0]["parameters"] == {"rod_length": 0.4}


def test_json_knows_arrays_and_never_prints_nan() -> None:
    class Status(Enum):
        SOLVED = "solved"

    document = {
        "nan": math.nan,
        "array": np.array([[1.0, np.inf], [2.0, 3.0]]),
        "scalar": np.float64("nan"),
        "int": np.int64(3),
        "half": np.float32(0.5),
        "status": Status.SOLVED,
        "ratio": Fraction(1, 3),
        "range": Range(0.0, 1.0),
        "path": Path("a"),
        "flag": np.bool_(True),
        "none": None,
        "tuple": (1, "ü"),
        5: "key",
    }
    assert json.loads(encode(document)) == {
        "nan": None,
        "array": [[1.0, None], [2.0, 3.0]],
        "scalar": None,
        "int": 3,
        "half": 0.5,
        "status": "solved",
        "ratio": "1/3",
        "range": "0.0:1.0",
        "path": "a",
        "flag": True,
        "none": None,
        "tuple": [1, "ü"],
        "5": "key",
    }


def test_a_traceback_only_when_asked(
    api: FakeApi, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    api.error = ValueError("deep inside")
    monkeypatch.setenv("MECHLAB_DEBUG", "1")
    assert main(["list"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    printed = capsys.readouterr().out
    assert all(f"  {verb} " in printed for verb in VERBS) and "mechlab run delta6 -o out" in printed
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("mechlab ")


def command_line(*arguments: str) -> list[str]:
    return [sys.executable, "-c", "import sys; from mechlab.cli import main; sys.exit(main())", *arguments]


def test_a_reader_that_goes_away_is_no_error() -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(command_line("--help"), stdout=write, stderr=subprocess.PIPE, timeout=300)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, b"")


def test_native_output_stays_out_of_the_document(tmp_path: Path) -> None:
    code = (
        "import os, sys, types\n"
        "api = types.ModuleType('mechlab.api')\n"
        "class Result:\n"
        "    exit_code = 0\n"
        "    def to_dict(self): os.write(1, b'native'); return {'status': 'fine'}\n"
        "api.list_entries = Result\n"
        "import mechlab; mechlab.api = sys.modules['mechlab.api'] = api\n"
        "from mechlab.cli import main\n"
        "sys.exit(main(['list', '--json']))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "fine" and done.stderr == "native"


def test_python_m_mechlab_is_the_command() -> None:
    """`python -m mechlab` works where the folder of scripts is not on the path; its exit code is the command's."""
    asked = [sys.executable, "-m", "mechlab", "solve", "fourbar", "q=nonsense"]
    run = subprocess.run(asked, capture_output=True, text=True, timeout=120)
    assert run.returncode == 1
    assert run.stderr.startswith("mechlab: ") and "nonsense" in run.stderr
