"""Integrates an entry's own equations of motion to a Recording, its reference, with a chosen tolerance."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.clock import spent_on
from mechlab.errors import NoSolution
from mechlab.experiment.prices import OWN_EQUATIONS
from mechlab.experiment.recording import Cost, Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Mechanism

Array = NDArray[np.float64]
SAMPLES = 2001
TOLERANCE = 1e-13
COLLOCATION = "collocation"
"""Method of `record_own` for stiff equations that take many states at once: `mechlab.integrate.collocation`."""


class _Joint:
    """The plant that a law sees: the only independent joint of the mechanism."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.t, self.phi, self.w = mechanism, 0.0, 0.0, 0.0

    def value(self, name: str) -> float:
        return self.phi

    def rate(self, name: str) -> float:
        return self.w


def one_freedom_slope(
    mechanism: Mechanism, scene: Scene, on: str, acceleration: Callable[[float, float, float], float]
) -> Callable[[float, Array], Array]:
    """The function slope(t, y) -> y' (2,) of y = (phi, phi') of the joint `on` under the laws of a scene.

    acceleration(phi, phi', force): the equation of motion; force: sum of the laws on the joint [N m or N].
    """
    plant: Any = _Joint(mechanism)

    def slope(t: float, y: Array) -> Array:
        plant.t, plant.phi, plant.w = t, float(y[0]), float(y[1])
        force = sum(law.force(t, plant).get(on, 0.0) for law in scene.laws)
        return np.array([plant.w, acceleration(plant.phi, plant.w, force)])

    return slope


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

    states: (n, m) states y -> coordinates (n, nq) and rates (n, nv) of the mechanism. `tolerance` is relative; the
    absolute tolerance is a tenth of it. method: of `integrate_adaptive`, or COLLOCATION, for which slope takes many states,
    t (k,) and y (k, m), too. Raises NoSolution when the integration does not reach the end.
    """
    from mechlab.integrate import count_work, integrate_adaptive, integrate_collocated  # not before a run

    def counted(t: Any, y: Array) -> Array:
        count_work(OWN_EQUATIONS)
        return slope(t, y)

    tolerance = max(tolerance, 2.3e-14)  # scipy refuses less than a hundred times the rounding unit
    began = time.thread_time()
    with spent_on("integrate"), np.errstate(over="ignore"):  # Radau's difference quotients by a state that nothing depends on
        if method == COLLOCATION:
            found = integrate_collocated(counted, 0.0, start, scene.duration, rtol=tolerance, atol=0.1 * tolerance)
        else:
            found = integrate_adaptive(
                counted, 0.0, start, scene.duration, method=method, rtol=tolerance, atol=0.1 * tolerance
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
