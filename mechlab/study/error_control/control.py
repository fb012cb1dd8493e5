"""A scene recorded to a stated error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module

import numpy as np

from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.study.design import Design
from mechlab.study.error_control.measure import Measure
from mechlab.study.error_control.record import recording_of, with_estimate
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.solve import solve_to
from mechlab.study.methods import Problem
from mechlab.study.witness import room

OUTPUTS = 400
STATES_SUFFICE = frozenset({"poses", "drive_forces"})


def control(design: Design, scene: Scene, max_error: float, at: Sequence[float] = ()) -> Recording:
    """A Recording of the scene with an error of at most `max_error`, or one that says why not.

    Made from the very states that were estimated where those tell all that the scene needs; else by the runner of the
    accepted method with its settings, and what that differs by counts as error too.
    """
    result = solve_to(design, scene, max_error, OUTPUTS)
    m = design.mechanism(scene.fidelity)
    engine = result.settings.engine
    remembers = any(tuple(getattr(law, "start", tuple)()) for law in scene.laws)
    suffice = set(scene.needs) <= STATES_SUFFICE and not remembers and engine in ("mujoco", "pinocchio")
    if result.motion is not None or result.extrapolated or suffice:
        return recording_of(m, scene, result, at)
    times = np.union1d(result.t, np.asarray(at, dtype=float)).tolist()
    return with_estimate(made := _run(design, scene, result, times), result, _difference(design, scene, result, made))


def _run(design: Design, scene: Scene, result: Result, times: list[float]) -> Recording:
    m = design.mechanism(scene.fidelity)
    engine = result.settings.engine
    if engine == "mujoco":
        made: Recording = room("mujoco").run(m, scene, result.settings, times)
    elif engine == "pinocchio":
        made = room("pinocchio").run(m, scene, result.settings, times)
    else:
        name = "mechlab.study.one_freedom" if engine == "one_freedom" else "mechlab.solve.hybrid"
        made = import_module(name).run(m, scene, result.settings, times)
    return replace(made, settings=result.settings)


def _difference(design: Design, scene: Scene, result: Result, made: Recording) -> float:
    """Largest difference of the tracked quantities between the recorded run and the estimated one."""
    at = np.clip(np.searchsorted(made.t, result.t * (1.0 - 1e-12)), 0, len(made.t) - 1)
    if np.max(np.abs(made.t[at] - result.t)) > 1e-9 * scene.duration:
        return float("inf")
    measure = Measure(Problem(design, scene, len(result.t) - 1), None)
    ours = measure(result.t, result.q, result.v)
    return float(np.max(np.abs(measure(made.t[at], made.q[at], made.v[at]) - ours), initial=0.0))
