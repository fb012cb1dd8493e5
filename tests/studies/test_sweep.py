"""Sweeps: numbers against the engines and closed forms called directly, gaps, datasets, resuming, processes."""

import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.analytic import gear_linkage
from mechlab.cli import main
from mechlab.errors import EngineMissing, MechlabError
from mechlab.studies.sweep import schedulers as local
from mechlab.studies.sweep import study as work
from mechlab.studies.sweep.evaluate import evaluate
from mechlab.studies.sweep.result import read_dataset
from mechlab.studies.sweep.study import Interrupted
from mechlab.values import Range

SWING = '''
from mechlab.mechanism import Builder, revolute

def swing(length=1.0, mass=2.0):
    """A bar on a hinge."""
    b = Builder("swing")
    b.bar("bar", revolute("hinge", "y"), length, mass=mass)
    return b.build()
'''
FIXED = {"z": 0.0, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}


@pytest.fixture
def swing(tmp_path: Path) -> str:
    file = tmp_path / "swing.py"
    file.write_text(SWING)
    return f"{file}:swing"


def same(a, b) -> bool:
    return (
        np.array_equal(a.flat, b.flat, equal_nan=True)
        and np.array_equal(a.outcomes, b.outcomes)
        and a.reasons == b.reasons
    )


# -- answers ----------------------------------------------------------------------------------------------------------------


def test_the_closed_form_of_a_sweep_is_that_of_solve_with_gaps_where_it_has_none() -> None:
    found = ml.sweep("delta6", x=Range(-0.1, 0.1, 9), y=[-0.1, 0.03, 0.1], **FIXED)
    assert found.request.method == "closed form" and found.exit_code == 0
    design = ml.load("delta6")
    witness = next(q for q in design.entry.questions if "x" in q.given).witnesses["analytic"]
    for i, x in enumerate(found.dataset["x"].values):
        for j, y in enumerate((-0.1, 0.03, 0.1)):
            said = witness(design.parameters, FIXED | {"x": x, "y": y})
            assert (found.outcome[i, j] == 0) == bool(said.values) and (found.reason[i, j] == "") == bool(said.values)
            if said.values:  # arrays and numbers may round differently in the last place
                assert found["q2"][i, j] == pytest.approx(float(said.values["q2"]), rel=1e-14)
            else:
                assert np.isnan(found["q2"][i, j]) and "out of reach" in found.reason[i, j]
    assert 0 < found.counts["no_solution"] < 27


def test_parameters_and_given_quantities_sweep_together_in_the_users_order() -> None:
    crank, angle = np.linspace(0.02, 0.04, 3), np.linspace(0.0, 6.0, 7)
    found = ml.sweep("gear_linkage", {"crank_angle": angle, "crank": crank}, "output_rate, output_angle")
    assert found["output_rate"].shape == (7, 3) and [q.unit for q in found.request.quantities] == ["rad/s", "rad"]
    for k, length in enumerate(crank):
        truth = gear_linkage.motion(ml.load("gear_linkage", crank=length).parameters.linkage, angle, 1.0, 0.0)
        assert np.allclose(found["output_rate"][:, k], truth.output_rate, rtol=1e-14)


def test_engines_answer_point_by_point_and_differ_from_the_closed_form_by_rounding() -> None:
    values = {"crank": [0.08, 0.1], "crank_angle": [0.5, 2.5]}
    engine = ml.sweep("fourbar", values, "coupler_angle", witness="pinocchio")
    closed = ml.sweep("fourbar", values, "coupler_angle,max_difference")
    assert (engine.request.method, closed.request.method) == ("answers", "answers")
    assert np.allclose(engine["coupler_angle"], closed["coupler_angle"], atol=1e-10)
    assert np.nanmax(closed["max_difference"]) < 1e-9


def test_no_solution_anywhere_is_a_result_with_exit_code_4(capsys: pytest.CaptureFixture[str]) -> None:
    words = "sweep delta6 x=5:6:3 y=0 z=0 alpha=0 beta=0 gamma=0 --json"
    assert main(words.split()) == 4
    document = json.loads(capsys.readouterr().out)
    assert document["counts"]["no_solution"] == 3 and document["data"]["q1"] == [None] * 3
    assert all("out of reach" in x for x in document["data"]["reason"])


def test_values_out_of_range_are_gaps_unless_all_are(swing: str) -> None:
    found = ml.sweep("fourbar", crank=[-0.1, 0.1], crank_angle=0.5, quantities="coupler_angle")
    assert found.outcome.tolist() == [1, 0] and "must be > 0" in found.reason[0] and found.exit_code == 0
    with pytest.raises(MechlabError, match="must be > 0"):
        ml.sweep("fourbar", crank=[-0.1, -0.2], crank_angle=0.5)
    mixed = ml.sweep(swing, length=[-1.0, 1.0], hinge_0=0.2, duration=0.01)
    assert mixed.outcome.tolist() == [1, 0] and "line 7" in mixed.reason[0]


