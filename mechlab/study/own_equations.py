"""From own equations of motion to a Recording: the reference of an entry, integrated as sharply as one asks."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import NoSolution
from mechlab.experiment.recording import Cost, Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.integrate import integrate_adaptive
from mechlab.mechanism import Mechanism

Array = NDArray[np.float64]
SAMPLES = 2001
TOLERANCE = 1e-13


def record_own(
    mechanism: Mechanism,
    scene: Scene,
    slope: Callable[[float, Array], Array],
    start: Array,
    states: Callable[[Array], tuple[Array, Array]],
    method: str = "DOP853",
    tolerance: float = TOLERANCE,
) -> Recording:
    """A Recording of y' = slope(t, y) from `start` over the duration of the scene, at SAMPLES even times.

    states: (n, m) states -> coordinates (n, nq) and rates (n, nv) of the mechanism. `tolerance` is relative; absolute, a
    tenth of it. The cost is that of the integration. Raises NoSolution when the integration cannot reach the end.
    """
    began = time.thread_time()
    tolerance = max(tolerance, 2.3e-14)  # scipy refuses less than a hundred times the rounding unit
    with np.errstate(over="ignore"):  # Radau's difference quotients by a state that nothing depends on
        found = integrate_adaptive(
            slope, 0.0, start, scene.duration, method=method, rtol=tolerance, atol=0.1 * tolerance
        )
    spent = time.thread_time() - began
    if not found.complete:
        raise NoSolution(f"{mechanism.name}: own equations end at t = {found.t[-1]:.6g} s: {found.outcome.value}.")
    t = np.linspace(0.0, scene.duration, SAMPLES)
    q, v = states(found.at(t))
    channels, units = basic_channels(mechanism, q, v)
    settings = Settings(engine="analytic", integrator=method, tolerance=tolerance)
    cost = Cost(spent, len(found.t) - 1, found.evaluations)
    return Recording(
        mechanism, t, q, v, channels, units, cost=cost, settings=settings, scene=scene.name, fidelity=scene.fidelity
    )
