"""What code of a user may do: end Python, raise anything, print, hang. One message with file and line, one document."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import mechlab
import mechlab as ml
from mechlab.cli import main

GOOD = """
from mechlab.mechanism import Builder, revolute

def swing(length=1.0):
    b = Builder("swing")
    b.bar("bar", revolute("hinge", "y"), length, mass=2.0)
    return b.build()
"""
ON_IMPORT = {
    "exit 0": ("raise SystemExit(0)", "SystemExit: 0"),
    "exit 7": ("import sys; sys.exit(7)", "SystemExit: 7"),
    "exit with words": ("exit('enough')", "SystemExit: enough"),
    "own kind of end": ("class Stop(BaseException): pass\nraise Stop('now')", "Stop: now"),
    "an error": ("1 / 0", "ZeroDivisionError: division by zero"),
    "endless recursion": ("def f(): return f()\nf()", "RecursionError"),
    "an error without words": ("raise ValueError", "ValueError"),
    "an error that cannot be told": ("class E(Exception):\n  def __str__(self): 1 / 0\nraise E", "E"),
    "a generator's end": ("raise GeneratorExit", "GeneratorExit"),
    "no Python": ("def (", "invalid syntax"),
}


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("where", ["on import", "when called"])
@pytest.mark.parametrize("name", ON_IMPORT)
def test_one_message_and_one_document(name: str, where: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, words = ON_IMPORT[name]
    if where == "when called":
        code = "def f(a=1.0):\n" + "\n".join(f"  {line}" for line in code.splitlines())
    Path("my.py").write_text(f"print('on stdout')\n{code}\n")
    assert main(["show", "my.py", "--json"]) == 1
    out, error = capsys.readouterr()
    document = json.loads(out)
    message = document["error"]["message"]
    assert document["exit_code"] == 1 and document["status"] == "bad input" and words in message
    assert error == f"on stdout\nmechlab: {message}\n" if name != "no Python" else f"mechlab: {message}\n" in error
    line = 1 + [k for k, text in enumerate(Path("my.py").read_text().splitlines(), 1) if text.strip()][-1]
    assert any(f"my.py, line {k}: " in message for k in range(2, line + 1)), message


def test_the_line_is_that_of_the_error(capsys: pytest.CaptureFixture[str]) -> None:
    Path("my.py").write_text(GOOD + "\nimport sys\n\nsys.exit(7)\n")
    assert main(["show", "my.py:swing"]) == 1
    assert "my.py, line 11: SystemExit: 7" in capsys.readouterr().err


def test_a_sweep_whose_code_ends_at_some_points() -> None:
    """Parameters beyond 1.5: the file calls exit. Those points are gaps with the reason, the others are answered."""
    Path("my.py").write_text(
        GOOD.replace("    b = Builder", "    if length > 1.5: raise SystemExit(3)\n    b = Builder")
    )
    found = ml.sweep("my.py:swing", length=[1.0, 2.0], quantities="hinge_rate", scene="free-motion", duration=0.01)
    assert list(found.outcome) == [0, 1]
    assert "my.py, line 5: SystemExit: 3" in found.reasons[1]


def test_a_function_of_an_entry_that_ends_python(capsys: pytest.CaptureFixture[str]) -> None:
    """Of an entry that a file exports, every function may fail while it is used."""
    for code, words in (("raise SystemExit(0)", "SystemExit: 0"), ("{}['gain']", "KeyError: 'gain'")):
        Path("my.py").write_text(f"""{GOOD}
from dataclasses import replace
from mechlab.lab.own_mechanism import entry_of_function

def doubts(p):
    {code}

ENTRY = replace(entry_of_function(swing), warnings=doubts)
""")
        assert main(["simulate", "my.py:ENTRY", "--duration", "0.01", "--json"]) == 1
        document = json.loads(capsys.readouterr().out)
        assert f"my.py, line 13: {words}" in document["error"]["message"]
        assert document["status"] == "bad input"


def process(*words: str, **more: object) -> subprocess.Popen[str]:
    code = "import sys; from mechlab.cli import main; sys.exit(main())"
    env = os.environ | {"PYTHONPATH": str(Path(mechlab.__file__).parents[1])}
    return subprocess.Popen(
        [sys.executable, "-c", code, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env, **more
    )  # type: ignore[call-overload,no-any-return]


def test_what_is_printed_at_the_end_stays_out_of_the_document() -> None:
    Path("my.py").write_text(f"import atexit, os\natexit.register(print, 'bye')\nos.system('echo child')\n{GOOD}")
    child = process("show", "my.py:swing", "--json")
    out, error = child.communicate(timeout=100)
    assert child.returncode == 0 and json.loads(out)["exit_code"] == 0
    assert "bye" in error and "child" in error


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_file_that_never_ends_is_interrupted(number: int, code: int) -> None:
    Path("my.py").write_text("import sys\nprint('ready', file=sys.stderr, flush=True)\nwhile True: pass\n")
    child = process(
        "show", "my.py", "--json", preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler)
    )
    assert child.stderr is not None and child.stderr.readline() == "ready\n"
    child.send_signal(number)
    out, error = child.communicate(timeout=100)
    assert child.returncode == code and "Traceback" not in error
    assert json.loads(out)["exit_code"] == code
