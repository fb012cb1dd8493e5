"""The error of runs that were stepped in single precision: some of them are run again in double precision.

Stated is SAFETY times the largest difference of REPEATED runs, evenly spread over the sweep; the others may differ more than these,
but hardly by more than that unless the motion is chaotic, and then the warning says so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.mechanism.geometry import Array
from mechlab.studies.sweep.evaluate import base, evaluate
from mechlab.studies.sweep.request import GOOD, SweepRequest
from mechlab.studies.sweep.rollout import scene_of

REPEATED = 16
"""Runs that are repeated."""
SAFETY = 10.0


def single_precision(request: SweepRequest, flat: Array, outcomes: np.ndarray) -> tuple[dict[str, float], tuple[str, ...]]:
    """Label -> error of a finished sweep (points, quantities), and sentences of warning where it is beyond the tolerance of the scene."""
    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.engines.mujoco.warp_steps import device_name

    good = np.flatnonzero(outcomes == GOOD)
    if not len(good):
        return {}, ("single precision: no point is good, so that its error is not known.",)
    some = good[np.unique(np.linspace(0, len(good) - 1, REPEATED).round().astype(int))]
    again = np.array([_at(request, int(point)) for point in some])
    off = SAFETY * np.max(np.abs(again - flat[some]), axis=0)
    errors = {q.label: float(x) for q, x in zip(request.quantities, off, strict=True) if q.kind != "trusted"}
    _, _, scene, _ = scene_of(request, base(request))
    words = [f"the runs were stepped in single precision on {device_name()}"]
    far = [q.label for q in request.quantities if q.kind == "channel" and not errors.get(q.label, 0.0) <= scene.tolerance]
    if far:
        words.append(f"{', '.join(far)} may be off by more than the tolerance {scene.tolerance:g} of the scene")
    return errors, ("; ".join(words) + ".",)


def _at(request: SweepRequest, point: int) -> Array:
    """The numbers (quantities,) of a point in double precision."""
    at = np.unravel_index(point, tuple(len(a.values) for a in request.work))
    index = {a.key: int(i) for a, i in zip(request.work, at, strict=True)}
    axes = tuple(replace(a, values=(a.values[index[a.key]],)) for a in request.axes)
    return evaluate(replace(request, axes=axes, block=1, backend=None), 0).values[0]