# -- simulations ------------------------------------------------------------------------------------------------------------


def test_a_rollout_has_the_bits_of_single_runs_whatever_the_threads(swing: str) -> None:
    angles = np.linspace(-1.0, 1.0, 16)
    asked = "hinge,hinge_rate,rms(hinge),energy_balance"
    found = ml.sweep(swing, {"length": [0.7, 1.0], "hinge_0": angles, "hinge_force": 0.3}, asked, duration=0.2)
    assert found.request.method == "rollout" and found.exit_code == 0
    for i, length in enumerate((0.7, 1.0)):
        for k in (0, 7, 15):
            run = ml.simulate(swing, length=length, hinge_0=angles[k], hinge_force=0.3, duration=0.2, engine="mujoco")
            assert (
                found["hinge"][i, k] == run.final()["hinge"] and found["hinge_rate"][i, k] == run.final()["hinge_rate"]
            )
            x = run.channel("hinge")
            assert found["rms(hinge)"][i, k] == pytest.approx(np.sqrt(np.trapezoid(x * x, run.t) / 0.2), rel=1e-12)
    assert 0.0 <= found["energy_balance"].max() < 1e-6  # RK4 at 1 ms: far inside the limit
    assert same(
        found,
        replace(
            found, flat=np.concatenate([evaluate(found.request, k, 2).values for k in range(found.request.blocks)])
        ),
    )


def test_a_channel_of_the_entry_and_gears_in_a_rollout() -> None:
    rates = np.linspace(-2.0, 2.0, 17)
    found = ml.sweep("pendulum", {"angle_rate_0": rates}, ["x", "min(y)"], duration=0.3)
    assert found.request.method == "rollout"
    run = ml.simulate("pendulum", angle_rate_0=rates[3], duration=0.3, engine="mujoco")
    assert found["x"][3] == pytest.approx(run.final()["x"], abs=1e-15)
    assert found["min(y)"][3] == pytest.approx(run.channel("y").min(), abs=1e-15)


def test_a_rollout_that_loses_its_energy_is_not_to_be_trusted_and_leaves_gaps() -> None:
    # sqrt(g / L) h is 0.06 and 2: RK4 damps the second, for which it is still stable, within a few steps
    values = {"gravity": [9.81, 9810.0], "angle_0": np.linspace(-3.0, 0.0, 16)}
    found = ml.sweep("pendulum", values, "angle,trusted,energy_balance", duration=1.0, timestep=0.02)
    assert found.request.method == "rollout" and found.exit_code == 3
    bad = found.outcome == 3
    assert bad[1].all() and not bad[0].any() and np.array_equal(np.isnan(found["angle"]), bad)
    assert np.array_equal(found["trusted"], (~bad).astype(float)) and found["energy_balance"][1].min() > 1e-2
    assert all("energy" in x or "blew up" in x for x in found.reason[1])


def test_loops_and_laws_are_run_one_by_one_with_their_whole_health() -> None:
    found = ml.sweep(
        "fourbar", {"speed": [3.0, 6.0]}, "rocker_angle,max(C_z),loop_gap,trusted", scene="free-run", duration=0.1
    )
    assert found.request.method == "runs"
    run = ml.simulate("fourbar", speed=6.0, scene="free-run", duration=0.1)
    assert found["rocker_angle"][1] == run.final()["rocker_angle"] and found["max(C_z)"][1] == run.channel("C_z").max()
    assert found["loop_gap"][1] == run.health.finding("loop_gap").value and found["trusted"].tolist() == [1.0, 1.0]


def test_checks_are_swept_by_their_id() -> None:
    found = ml.sweep("pendulum", {"length": [0.5, 1.5]}, "B3,passed(B3)")
    check = next(c for c in ml.load("pendulum").entry.checks if c.id == "B3")
    truth = [check.run(ml.load("pendulum", length=x).parameters).difference for x in (0.5, 1.5)]
    assert found["B3"].tolist() == truth and found["passed(B3)"].tolist() == [1.0, 1.0]


def test_the_scene_says_what_is_swept_by_default() -> None:
    found = ml.sweep("pendulum", {"length": [0.5, 1.5]}, duration=0.05)
    assert [q.label for q in found.request.quantities] == list(ml.load("pendulum").scene().channels)


