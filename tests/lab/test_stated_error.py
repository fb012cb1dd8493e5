"""No run is wrong by more than ten times what it states without a finding that says so.

Scenes of the catalog with a reference from another formulation, run well and badly: coarse steps, methods of first order,
soft constraints. What a run states is the tolerance of its scene, or a finding that is a warning or an error.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mechlab as ml
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import PRESETS, Settings

pytestmark = pytest.mark.machine

ROWS = (
    ("andrews", "", 0.02), ("slider_crank", "", 0.5), ("fourbar", "constant-torque", 0.6),
)  # fmt: skip
"""Scenes with loops or gears, and durations."""
FREE = (
    ("pendulum", "", 1.0), ("flyball", "", 0.2), ("closed_differential", "constant-moments", 0.3),
    ("closed_differential", "held-input-dry-load", 0.4), ("impulse_transmission", "fig7", 0.3),
)  # fmt: skip
"""Scenes without: the softness of rows is nothing to them."""
MORE = (
    ("n_fourbar", "", 1.5), ("bricard", "", 1.0), ("fourbar", "free-run", 0.6), ("gear_linkage", "free-spin", 0.5),
    ("planetary_stage", "constant-torques", 0.2), ("impulse_transmission", "fig4", 0.05),
)  # fmt: skip


def mujoco(s: Settings, **changes: object) -> Settings:
    """Settings of MuJoCo at the step of the scene (1 ms for engines that have none)."""
    base = s if s.engine == "mujoco" else replace(PRESETS["accurate"], timestep=2e-4)
    return replace(base, **{"integrator": "RK4", "preset": "own", **changes})  # type: ignore[arg-type]


WAYS = {
    "as the scene says": lambda s: s,
    "8 times the step": lambda s: mujoco(s, timestep=8.0 * mujoco(s).timestep),
    "implicitfast": lambda s: mujoco(s, integrator="implicitfast"),
    "default softness": lambda s: mujoco(s, timeconst=None, impedance=None),
    "time constant of 30 steps": lambda s: mujoco(s, timeconst=30.0),
    "impedance .95": lambda s: mujoco(s, impedance=0.95),
    "Pinocchio, 8 times the step": lambda s: Settings(engine="pinocchio", timestep=8.0 * s.timestep),
}


SOFT = ("default softness", "time constant of 30 steps", "impedance .95")
CASES = [
    *(pytest.param(*x, w, id=f"{x[0]} {x[1]}, {w}") for x in ROWS for w in WAYS),
    *(pytest.param(*x, w, id=f"{x[0]} {x[1]}, {w}") for x in FREE for w in WAYS if w not in SOFT),
    *(pytest.param(*x, w, id=f"{x[0]} {x[1]}, {w}", marks=pytest.mark.slow) for x in MORE for w in WAYS),
]


@cache
def reference(name: str, scene: str, duration: float) -> Recording:
    d = ml.load(name).for_scene(scene or None)
    assert d.entry.reference is not None
    return d.entry.reference(d.parameters, d.scene(scene or None, None, duration))


def error(done: Recording, truth: Recording) -> float:
    """Largest deviation of a joint at ten times of the run (a cubic through 2001 or 401 samples of the reference)."""
    names = [n for n in done.mechanism.scalar_names if n in truth.channels]
    assert names
    times = done.t[np.linspace(0, len(done.t) - 1, 12).astype(int)]
    return max(abs(done.at(n, t) - truth.at(n, t)) for n in names for t in times)


@pytest.mark.parametrize(("name", "scene", "duration", "way"), CASES)
def test_no_run_is_wrong_in_silence(name: str, scene: str, duration: float, way: str) -> None:
    d = ml.load(name)
    made = d.for_scene(scene or None).scene(scene or None, None, duration)
    done = ml.simulate(d, scene=scene or None, duration=duration, settings=WAYS[way](made.settings))
    told = [f"{f.name} ({f.severity})" for f in done.health.findings if f.severity != "ok"]
    away = error(done, reference(name, scene, duration))
    assert told or away <= 10.0 * made.tolerance, (
        f"wrong by {away:.2g} (tolerance {made.tolerance:g}) without a finding"
    )


def test_the_sweep_sees_errors_and_good_runs() -> None:
    """The sweep would notice: a badly run pendulum is off by more than ten tolerances, a good one by less, and is not warned."""
    good = ml.simulate("pendulum", duration=1.0)
    bad = ml.simulate("pendulum", duration=1.0, settings=mujoco(good.settings, integrator="implicitfast"))
    truth, tolerance = reference("pendulum", "", 1.0), ml.load("pendulum").scene().tolerance
    assert error(good, truth) < tolerance < 0.1 * error(bad, truth)
    assert all(f.severity == "ok" for f in good.health.findings)
    assert bad.health.finding("step_error").severity == "error"
    assert 0.1 < bad.health.finding("step_error").value / error(bad, truth) < 10.0
