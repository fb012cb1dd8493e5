"""Files of sweeps: the dataset and its picture, what an interrupted sweep keeps, and how it is resumed."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.cli import main
from mechlab.errors import EngineMissing, MechlabError
from mechlab.studies.sweep import schedulers as local
from mechlab.studies.sweep import study as work
from mechlab.studies.sweep.evaluate import evaluate
from mechlab.studies.sweep.result import read_dataset
from mechlab.studies.sweep.study import Interrupted
from mechlab.values import Range
from tests.studies.swinging import same

FIXED = {"z": 0.0, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}


def test_the_dataset_survives_its_file_with_names_units_and_provenance(tmp_path: Path) -> None:
    out, picture = tmp_path / "f.nc", tmp_path / "f.png"
    words = f"sweep delta6 x=-0.1:0.1:5 y=-100mm:100mm:5 z=0 alpha=0 beta=0 gamma=0 quantity=q1,q2 -o {out} --plot {picture}"
    assert main(words.split()) == 0
    found = ml.sweep("delta6", {"x": Range(-0.1, 0.1, 5), "y": Range(-0.1, 0.1, 5)}, ["q1", "q2"], **FIXED)
    ds = read_dataset(out)
    assert ds.drop_attrs().identical(found.dataset.drop_attrs())
    assert (
        ds["q1"].attrs["units"] == "m"
        and ds["x"].attrs["units"] == "m"
        and ds["reason"].values[0, -1].startswith("out of reach")
    )
    assert json.loads(ds.attrs["versions"])["mechlab"] and ds.attrs["fingerprint"] == found.request.fingerprint
    assert json.loads(ds.attrs["given"]) == FIXED and picture.stat().st_size > 5000
    assert not list(tmp_path.glob("*.parts")) and not list(tmp_path.glob(".*"))


def test_words_can_be_an_axis_and_one_axis_is_a_line(tmp_path: Path) -> None:
    found = ml.sweep(
        "fourbar",
        mode=[-1, 1],
        crank_angle=0.5,
        quantities="coupler_angle",
        plot=tmp_path / "a.svg",
        out=tmp_path / "a.nc",
    )
    truth = [ml.solve("fourbar", mode=m, crank_angle=0.5)["analytic"]["coupler_angle"] for m in (-1, 1)]
    assert found["coupler_angle"].tolist() == truth
    assert "<svg" in (tmp_path / "a.svg").read_text() and read_dataset(tmp_path / "a.nc")["mode"].values.tolist() == [
        -1.0,
        1.0,
    ]


def test_damaged_parts_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an interrupted sweep has left is believed only as far as it fits the request."""
    out, values, calls = tmp_path / "s.nc", {"crank_angle": Range(0.1, 3.0, 8)}, iter(range(5))
    asked = {"quantities": "coupler_angle", "witness": "mujoco", "workers": 1, "out": out}

    def ended(request, block, threads=1):
        if next(calls) == 4:
            raise KeyboardInterrupt
        return evaluate(request, block, threads)

    with monkeypatch.context() as patched, pytest.raises(Interrupted):
        patched.setattr(local, "evaluate", ended)
        ml.sweep("fourbar", values, **asked)
    parts = out.with_name("s.nc.parts")
    blocks, request = next(parts.glob("blocks-*.npz")), parts / "request.json"
    whole = blocks.read_bytes(), request.read_bytes()

    def refused(words: str) -> None:
        with pytest.raises(MechlabError, match=words):
            ml.sweep("fourbar", values, resume=True, **asked)
        blocks.write_bytes(whole[0])
        request.write_bytes(whole[1])

    for text in (b"[" * 60_000, b"\xff", b"{", b'{"axes": "\\ud800"}', b"[]"):
        request.write_bytes(text)
        refused("request.json")
    for content in (b"", whole[0][:-40], whole[0].replace(b"indices", b"indicez")):
        blocks.write_bytes(content)
        refused("is damaged: .*Remove it")
    with np.load(blocks) as arrays:
        kept = dict(arrays)
    first = int(kept["indices"][0])
    for name, value in (
        (f"values{first}", np.zeros(3)), (f"outcomes{first}", np.array(["x"])), ("indices", np.array([10**6])),
        (f"reasons{first}", np.frombuffer(b"[", np.uint8)),
    ):  # fmt: skip
        np.savez(blocks, **kept | {name: value})
        refused("is damaged")
    assert ml.sweep("fourbar", values, resume=True, **asked).evaluated == 4


