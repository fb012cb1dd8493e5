"""Nothing that is answered hangs on how fast or busy the machine is: budgets and choices count work."""

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.experiment.prices import MUJOCO, price_of_laws, row_count
from mechlab.integrate import OutOfWork, count_work, work_done, work_limit
from mechlab.lab.methods import Problem, method
from mechlab.studies.chart.run import Budget, chart
from mechlab.studies.stability.study import study

CLOCKS = ("thread_time", "process_time", "perf_counter", "monotonic")
SCENES = [
    ("flyball", None, 0.2, 1e-5),  # a race of ladders
    ("gear_linkage", "constant-crank", 0.2, 1e-4),  # loops, with a law in Python
    ("slider_crank", None, 0.5, 1e-5),  # by energy
]


def scaled(monkeypatch: pytest.MonkeyPatch, factor: float) -> None:
    """All clocks run `factor` times as fast."""
    for name in CLOCKS:
        true = getattr(time, name)
        monkeypatch.setattr(time, name, lambda true=true: factor * true())


def told(scene: tuple) -> tuple[dict, dict, list[str], object]:
    name, scene_name, duration, target = scene
    run = ml.simulate(name, scene=scene_name, duration=duration, max_error=target)
    return run.final(), run.errors, [f.sentence for f in run.health.findings], run.settings


def test_a_block_ends_with_its_work_and_not_with_its_time() -> None:
    before = work_done()
    with pytest.raises(OutOfWork), work_limit(1.0):
        for _ in range(100):
            count_work(0.03)
    # the first count beyond 1.0 is the 34th
    assert work_done() - before == pytest.approx(34 * 0.03)
    count_work(100.0)  # no limit is left behind


def test_an_inner_block_has_no_more_than_an_outer_one_left() -> None:
    with work_limit(1.0):
        count_work(0.6)
        with pytest.raises(OutOfWork), work_limit(5.0):
            count_work(0.5)


def test_threads_count_for_themselves() -> None:
    before = work_done()
    other = threading.Thread(target=count_work, args=(7.0,))
    other.start()
    other.join()
    assert work_done() == before


@pytest.mark.parametrize(
    ("name", "way", "stages"), [("pendulum", "MuJoCo RK4, defaults", 4), ("andrews", "MuJoCo discrete, hard", 1)]
)
def test_the_price_of_a_method_is_what_its_runs_count(name: str, way: str, stages: int) -> None:
    lived = ml.load(name, duration=0.02 if name == "andrews" else 1.0).for_scene(None)
    problem = Problem(lived, lived.scene(), 20)
    step = problem.scene.duration / 20 / 4
    before = work_done()
    method(way).run(problem, step)
    m = problem.mechanism
    assert work_done() - before == pytest.approx(80 * stages * MUJOCO.at(m.nv, row_count(m)))
    laws = price_of_laws(problem.scene.laws)  # constant ones are in the engine from the start: nothing is called
    assert method(way).price(problem) == pytest.approx(stages * (MUJOCO.of(m) + laws))


@pytest.mark.parametrize("scene", SCENES, ids=lambda x: x[0])
def test_clocks_of_other_speeds_change_no_answer(scene: tuple, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for factor in (1.0, 300.0, 0.01):
        with monkeypatch.context() as patched:
            scaled(patched, factor)
            found.append(told(scene))
    assert found[0] == found[1] == found[2]


def test_a_map_and_a_chart_are_the_same_by_other_clocks(monkeypatch: pytest.MonkeyPatch) -> None:
    maps, charts = [], []
    for factor in (1.0, 300.0):
        with monkeypatch.context() as patched:
            scaled(patched, factor)
            names = ["MuJoCo RK4, defaults", "Pinocchio RK4, soft stabilisation"]
            made = study(ml.load("flyball"), kinds=["stiffness"], methods=names, budget=1.0)
            maps.append([p.cells for p in made.maps[0].panels])
            few = [method(n) for n in ("MuJoCo Euler, defaults", "Pinocchio RK4, soft stabilisation")]
            points = chart(ml.load("pendulum"), duration=0.5, methods=few, budget=Budget(0.004, 0.1, 0.0)).points
            charts.append([(p.method, p.step, p.status, p.error) for p in points])
    assert str(maps[0]) == str(maps[1])  # cells that were not run hold no number
    assert str(charts[0]) == str(charts[1])


CHILD = """
import json
import mechlab as ml
out = []
for name, scene, duration, target in json.loads(SCENES):
    run = ml.simulate(name, scene=scene, duration=duration, max_error=target)
    s = run.settings
    sizes = {n: float(abs(x).max()) for n, x in run.channels.items()}
    out.append([run.final(), sizes, run.errors, [s.engine, s.integrator, s.timestep], [f.severity for f in run.health.findings]])
print(json.dumps(out))
"""


def test_other_processor_features_give_the_same_numbers() -> None:
    """numpy without its wider instructions, and linear algebra by the kernels of an older processor."""
    simd = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    changes = {"NPY_DISABLE_CPU_FEATURES": " ".join(simd), "OPENBLAS_CORETYPE": "Nehalem"}
    root = str(Path(ml.__file__).parents[1])
    runs = []
    for extra in ({}, changes):
        environment = os.environ | {"PYTHONPATH": root} | {k: v for k, v in extra.items() if v}
        code = f"SCENES = {json.dumps(SCENES)!r}\n{CHILD}"
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        runs.append(json.loads(done.stdout))
    for (final, sizes, errors, *chosen), (again, _, _, *same) in zip(*runs, strict=True):
        assert chosen == same
        adaptive = chosen[0][1] in ("LSODA", "DOP853")
        for name, value in final.items():
            # accelerations and forces follow through stiff rows, or two derivatives of a series: rounding times some thousands;
            # where a method sets its own steps, these follow the last digits, and the stated error is what is left
            room = (1e-9 if name.endswith(("_accel", "_force")) else 1e-12) * max(sizes[name], 1.0)
            room = errors[name] if adaptive else room
            assert again[name] == pytest.approx(value, rel=0.0, abs=room), name
