"""What a run costs from the call to the recording, beside its integration and a bare loop; python -m tests.benchmarks.bench_recording.

Every number is the smallest of some calls of CPU seconds of the process, imports excluded, and nothing is kept from the call
before. "once": a run at its fixed step; "simulate": with the error of every channel, from further runs; "max_error": under error
control. The bare loop is `mj_step` in Python on the generated MJCF, the same start, steps and settings, and no laws.
"""

from __future__ import annotations

import functools
import gc
import math
import time
from typing import Any

import mujoco
import numpy as np

from mechlab import api
from mechlab.engines.mujoco.drive import engage, put_start
from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import initial_state
from mechlab.lab.run import run_scene
from mechlab.lab.single_run import chosen_settings
from tests.benchmarks.rows import Row

REPEATS = 3
LOOP = "bare mj_step loop"
FALLING = (
    ("n_fourbar fall", "n_fourbar", {}, None, None),
    ("n_fourbar N=20 fall", "n_fourbar", {"N": 20}, None, None),
    ("fourbar free-run", "fourbar", {}, "free-run", None),
    ("closed_differential", "closed_differential", {}, None, "minimal"),
    ("delta6 gravity-hold", "delta6", {}, "gravity-hold", "minimal"),
)  # fmt: skip
"""Scenes without laws that Python must evaluate: name, entry, parameters, scene, fidelity."""
DRIVEN = (
    ("delta6 head-tracking, 0.3 s", "delta6", {}, "head-tracking", "minimal", 0.3),
    ("prosthetic_leg", "prosthetic_leg", {}, None, "minimal", None),
)  # fmt: skip
CONTROLLED = (
    ("pendulum", "pendulum", {}, None, 1e-6),
    ("n_fourbar", "n_fourbar", {}, None, 1e-6),
    ("n_fourbar N=20", "n_fourbar", {"N": 20}, None, 1e-6),
    ("andrews", "andrews", {}, None, 1e-6),
    ("fourbar driven-crank", "fourbar", {}, "driven-crank", 1e-3),
)  # fmt: skip


def forget() -> None:
    """Empty every cache of this process, so that the next call pays for what it builds."""
    for found in gc.get_objects():
        if isinstance(found, functools._lru_cache_wrapper) and found.__module__.startswith("mechlab."):
            if found.__name__ not in ("_versions", "_libraries"):  # what the process has imported is no model
                found.cache_clear()


def cheapest(name: str, parameters: dict[str, Any], scene: str | None, **options: Any) -> Recording:
    """The cheapest of REPEATS runs of a scene as a user calls them, imports not counted; with estimate=False once."""
    found = []
    for _ in range(REPEATS + 1):
        forget()
        design = api.load(name, **parameters)
        found.append(run_scene(design, scene, **options) if "estimate" in options else api.simulate(design, scene=scene, **options))
    return min(found[1:], key=paid)


def paid(run: Recording) -> float:
    """CPU seconds of a run without imports."""
    return run.cost.total_s - run.cost.parts.imports


def bare_loop(name: str, parameters: dict[str, Any], scene: str | None, fidelity: str | None) -> float:
    """CPU seconds of `mj_step` in a Python loop over the scene."""
    design = api.load(name, **parameters).for_scene(scene)
    made = design.scene(scene or design.scene_for(None), fidelity)
    settings = chosen_settings(design, made)
    mechanism = design.mechanism(made.fidelity)
    model, data = to_mujoco(mechanism, settings)
    map_ = MujocoMap(mechanism, model)
    engage(map_, made.laws)
    steps, least = math.ceil(made.duration / settings.timestep - 1e-9), math.inf
    q, v = initial_state(mechanism, made)
    for _ in range(REPEATS):
        mujoco.mj_resetData(model, data)
        put_start(data, map_, q, v)
        step, began = mujoco.mj_step, time.process_time()
        for _ in range(steps):
            step(model, data)
        least = min(least, time.process_time() - began)
    assert np.all(np.isfinite(data.qpos))
    return least


def rows() -> list[Row]:
    """The section `recording` of the table of benchmarks."""
    out = []
    for what, name, parameters, scene, fidelity in FALLING:
        bare = bare_loop(name, parameters, scene, fidelity)
        once = cheapest(name, parameters, scene, fidelity=fidelity, estimate=False)
        whole = cheapest(name, parameters, scene, fidelity=fidelity)
        out += [
            Row(f"{what}: integration", once.cost.parts.integrate, "s", LOOP, bare),
            Row(f"{what}: once", paid(once), "s", LOOP, bare, "ratio <= 3"),
            Row(f"{what}: simulate", paid(whole), "s", LOOP, bare, "ratio <= 3"),
        ]
    for what, name, parameters, scene, fidelity, duration in DRIVEN:
        out.append(_row(f"{what}: once", cheapest(name, parameters, scene, fidelity=fidelity, duration=duration, estimate=False)))
    for what, name, parameters, scene, target in CONTROLLED:
        out.append(_row(f"{what}: max_error {target:g}", cheapest(name, parameters, scene, max_error=target)))
    return out


def _row(what: str, run: Recording) -> Row:
    """A run beside its integration and the probes of the error control; the goal holds for runs of more than 50 ms."""
    integration = run.cost.parts.integrate + run.cost.parts.probe
    return Row(what, paid(run), "s", "its integration and probes", integration, "ratio <= 2" if paid(run) > 0.05 else "")


def main() -> None:
    """Print the rows."""
    for row in rows():
        numbers = f"{1e3 * row.value:9.1f} ms   {row.beside:28s}{1e3 * row.reference:9.1f} ms{row.ratio:8.2f}"
        print(f"{row.name:45s}{numbers}  {row.asked}", flush=True)


if __name__ == "__main__":
    main()
