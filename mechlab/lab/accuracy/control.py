"""A scene recorded to a stated error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.held_rates import captured
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.accuracy.measure import Measure
from mechlab.lab.accuracy.result import Neighbour, Result, motion_of, recording_of, with_estimate
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.design import Design
from mechlab.lab.methods import Problem
from mechlab.lab.problem_settings import other_softness
from mechlab.mechanism import Mechanism

OUTPUTS = 400
STATES_SUFFICE = frozenset({"poses", "drive_forces"})


BETWEEN = 0.125
"""Share of the change with twice the distance of the states that interpolation between them leaves, at most: it is of fifth degree
in positions, whose second derivative falls with the fourth power."""
Compared = tuple[tuple[Recording, float], ...]


@dataclass(frozen=True)
class Controlled:
    """A Recording, and those that it is compared with: factor times the difference is a part of the error of each channel.
    None of them where nothing tells it."""

    recording: Recording
    others: Compared


def control(design: Design, scene: Scene, max_error: float, at: Sequence[float] = ()) -> Controlled:
    """A Recording of the scene with an error of at most `max_error` of its tracked quantities, or one that says why not.

    Made from the very states that were estimated where those tell all that the scene needs; else by the runner of the
    accepted method with its settings, and what that differs by counts as error too.
    """
    result = solve_to(design, scene, max_error, OUTPUTS)
    m = design.mechanism(scene.fidelity)
    remembers = any(tuple(getattr(law, "start", tuple)()) for law in scene.laws)
    suffice = set(scene.needs) <= STATES_SUFFICE and not remembers and result.settings.engine in ("mujoco", "pinocchio")
    if result.motion is not None or result.extrapolated or suffice:
        return Controlled(recording_of(m, scene, result, at), _of_states(m, scene, result, at))
    times = np.union1d(result.t, np.asarray(at, dtype=float)).tolist()
    made = _run(design, scene, result.settings, times)
    difference = _difference(design, scene, result, made)
    more = 1.0 + difference / result.estimate if result.estimate > 0.0 else 1.0
    others = _compared(result, lambda n: _run(design, _captured(scene, n), n.settings, times), more)
    other = other_softness(m, result.settings)
    if others and other is not None:
        others += ((_run(design, scene, other, times), 1.0),)
    return Controlled(with_estimate(made, result, difference), others)


def _of_states(m: Mechanism, scene: Scene, result: Result, at: Sequence[float]) -> Compared:
    """What a recording of the estimated states is compared with; between them, too, where it is interpolated there."""

    def make(n: Neighbour) -> Recording:
        return motion_of(m, _captured(scene, n), replace(result, motion=n.motion, q=n.q, v=n.v), at)

    others = _compared(result, make)
    if others and result.motion is None and np.setdiff1d(at, result.t).size:
        others += ((motion_of(m, scene, result, at, every=2), BETWEEN),)
    return others


def _compared(result: Result, make: Callable[[Neighbour], Recording], more: float = 1.0) -> Compared:
    """The neighbours of a result as recordings, each with `more` times its factor; none where one of them cannot be made, since
    what it would have told is missing then."""
    try:
        return tuple((make(n), more * n.factor) for n in result.neighbours)
    except MechlabError:
        return ()


def _captured(scene: Scene, n: Neighbour) -> Scene:
    return scene if n.captured == 1.0 else replace(scene, laws=captured(scene.laws, n.captured))


def _run(design: Design, scene: Scene, settings: Settings, times: list[float]) -> Recording:
    m = design.mechanism(scene.fidelity)
    return replace(engine(settings.engine).run(m, scene, settings, times), settings=settings)


def _difference(design: Design, scene: Scene, result: Result, made: Recording) -> float:
    """Largest difference of the tracked quantities between the recorded run and the estimated one."""
    at = np.clip(np.searchsorted(made.t, result.t * (1.0 - 1e-12)), 0, len(made.t) - 1)
    if np.max(np.abs(made.t[at] - result.t)) > 1e-9 * scene.duration:
        return float("inf")
    measure = Measure(Problem(design, scene, len(result.t) - 1), None)
    ours = measure(result.t, result.q, result.v)
    return float(np.max(np.abs(measure(made.t[at], made.q[at], made.v[at]) - ours), initial=0.0))
