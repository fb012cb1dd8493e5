"""A film that is being made: its progress without a terminal, and what an interruption leaves."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mechlab import api
from mechlab.errors import EngineMissing
from mechlab.formats import save_recording
from mechlab.viewer.picture import Drawing

ENCODER = """#!{python}
import sys
with open(sys.argv[-1], "wb") as film:
    while data := sys.stdin.buffer.read(65536):
        film.write(data)
"""
SIZE = (64, 48)


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """The file of a short run, and an environment whose ffmpeg keeps the frames as they are."""
    folder = tmp_path_factory.mktemp("film")
    recording = api.simulate("fourbar", duration=0.5)
    try:
        Drawing(api.story(recording), SIZE).__exit__()
    except EngineMissing as error:
        pytest.skip(str(error))
    save_recording(recording, folder / "run.npz")
    (folder / "bin").mkdir()
    encoder = folder / "bin" / "ffmpeg"
    encoder.write_text(ENCODER.format(python=sys.executable))
    encoder.chmod(0o755)
    path = os.pathsep.join([str(folder / "bin"), os.environ.get("PATH", "")])
    return folder / "run.npz", {**os.environ, "PATH": path, "PYTHONPATH": os.pathsep.join(sys.path)}


def film(started: tuple[Path, dict[str, str]], out: Path) -> subprocess.Popen[str]:
    run, environment = started
    command = [sys.executable, "-m", "mechlab", "view", str(run), "--mp4", str(out)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # a shell's background job ignores it
    )  # fmt: skip


def test_progress_is_a_line_for_every_tenth(started: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    with film(started, tmp_path / "film.mp4") as process:
        _, told = process.communicate(timeout=300)
    assert process.returncode == 0
    assert [int(x) for x in re.findall(r": (\d+) %", told)] == list(range(10, 101, 10))
    frames = (tmp_path / "film.mp4").stat().st_size / (3 * 960 * 720)
    assert frames == np.floor(frames) and frames > 10


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("kind", [signal.SIGTERM, signal.SIGINT])
def test_an_interruption_leaves_nothing(started: tuple[Path, dict[str, str]], tmp_path: Path, kind: signal.Signals) -> None:
    with film(started, tmp_path / "new" / "film.mp4") as process:
        assert process.stderr is not None
        assert "10 %" in process.stderr.readline()
        process.send_signal(kind)
        _, told = process.communicate(timeout=120)
    assert process.returncode != 0
    assert "Traceback" not in told
    assert list(tmp_path.iterdir()) == []
