"""The error of a run of a stranger's file: how far a run at FINER times its timestep departs, and until when it does not.

    d(t) = max |x(t; h) - x(t; 2 h / 3)|,     error of x(h) at most 2 d / (1 - 2 / 3)      for methods of any order

Impacts make neighbouring motions part: from the first time at which the error is beyond the tolerance, positions are those of one
possible motion, not of the model. The share 2 / 3 costs less than half the timestep, and no soft contact becomes unstable by it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.errors import SMALLER, UNITS, differences, error_from_finer, shared_times
from mechlab.experiment.ranges import stop_advice
from mechlab.experiment.recording import Finding, Health, Recording
from mechlab.experiment.scene import Scene
from mechlab.mechanism.geometry import Array

FINER = 2.0 / 3.0
FACTOR = error_from_finer(1.0, FINER)
"""Error of a run per change of the run at the finer timestep."""


COMPARED = 200
"""Largest number of times at which the two runs are compared."""


def with_file_error(recording: Recording, scene: Scene) -> Recording:
    """The recording with the errors of its channels and the finding "step_error"."""
    h, tolerance = recording.settings.timestep, scene.tolerance
    steps = recording.t / (2.0 * h)
    whole = np.abs(steps - np.round(steps)) < 1e-6
    times = np.append(recording.t[:-1][whole[:-1]], recording.t[-1])
    times = times[np.unique(np.linspace(0, len(times) - 1, min(COMPARED, len(times))).round().astype(int))]
    settings = replace(recording.settings, timestep=FINER * h)
    try:
        finer = engine("file").at_times(recording.mechanism, scene, settings, times)
        why = "it blew up" if finer.t[-1] < recording.t[-1] * (1.0 - 1e-9) else ""
    except MechlabError as error:
        finer, why = recording, str(error)
    if why:
        text = f"the run does not come through at two thirds of the timestep ({why}): its error cannot be estimated"
        return _with(recording, Finding("step_error", math.inf, tolerance, "rad or m", "error", text))
    mine, theirs = shared_times(recording, finer)
    change = np.max(np.abs(recording.q[mine] - finer.q[theirs]), axis=1, initial=0.0)
    if not np.all(np.isfinite(change)):
        change = np.where(np.isfinite(change), change, math.inf)
    found = _finding(recording.t[mine], FACTOR * np.maximum.accumulate(change), tolerance, h, stop_advice(recording.health))
    errors = differences(recording, finer, FACTOR)
    for name, values in recording.channels.items():
        if name not in finer.channels and _finite(values):
            # a contact that one of the runs did not have
            errors[name] = float(np.max(np.abs(values))) * (1.0 + UNITS)
    return replace(_with(recording, found), errors=errors)


def _with(recording: Recording, finding: Finding) -> Recording:
    return replace(recording, health=recording.health + Health((finding,)))


def _finite(values: Array) -> bool:
    return bool(np.all(np.isfinite(values)))


def _finding(t: Array, error: Array, tolerance: float, timestep: float, advice: str) -> Finding:
    worst = float(error[-1])
    text = (
        f"error left by the file's timestep: at most about {worst:.2g} rad or m, from a run at {FINER * timestep:.3g} s"
    )
    if worst <= tolerance:
        return Finding("step_error", worst, tolerance, "rad or m", "ok", f"{text} (tolerance {tolerance:g})")
    good = t[error <= tolerance]
    until = (
        f"within {tolerance:g} until t = {good[-1]:.3g} s, then beyond"
        if len(good) > 1
        else f"beyond {tolerance:g} from the start"
    )
    text += (
        f"; {until}: after an impact, or where the timestep is too large, positions are those of one possible motion. Do not trust "
        f"them; {advice or SMALLER}"
    )
    return Finding("step_error", worst, tolerance, "rad or m", "error", text)
