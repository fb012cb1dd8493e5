"""Sweeps: time and memory against the number of points over three decades, overhead against calling the engine directly,
phase portraits; and rows for the table of all benchmarks: whole sweeps of looped mechanisms beside bare rollouts of the same motions.

Run as `python -m tests.benchmarks.bench_sweep`: prints tables and draws assets/sweep_scaling.svg; asserts nothing. Every size
runs in a process of its own, so that its peak memory is its own. One process, one thread: what is measured is CPU time.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.benchmarks.rows import Row

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "assets" / "sweep_scaling.svg"
SHORT = 0.05
POSE = {"z": 0.0, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}
CASES = {
    "closed form": ("delta6: pose to drives, closed form", (1_000, 10_000, 100_000, 1_000_000)),
    "rollout": (f"pendulum: {SHORT:g} s at 1 ms, mujoco.rollout", (16, 100, 1_000, 10_000)),
    "runs": (f"four-bar: {SHORT:g} s, run by run with health", (1, 10, 100, 1_000)),
    "portrait": ("transmission: phase portrait of 0.5 s, vectorized RK4 at 1 ms", (100, 1_000, 10_000, 100_000)),
}


def sweep_of(case: str, count: int) -> Callable[[], object]:
    """The work of a case, imported and warmed up."""
    import mechlab as ml
    from mechlab.values import Range

    def asked(n: int) -> object:
        if case == "closed form":
            side = max(2, round(n**0.5))
            return ml.sweep("delta6", {"x": Range(0.0, 0.08, side), "y": Range(-0.08, 0.0, side)} | POSE)
        if case == "rollout":
            return ml.sweep("pendulum", {"angle_0": Range(0.0, 3.0, n)}, "angle", duration=SHORT, workers=1)
        if case == "runs":
            speeds = np.linspace(3.0, 6.0, n)
            return ml.sweep("fourbar", {"speed": speeds}, "rocker_angle_accel", scene="free-run", duration=SHORT, workers=1)
        starts = {"beta_0": Range(-0.2, 0.2, 10), "beta_rate_0": Range(-30.0, 30.0, n // 10)}
        return ml.portrait("impulse_transmission", "phase", starts | {"M0": 0.0, "M1": 0.0, "timestep": 1e-3, "duration": 0.5})

    asked(16 if case == "rollout" else 100 if case != "runs" else 1)
    return lambda: asked(count)


def measured(work: Callable[[], object]) -> float:
    """CPU seconds."""
    began = time.process_time()
    work()
    return time.process_time() - began


def one(case: str, count: int) -> None:
    """A case at one size, in this process: prints JSON."""
    work = sweep_of(case, count)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    spent = measured(work)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps({"cpu": spent, "peak": peak / 1e3, "grown": (peak - before) / 1e3}))


def scaling() -> dict[str, list[tuple[int, float, float]]]:
    """Case -> (points, CPU [s], peak memory [MB])."""
    out: dict[str, list[tuple[int, float, float]]] = {}
    print(f"{'sweep':62s} {'points':>9s} {'CPU [s]':>9s} {'us/point':>9s} {'peak [MB]':>9s}")
    for case, (text, counts) in CASES.items():
        for count in counts:
            command = [sys.executable, "-m", "tests.benchmarks.bench_sweep", case, str(count)]
            environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
            done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, cwd=ROOT)
            found = json.loads(done.stdout.splitlines()[-1])
            out.setdefault(case, []).append((count, found["cpu"], found["peak"]))
            print(
                f"{text:62s} {count:9d} {found['cpu']:9.3f} {1e6 * found['cpu'] / count:9.1f} {found['peak']:9.0f}",
                flush=True,
            )
    return out


def overhead() -> None:
    """Sweeps against the same numbers computed by calling the engine or the closed form directly; best of some repeats."""
    import mechlab as ml
    from mechlab.engines.mujoco.batch import roll
    from mechlab.engines.mujoco.stepping import grid
    from mechlab.experiment.scene import initial_state
    from mechlab.lab.run import run_scene
    from mechlab.values import Range

    side, many = 1000, 4096
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0.0, 0.08, side), np.linspace(-0.08, 0.0, side), indexing="ij"))
    delta = ml.load("delta6")
    witness = next(q for q in delta.entry.questions if "x" in q.given).witnesses["analytic"]
    axes = {"x": Range(0.0, 0.08, side), "y": Range(-0.08, 0.0, side)}
    pendulum = ml.load("pendulum")
    scene = pendulum.scene()
    mechanism = pendulum.mechanism()
    q, v = initial_state(mechanism, scene)
    starts = np.linspace(0.0, 3.0, many)[:, None] - mechanism.zero("angle")
    speeds = np.linspace(3.0, 6.0, 40)
    steps = grid(0.5, 1e-3)

    def rolled() -> object:
        return roll(mechanism, scene.settings, steps, starts, np.tile(v, (many, 1)), {}, 1)

    def run_directly() -> list[float]:
        made = [ml.load("fourbar", speed=s) for s in speeds]
        return [run_scene(d, "free-run", duration=0.5, estimate=False).final()["rocker_angle_accel"] for d in made]

    pairs: tuple[tuple[str, Callable[[], object], Callable[[], object]], ...] = (
        (f"closed form, {side**2} poses of the delta", lambda: witness(delta.parameters, POSE | {"x": x, "y": y}),
         lambda: ml.sweep("delta6", axes | POSE)),
        (f"rollout, {many} motions of the pendulum of 0.5 s", rolled,
         lambda: ml.sweep("pendulum", {"angle_0": Range(0.0, 3.0, many)}, "angle", duration=0.5, workers=1)),
        ("runs, 40 motions of the four-bar of 0.5 s", run_directly,
         lambda: ml.sweep("fourbar", {"speed": speeds}, "rocker_angle_accel", scene="free-run", duration=0.5, workers=1)),
    )  # fmt: skip
    print(f"\n{'':55s} {'direct [s]':>11s} {'sweep [s]':>10s} {'overhead':>9s}   (CPU, best of 3, one thread)")
    for text, direct, swept in pairs:
        direct(), swept()
        best = [min(times) for times in zip(*((measured(direct), measured(swept)) for _ in range(3)), strict=True)]
        print(f"{text:55s} {best[0]:11.3f} {best[1]:10.3f} {100 * (best[1] / best[0] - 1):8.1f} %", flush=True)


FALL = {"scene": "fall", "duration": 1.0, "timestep": 2.5e-3, "workers": 1}
MOTIONS = 1024


def rows() -> list[Row]:
    """Whole sweeps, from the call to the result, beside a bare `mujoco.rollout` of the same motions of the generated file: us of CPU a
    step of a motion, on one thread; the least of two alternating measurements."""
    import mechlab as ml
    from mechlab.experiment.scene import Scene, Settings, initial_state

    two = ml.load("n_fourbar")
    fall = two.scene("fall", duration=FALL["duration"])
    settings = Settings(timestep=FALL["timestep"])
    q, v = initial_state(two.mechanism(), fall)
    speeds, lengths = np.linspace(1.0, 3.0, MOTIONS), np.linspace(0.8, 1.2, MOTIONS)
    delta, loads = ml.load("delta6").mechanism("minimal"), np.linspace(-3.0, 3.0, 1000)
    rest = np.tile(delta.reference(), (len(loads), 1))
    free = Scene("free", duration=0.4)
    cases = (
        ("two four-bars, 1024 starts", "value <= 30", 400, MOTIONS,
         lambda: ml.sweep("n_fourbar", {"start_speed": speeds}, "B0_x,trusted", **FALL),
         lambda: bare(two.mechanism(), settings, fall, np.tile(q, (MOTIONS, 1)), speeds[:, None] * v, {})),
        ("two four-bars, 1024 coupler lengths", "value <= 30", 400, MOTIONS,
         lambda: ml.sweep("n_fourbar", {"coupler_length": lengths}, "B0_x,trusted", **FALL),
         lambda: bare(two.mechanism(), settings, fall, np.tile(q, (MOTIONS, 1)), np.tile(v, (MOTIONS, 1)), {})),
        ("minimal delta, 1000 loads", "ratio <= 1.25", 400, len(loads),
         lambda: ml.sweep(delta, {"q1_force": loads}, "q1,trusted", scene="free-motion", duration=0.4, workers=1),
         lambda: bare(delta, Settings(), free, rest, np.zeros((len(loads), delta.nv)), {"q1": loads})),
    )  # fmt: skip
    out = []
    for name, asked, steps, count, swept, rolled in cases:
        pairs = [(measured(swept), measured(rolled)) for _ in range(2)]
        value, reference = (1e6 * min(times) / (steps * count) for times in zip(*pairs, strict=True))
        out.append(Row(name, value, "us a step", "bare mujoco.rollout, RK4", reference, asked))
    return out + warp_rows(speeds, lambda n: measured(lambda: ml.sweep("n_fourbar", {"start_speed": speeds[:n]}, "B0_x", **FALL)))


def bare(mechanism, settings, scene, q, v, loads) -> object:
    """The motions by `mujoco.rollout` alone, on one thread."""
    import mujoco
    from mujoco import rollout

    from mechlab.formats import to_mjcf

    model = mujoco.MjModel.from_xml_string(to_mjcf(mechanism, settings))
    model.opt.disableactuator, model.actuator_group[:] = 1, 0
    data, full = mujoco.MjData(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.tile(np.empty(mujoco.mj_stateSize(model, full)), (len(q), 1))
    mujoco.mj_getState(model, data, start[0], full)
    start[:] = start[0]
    start[:, 1 : 1 + model.nq], start[:, 1 + model.nq : 1 + model.nq + model.nv] = q, v
    push = np.zeros((len(q), 1, model.nv))
    for name, values in loads.items():
        push[:, 0] += values[:, None] * mechanism.row(name)
    steps, part = round(scene.duration / settings.timestep), 256
    with rollout.Rollout(nthread=1) as pool:
        for i in range(0, len(q), part):
            pool.rollout(
                [model] * len(q[i : i + part]), [data], start[i : i + part], push[i : i + part], nstep=steps,
                control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED),
            )  # fmt: skip
    return None


def warp_rows(speeds: np.ndarray, double: Callable[[int], float]) -> list[Row]:
    """The same starts by MuJoCo Warp in single precision, after its kernels are compiled; none where it is not installed."""
    import mechlab as ml
    from mechlab.errors import EngineMissing

    def single() -> object:
        return ml.sweep("n_fourbar", {"start_speed": speeds}, "B0_x", backend="warp", **FALL)

    try:
        from mechlab.engines.mujoco.warp_steps import device_name

        name = f"two four-bars, 1024 starts, MuJoCo Warp on {device_name()}"
    except EngineMissing:
        return []
    single()
    unit = 1e6 / (400 * len(speeds))
    return [Row(name, unit * measured(single), "us a step", "sweep by MuJoCo", unit * double(len(speeds)))]


def draw(found: dict[str, list[tuple[int, float, float]]]) -> None:
    """The chart of time and memory."""
    from importlib.metadata import version

    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.6, 4.5), layout="constrained", facecolor="white")
    FigureCanvasSVG(figure)
    left, right = figure.subplots(1, 2)
    for (case, rows), color, mark in zip(
        found.items(), ("#1f5a96", "#c96a1b", "#3f7f5f", "#6b4c9a"), "osD^", strict=True
    ):
        counts, cpu, peak = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
        left.loglog(counts, cpu, mark + "-", color=color, markersize=5, label=CASES[case][0])
        right.loglog(counts, peak, mark + "-", color=color, markersize=5)
    left.loglog([10, 1e5], [1e-3, 10.0], ":", color="#777777", label="linear")
    for axes, text in ((left, "CPU time, s"), (right, "peak memory of the process, MB")):
        axes.set_xlabel("points")
        axes.set_title(text, loc="left", fontsize=11)
        axes.grid(True, which="major", linewidth=0.3)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    right.set_ylim(50, 2000)
    left.legend(fontsize=7.5, frameon=False, loc="upper left")
    left.set_ylim(top=left.get_ylim()[1] * 60)
    engines = ", ".join(f"{n} {version(n)}" for n in ("mujoco", "numpy"))
    figure.suptitle(
        f"Sweeps: time and memory against the number of points (one thread, {engines})", fontsize=12, x=0.01, ha="left"
    )
    figure.savefig(PICTURE, metadata={"Date": None})
    print(f"\n{PICTURE.relative_to(ROOT)}")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        one(sys.argv[1], int(sys.argv[2]))
    else:
        chosen = scaling()
        draw(chosen)
        overhead()
