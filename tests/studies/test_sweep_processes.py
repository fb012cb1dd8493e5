"""Sweeps in several processes: the same bits, and nothing left over or lost when one of them dies."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.studies.sweep import schedulers as local
from mechlab.values import Range
from tests.studies.swinging import SWING, same


@pytest.mark.slow
def test_processes_give_the_same_bits_and_one_that_dies_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker, file = tmp_path / "died", tmp_path / "fragile.py"
    file.write_text(f'''import os
from multiprocessing import parent_process
from pathlib import Path
{
        SWING.replace(
            'b = Builder("swing")',
            """b = Builder("swing")
    if parent_process() is not None and length > 1.2 and not Path(MARKER).exists():
        Path(MARKER).touch()
        os._exit(9)""",
        )
    }
MARKER = {str(marker)!r}
''')
    monkeypatch.setattr(local, "WORTH_IT", 0.0)
    values = {"length": Range(0.5, 1.5, 24), "hinge_0": 0.4}
    alone = ml.sweep(f"{file}:swing", values, "hinge_accel", duration=0.05, workers=1)
    assert not marker.exists()
    shared = ml.sweep(f"{file}:swing", values, "hinge_accel", duration=0.05, workers=2)
    assert marker.exists() and shared.counts["good"] == 24, shared.reasons
    assert np.array_equal(alone.flat, shared.flat) and same(alone, shared), (alone.flat - shared.flat, shared.reasons)


def test_a_function_without_a_name_stays_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "WORTH_IT", 0.0)
    monkeypatch.setattr(local, "in_processes", lambda *a: pytest.fail("it cannot be sent"))
    scope: dict = {}
    exec(SWING, scope)
    found = ml.sweep(lambda length=1.0: scope["swing"](length), {"length": [0.5, 1.0, 1.5]}, "hinge", duration=0.01)
    assert found.counts["good"] == 3


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up in /proc")
def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    """The workers write down who they are; none of them is left after kill -9 of the parent."""
    file = tmp_path / "slow.py"
    file.write_text(SWING + f'''
import os, time
(__import__("pathlib").Path({str(tmp_path)!r}) / f"worker-{{os.getpid()}}").touch()
''')  # fmt: skip
    words = ["sweep", f"{file}:swing", "length=0.5:2:4000", "--duration", "1", "--quantity", "hinge_accel", "--workers", "2"]
    code = "from mechlab.cli import main; raise SystemExit(main())"
    with subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.DEVNULL) as child:

        def workers() -> set[int]:
            seen = {int(p.name.split("-")[1]) for p in tmp_path.glob("worker-*")} - {child.pid}
            return {w for w in seen if running(w)}

        while child.poll() is None and not workers():
            time.sleep(0.05)
        assert workers()
        child.kill()
    for _ in range(600):
        if not workers():
            break
        time.sleep(0.05)
    assert not workers()


def running(process: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
