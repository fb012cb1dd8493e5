"""Steps under laws beside bare steps, for each kind of law; python -m tests.benchmarks.bench_laws. No limits are asserted.

A step is one of RK4, four evaluations of the laws. The bare loop is `mj_step` on the same model from the same start, without any law
and without a callback; "Pinocchio" is our runner's step with its projection, without samples. CPU seconds of the thread, the
smallest of REPEATS.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import mujoco

from mechlab import api
from mechlab.engines.mujoco.drive import put_start, run_model
from mechlab.engines.mujoco.trace import Steps
from mechlab.engines.pinocchio.equations import Equations
from mechlab.experiment.laws import DcMotor, FunctionLaw, Harmonic, Law, OneSidedStop, TableLaw
from mechlab.experiment.motion import Sine
from mechlab.experiment.scene import Scene, initial_state
from mechlab.integrate import RK4, integrate_fixed
from mechlab.lab.run import run_scene
from mechlab.mechanism import Mechanism
from tests.benchmarks.rows import Row

REPEATS = 5
STEPS = 200
BARE = "bare mj_step loop"
CATALOG = (
    ("computed torque", "delta6", "head-tracking", "minimal", "value >= 10000"),
    ("computed torque", "delta6", "head-tracking", "parts", ""),
    ("computed torque", "delta6", "head-tracking", "full", "value >= 3000"),
    ("computed torque on splines", "delta6", "toolpath", "minimal", ""),
    ("computed torque, redundant rows", "quick_return", "driven-crank", "minimal", ""),
    ("six servos on sines", "delta6", "pose-sweep", "minimal", ""),
    ("six servos on sines", "delta6", "pose-sweep", "full", ""),
    ("six servos that hold", "delta6", "gravity-hold", "minimal", ""),
    ("servo on a ramp", "fourbar", "driven-crank", "minimal", ""),
    ("constant", "fourbar", "constant-torque", "minimal", ""),
    ("viscous", "closed_differential", "housing-drag", "minimal", ""),
    ("viscous between", "closed_differential", "internal-drag", "parts", ""),
    ("motor", "closed_differential", "motor-and-viscous-load", "minimal", ""),
    ("constant power", "closed_differential", "constant-power", "minimal", ""),
    ("DC motor with inductance", "impulse_transmission", "fig7", "minimal", ""),
    ("held rates", "closed_differential", "held-input-dry-load", "minimal", ""),
    ("floor", "prosthetic_leg", "stance-drop", "minimal", ""),
)
"""Kind of law, entry, scene, fidelity, goal."""
CRANK = "crank_angle"
OWN: tuple[tuple[str, Law], ...] = (
    ("harmonic", Harmonic(CRANK, 2.0, 9.0, 0.3, 0.1)),
    ("table", TableLaw(CRANK, (0.0, 0.05, 0.1, 0.15), (0.0, 1.0, -1.0, 2.0))),
    ("one-sided stop", OneSidedStop(CRANK, -5.0, 1, 3.0, 0.1)),
    ("DC motor", DcMotor(CRANK, Sine(5.0, 4.0), 0.1, 1.0)),
    ("a user's function", FunctionLaw(CRANK, lambda t, plant: 0.1 * math.sin(3.0 * t) - 0.02 * plant.rate(CRANK))),
)
"""Kinds that no scene of the catalog has, on the crank of the four-bar."""


def scenes() -> list[tuple[str, Mechanism, Scene, str]]:
    """Name, mechanism, scene and goal of each row."""
    out = []
    for kind, name, scene, fidelity, asked in CATALOG:
        design = api.load(name).for_scene(scene)
        out.append(
            (f"{kind}: {name} {scene}, {fidelity}", design.mechanism(fidelity), design.scene(scene, fidelity), asked)
        )
    design = api.load("fourbar").for_scene("free-run")
    free = design.scene("free-run", "minimal")
    out += [(f"{kind}: fourbar", design.mechanism("minimal"), replace(free, laws=(law,)), "") for kind, law in OWN]
    return out


def cheapest(work: Callable[[], object]) -> float:
    """Least CPU seconds of the thread over REPEATS calls."""
    spent = []
    for _ in range(REPEATS):
        start = time.thread_time()
        work()
        spent.append(time.thread_time() - start)
    return min(spent)


def speeds(mechanism: Mechanism, scene: Scene) -> tuple[float, float]:
    """Steps of RK4 per CPU second on MuJoCo, with the laws and without."""
    h = scene.settings.timestep if scene.settings.engine == "mujoco" else 1e-3
    settings = replace(scene.settings, engine="mujoco", integrator="RK4", timestep=h)
    steps = Steps(mechanism, replace(scene, duration=(REPEATS + 1) * STEPS * h), settings, STEPS * h)
    steps.advance(1)  # what is made at the first evaluation
    spent = []
    for _ in range(REPEATS):
        made = steps.advance(1)
        if made.reason:
            break
        spent.append(made.cpu_s)
    model, data, map_ = run_model(mechanism, settings, ())
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    state = initial_state(mechanism, scene)

    def bare() -> None:
        mujoco.mj_step(model, data, nstep=STEPS)

    free = []
    for _ in range(REPEATS):
        mujoco.mj_resetData(model, data)
        put_start(data, map_, *state)
        start = time.thread_time()
        bare()
        free.append(time.thread_time() - start)
    return STEPS / min(spent), STEPS / min(free)


def pinocchio_speed(mechanism: Mechanism, scene: Scene) -> float:
    """Steps of RK4 per CPU second of the equations on Pinocchio."""
    h = 1e-3
    motion = Equations(mechanism, scene.laws, h)
    y = motion.start(*initial_state(mechanism, scene))
    return 50 / cheapest(lambda: integrate_fixed(RK4, motion.slope, 0.0, y, h, 50, project=motion.project))


def rows() -> list[Row]:
    """Steps per CPU second for each kind of law, beside bare steps; the delta to a stated error."""
    out = []
    for name, mechanism, scene, asked in scenes():
        driven, bare = speeds(mechanism, scene)
        out.append(Row(name, driven, "steps/s", BARE, bare, asked))
    for fidelity in ("minimal", "full"):
        design = api.load("delta6").for_scene("head-tracking")
        m, scene = design.mechanism(fidelity), design.scene("head-tracking", fidelity)
        free = pinocchio_speed(m, replace(scene, laws=()))
        driven = pinocchio_speed(m, scene)
        out.append(
            Row(f"Pinocchio: delta6 head-tracking, {fidelity}", driven, "steps/s", "Pinocchio without the law", free)
        )
    made = run_scene(api.load("delta6"), "head-tracking", fidelity="full", duration=0.3, max_error=1e-3)
    text = (
        "delta6 head-tracking full, 0.3 s to 1e-3 rad, trusted"
        if made.health.trusted
        else "delta6 head-tracking full: NOT trusted"
    )
    out.append(Row(text, made.cost.total_s, "s", "", math.nan, "value <= 3"))
    return out


if __name__ == "__main__":
    for row in rows():
        print(
            f"{row.name:60s}{row.value:12.4g} {row.unit:8s}{row.beside:28s}{row.reference:12.4g}  ratio {row.ratio:6.3f}  {row.asked}"
        )