# -- files ------------------------------------------------------------------------------------------------------------------


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


# -- interrupted, resumed ---------------------------------------------------------------------------------------------------


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


# -- processes --------------------------------------------------------------------------------------------------------------


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
    alone = ml.sweep(f"{file}:swing", values, "hinge", duration=0.05, workers=1)
    assert not marker.exists()
    shared = ml.sweep(f"{file}:swing", values, "hinge", duration=0.05, workers=2)
    assert marker.exists() and shared.counts["good"] == 24, shared.reasons
    assert np.array_equal(alone.flat, shared.flat) and same(alone, shared), (alone.flat - shared.flat, shared.reasons)


def test_a_function_without_a_name_stays_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "WORTH_IT", 0.0)
    monkeypatch.setattr(local, "_pool", lambda *a: pytest.fail("it cannot be sent"))
    scope: dict = {}
    exec(SWING, scope)
    found = ml.sweep(lambda length=1.0: scope["swing"](length), {"length": [0.5, 1.0, 1.5]}, "hinge", duration=0.01)
    assert found.counts["good"] == 3


# -- what is wrong ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("pendulum", "--portrait"),
        ("pendulum lenth=1:2:3", "length"),
        ("pendulum length=1:2:3 --quantity zeta", "energy_balance"),
        ("pendulum length=1:2:3 --quantity passed(Z9)", "B3"),
        ("pendulum length=1:2:3 --quantity top(x)", "rms"),
        ("pendulum length=1:2:3 angle_0=0 foo=1", "foo"),
        ("fourbar crank_angle=0:1:3 --quantity coupler", "coupler_angle"),
        ("fourbar crank_angle=0:1:3 --witness drake", "pinocchio"),
        ("fourbar crank_angle=a,b", "expected numbers"),
        ("pendulum length=1:2:3 -o out.csv", ".nc"),
        ("pendulum length=1:2:3 --plot out.csv", ".png"),
        ("pendulum length=1:2:2 mass=1:2:2 gravity=1:2:2 --plot out.png", "3"),
        ("pendulum length=1:2:3 --resume", "-o FILE.nc"),
        ("pendulum length=1:2:100000000 mass=1:2:100", "more than fit"),
        ("impulse_transmission --portrait phase --quantity x", "--quantity"),
        ("delta6 x=0:1:3 y=0 z=0 alpha=0 beta=0 gamma=0 --scheduler tcp://127.0.0.1:1", "no Dask scheduler"),
    ],
)
def test_what_is_wrong_is_named(
    words: str, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if "--scheduler" in words:
        from mechlab.studies.sweep import schedulers as cluster

        monkeypatch.setattr(cluster, "CONNECT", 0.2)
    assert main(["sweep", *words.split()]) in (1, 2)
    assert said in capsys.readouterr().err


def test_without_xarray_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(EngineMissing, match=r"mechlab\[cluster\]"):
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


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up in /proc")
def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    """The workers write down who they are; none of them is left after kill -9 of the parent."""
    file = tmp_path / "slow.py"
    file.write_text(SWING + f'''
import os, time
(__import__("pathlib").Path({str(tmp_path)!r}) / f"worker-{{os.getpid()}}").touch()
''')  # fmt: skip
    words = ["sweep", f"{file}:swing", "length=0.5:2:4000", "--duration", "1", "--quantity", "hinge", "--workers", "2"]
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


# -- options ----------------------------------------------------------------------------------------------------------------


def test_options_of_runs_are_refused_where_a_sweep_asks_or_checks(capsys: pytest.CaptureFixture[str]) -> None:
    words = "sweep fourbar crank_angle=0:1:3 --quantity rocker_angle --scene no --engine no --fidelity no --duration -5"
    assert main(words.split()) == 1
    assert "--scene, --engine, --fidelity, --duration: this is a sweep of answers" in capsys.readouterr().err
    with pytest.raises(MechlabError, match="rocker_0_rate_0 instead of rocker_0_rate"):
        ml.sweep("n_fourbar", {"rocker_0_rate": [-1.0, -2.0]}, ["B0_x"], scene="fall", duration=1.0)
    with pytest.raises(MechlabError, match="--duration, angle_0: this is a sweep of checks"):
        ml.sweep("pendulum", {"angle_0": [0.1, 0.2]}, "B3", duration=1.0)


def test_trusted_is_a_quantity_where_the_first_run_fails_too() -> None:
    found = ml.sweep("n_fourbar", {"rocker_0_rate_0": [-1.0, -2.0]}, ["trusted"], scene="fall", duration=0.05)
    assert found["trusted"][0] == 1.0 and found.outcome.tolist() == [0, 4]
