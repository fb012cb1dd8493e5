"""Real processes: a standard output that is full or closed, arguments that are no text."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import mechlab
from mechlab.cli import main

pytestmark = pytest.mark.skipif(os.name == "nt", reason="devices and bytes of POSIX")


def run(*words, **more):
    code = "import sys; from mechlab.cli import main; sys.exit(main())"
    env = os.environ | {"PYTHONPATH": str(Path(mechlab.__file__).parents[1])}
    return subprocess.run([sys.executable, "-c", code, *words], stderr=subprocess.PIPE, env=env, timeout=100, **more)


@pytest.mark.parametrize(
    "words", [["list"], ["list", "--json"], ["show", "nothing", "--json"], ["solve", "--help"], ["--help"]]
)
def test_a_full_disk_behind_the_output(words):
    with open("/dev/full", "wb") as full:
        done = run(*words, stdout=full)
    said = done.stderr.decode()
    assert done.returncode == 1
    assert said.splitlines()[-1] == "mechlab: cannot write to the standard output: No space left on device."
    assert "Traceback" not in said and "Exception ignored" not in said


@pytest.mark.parametrize("words", [["list"], ["list", "--json"], ["solve", "--help"]])
def test_a_reader_that_is_gone(words):
    read, write = os.pipe()
    os.close(read)
    try:
        done = run(*words, stdout=write)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize(
    "words", [["solve", b"four\xffbar"], ["solve", "fourbar", b"crank\xe9=1"], ["solve", b"f\xed\xa0\x80"]]
)
def test_an_argument_that_is_no_text(words):
    done = run(*words, "--json", stdout=subprocess.PIPE)
    document = json.loads(done.stdout)
    assert done.returncode == document["exit_code"] == 2
    assert "is no UTF-8 text" in document["error"]["message"] and b"Traceback" not in done.stderr


def test_a_surrogate_in_the_arguments_of_main(capsys):
    assert main(["solve", "fourbar", "crank=\ud800", "--json"]) == 2
    assert "'crank=\\ud800' is no UTF-8 text" in json.loads(capsys.readouterr().out)["error"]["message"]
