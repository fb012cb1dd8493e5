"""Commands that are ended at any moment: no half-written file, and after the next run no leftovers."""

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import mechlab
from mechlab.formats import from_json, load_recording
from mechlab.viewer.film import find_ffmpeg

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
COMMANDS = {
    "generate": ["generate", "fourbar", "-o", "out"],
    "run": ["run", "pendulum", "-o", "out"],
    "simulate": ["simulate", "fourbar", "--duration", "0.1", "-o", "out/rr.npz"],
    "film": ["out/short.npz", "out/fb.mp4"],
}
WAYS = (signal.SIGTERM, signal.SIGKILL, signal.SIGINT)
STARTS = "import mechlab.cli, sys; print('started', file=sys.stderr, flush=True); sys.exit(mechlab.cli.main())"
SMALL_FILM = """import signal, sys
from mechlab import api
from mechlab.viewer.film import write_mp4
signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
print('started', file=sys.stderr, flush=True)
try:
    write_mp4(api.story(sys.argv[1]), sys.argv[2], size=(64, 48), fps=6)
except KeyboardInterrupt:
    sys.exit(128 + signal.SIGINT)
"""
"""A film of a few seconds of work; how the command line ends is tested by the other commands and by `test_film_process`."""


def start(words, folder):
    env = os.environ | {"PYTHONPATH": str(Path(mechlab.__file__).parents[1])}
    return subprocess.Popen(
        [sys.executable, "-c", SMALL_FILM if words == COMMANDS["film"] else STARTS, *words], cwd=folder,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=env,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def finish(words, folder):
    child = start(words, folder)
    said = child.communicate(timeout=300)[1].decode()
    assert child.returncode == 0, said


def sound(path):
    """Every file can be read to its end by its own reader."""
    content = path.read_bytes()
    if path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
        load_recording(path)
    elif path.suffix == ".json":
        from_json(content.decode())
    elif path.suffix == ".html":
        assert content.rstrip().endswith(b"</html>")
    elif path.suffix in (".xml", ".urdf"):
        assert content.rstrip().endswith((b"</mujoco>", b"</robot>"))
    elif path.suffix == ".mp4":
        assert b"ftyp" in content[:12] and b"moov" in content


def leftovers(folder):
    return [p for p in folder.rglob("*") if p.name.startswith(".")]


def film():
    try:
        find_ffmpeg()
    except mechlab.errors.MechlabError:
        return False
    return True


@pytest.mark.parametrize("name", [n for n in COMMANDS if n != "film"])
def test_ended_at_any_moment(name, tmp_path):
    """Moments between the start and the end of the work, with two of the three ways to be ended, each command with others. The time
    that the work takes is measured first, and nothing is asserted of it."""
    campaign(name, tmp_path, moments=2)


@pytest.mark.skipif(not film(), reason="needs ffmpeg")
def test_a_film_that_is_ended(tmp_path):
    (tmp_path / "out").mkdir()
    finish(["simulate", "fourbar", "--duration", "0.01", "-o", "out/short.npz"], tmp_path)
    campaign("film", tmp_path, moments=2)


def campaign(name, folder, moments):
    rng = np.random.default_rng(sorted(COMMANDS).index(name))
    began = time.monotonic()
    finish(COMMANDS[name], folder)
    length = time.monotonic() - began
    whole = sorted(p.relative_to(folder) for p in folder.rglob("*"))
    for k in range(moments):
        if k % 2:  # a new folder half of the time
            subprocess.run(["rm", "-r", "out"], cwd=folder, check=True)
            (folder / "out").mkdir()
            if name == "film":
                finish(["simulate", "fourbar", "--duration", "0.01", "-o", "out/short.npz"], folder)
        child = start(COMMANDS[name], folder)
        child.stderr.readline()
        time.sleep(float(rng.uniform(0.0, length)))
        number = WAYS[(k + list(COMMANDS).index(name)) % 3]
        child.send_signal(number)
        said = child.communicate(timeout=300)[1].decode()
        # -number: before the command has begun, or after it is done, the signal ends Python itself
        assert child.returncode in (0, 128 + number, -number), said
        assert "Traceback" not in said
        for path in folder.rglob("*"):
            if path.is_file() and not any(p.startswith(".mechlab-") for p in path.parts):
                sound(path)
        if number != signal.SIGKILL:
            assert not leftovers(folder)
        finish(COMMANDS[name], folder)
        assert sorted(p.relative_to(folder) for p in folder.rglob("*")) == whole


def test_two_at_once_leave_one_of_theirs(tmp_path):
    """Two writers of one name: whoever is last, the file is whole, and nothing stays beside it."""
    for k in range(2):
        words = [["simulate", "fourbar", f"crank={c}", "--duration", "0.05", "-o", "rr.npz"] for c in (0.1, 0.09)]
        both = [start(w, tmp_path) for w in words]
        for b in both:
            b.communicate(timeout=300)
        assert [b.returncode for b in both] == [0, 0], k
        assert load_recording(tmp_path / "rr.npz").parameters["crank"] in (0.1, 0.09)
        assert [p.name for p in tmp_path.iterdir()] == ["rr.npz"]


def test_a_device_a_link_and_a_full_disk(tmp_path, monkeypatch, capsys):
    from mechlab.cli import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / "link.npz").symlink_to("real.npz")
    words = ["simulate", "fourbar", "--duration", "0.02", "-o"]
    assert main([*words, "link.npz"]) == 0
    assert (tmp_path / "link.npz").is_symlink() and load_recording("real.npz").name == "fourbar"
    assert main([*words, "/dev/full", "--json"]) == 1
    said = capsys.readouterr().out
    assert json.loads(said[said.index("\n{") + 1 :])["error"]["message"] == (
        "cannot write /dev/full: No space left on device."
    )
    assert not Path("/dev/full").is_file()

    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert main(["run", "pendulum", "-o", "out"]) == 1
    assert "cannot write out/" in (said := capsys.readouterr().err) and "No space left on device" in said
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link.npz", "real.npz"]