def test_a_sweep_that_is_interrupted_at_once_names_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(request, block, threads=1):
        raise KeyboardInterrupt

    monkeypatch.setattr(local, "evaluate", ended)
    with pytest.raises(Interrupted, match="none of 8 points was finished, nothing is kept"):
        ml.sweep(
            "fourbar", {"crank_angle": Range(0.1, 3.0, 8)}, quantities="coupler_angle", witness="mujoco", workers=1,
            out=tmp_path / "s.nc",
        )  # fmt: skip
    assert not list(tmp_path.iterdir())


def test_an_interrupted_sweep_is_resumed_without_repeating_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "s.nc"
    values = {"crank": Range(0.05, 0.15, 8), "crank_angle": Range(0.1, 3.0, 8)}
    asked = {"quantities": "coupler_angle", "witness": "mujoco", "workers": 1}
    whole = ml.sweep("fourbar", values, **asked)
    calls: list[int] = []

    def counted(request, block, threads=1):
        if len(calls) == 20:
            calls.append(-1)
            raise KeyboardInterrupt
        calls.append(block)
        return evaluate(request, block, threads)

    monkeypatch.setattr(local, "evaluate", counted)
    with pytest.raises(Interrupted, match="20 of 64 points are kept"):
        ml.sweep("fourbar", values, out=out, **asked)
    assert not out.exists()
    with pytest.raises(MechlabError, match="--resume"):
        ml.sweep("fourbar", values, out=out, **asked)
    changed = values | {"crank": Range(0.05, 0.14, 8)}
    with pytest.raises(MechlabError, match="axes crank differ"):
        ml.sweep("fourbar", changed, out=out, resume=True, **asked)
    resumed = ml.sweep("fourbar", values, out=out, resume=True, **asked)
    done = [k for k in calls if k >= 0]
    assert sorted(done) == list(range(whole.request.blocks)) and resumed.evaluated == 64 - 20
    assert same(whole, resumed) and not out.with_name("s.nc.parts").exists()
    again = ml.sweep("fourbar", values, out=out, resume=True, **asked)
    assert again.evaluated == 0 and len([k for k in calls if k >= 0]) == len(done) and same(whole, again)
    with pytest.raises(MechlabError, match="axes crank differ"):
        ml.sweep("fourbar", changed, out=out, resume=True, **asked)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGINT to send")
def test_ctrl_c_keeps_what_is_finished(swing: str, tmp_path: Path) -> None:
    out = tmp_path / "s.nc"
    words = [swing, "length=0.5:2:3000", "--duration", "0.5", "--quantity", "hinge", "-o", str(out)]
    # a shell has what it runs in the background ignore SIGINT, and children inherit that
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heard}; from mechlab.cli import main; raise SystemExit(main())"
    with subprocess.Popen([sys.executable, "-c", code, "sweep", *words], stderr=subprocess.PIPE, text=True) as child:
        parts = out.with_name("s.nc.parts")
        while child.poll() is None and not list(parts.glob("blocks-*.npz")):
            time.sleep(0.05)
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=300)[1]
    assert child.returncode == 130 and "--resume goes on from there" in said and "Traceback" not in said
    assert (parts / "request.json").is_file() and not out.exists()


def test_without_xarray_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(EngineMissing, match=r"mechanism-lab\[cluster\]"):
        ml.sweep("fourbar", crank_angle=Range(0.0, 1.0, 3), out=tmp_path / "a.nc")
    assert ml.sweep("fourbar", crank_angle=Range(0.0, 1.0, 3)).counts["good"] == 3


def test_progress_counts_points_and_a_sweep_that_fails_keeps_its_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[int, int]] = []
    ml.sweep(
        "fourbar", crank_angle=Range(0.0, 1.0, 100), witness="pinocchio", progress=lambda *x: seen.append(x), workers=1
    )
    assert seen[0] == (0, 100) and seen[-1] == (100, 100) and [a for a, _ in seen] == sorted(a for a, _ in seen)
    monkeypatch.setattr(
        work, "run_on_cores", lambda request, left, *a: iter([(left[0], evaluate(request, left[0])), 1 / 0])
    )
    with pytest.raises(ZeroDivisionError):
        api.sweep("fourbar", {"crank_angle": Range(0.0, 1.0, 3)}, out=tmp_path / "a.nc")
