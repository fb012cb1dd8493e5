"""The run: DOP853 between located events, in parts that start on the constraints."""

from __future__ import annotations

import time
from collections.abc import Callable

from numpy.typing import ArrayLike

from mechlab.experiment.initial import initial_state
from mechlab.experiment.observe import sample_grid
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.integrate import Ending, HybridTrajectory, integrate_hybrid
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.solve.equations import BlowUp
from mechlab.solve.hybrid.equations import RoughEquations
from mechlab.solve.hybrid.record import recording_of

RESTART = 20
"""A mechanism with loops or gears is projected onto them after so many samples."""


def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    sample_times: ArrayLike | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """A run of the scene with exact dry friction: DOP853 between located events, relative `settings.tolerance`.

    Finding "friction" counts the events and the time each joint or shaft stood still; a run that cannot go on ends
    there with the finding "blow_up" (error). Raises MechlabError for bad input, NoSolution when the start does not close.
    """
    chosen = settings or Settings(engine="hybrid", integrator="DOP853")
    times = sample_grid(scene.duration, min(chosen.timestep, scene.duration / 200.0), sample_times)
    q, v = initial_state(mechanism, scene)
    motion = RoughEquations(mechanism, scene.laws)
    began = time.thread_time()
    parts, end = _integrate(motion, times, motion.start(q, v), chosen.tolerance, progress)
    spent = time.thread_time() - began
    return recording_of(mechanism, scene, chosen, motion, parts, end, spent)


def _integrate(
    motion: RoughEquations, times: Array, y: Array, tolerance: float, progress: Callable[[float], None] | None
) -> tuple[list[HybridTrajectory], BlowUp | None]:
    """All parts of a run, and what ended it early. Without constraints there is one part."""
    parts: list[HybridTrajectory] = []
    closed = len(motion.plant.constraints) > 0 or bool(motion.quaternions)
    length = RESTART if closed else len(times) - 1
    modes = None
    for k in range(0, len(times) - 1, length):
        try:
            part = integrate_hybrid(
                motion, y, times[k : k + length + 1], modes=modes, rtol=tolerance, atol=1e-2 * tolerance
            )
        except BlowUp as end:
            return parts, end
        parts.append(part)
        if not part.complete:
            known = part.ending is Ending.NOT_FINITE and motion.trouble
            return parts, BlowUp(part.last_t, motion.trouble if known else part.ending.value)
        y, modes = (motion.project(part.last_t, part.last_y) if closed else part.last_y), part.last_modes
        if progress is not None:
            progress(part.last_t)
    return parts, None
