"""Checks for entries: answers of all witnesses at some poses, moving states as particles, the end of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.question import Question, answers_at
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import mass_check
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

EXACT = Settings("pinocchio", integrator="DOP853", tolerance=1e-10)
"""Settings of runs of Pinocchio that others are compared with."""


def by_witnesses(
    p: Any, question: Question, given: Iterable[Mapping[str, Any]], tolerance: float, note: str, turned: bool = True
) -> CheckResult:
    """Compares all answers of a question between its witnesses, for each set of given quantities, of the same names.

    turned: angles are compared by cosine and sine, that is modulo 2 pi; else as they are.
    """
    angles = question.angles if turned else ()
    plain, each = [a for a in question.answers if a not in angles], list(given)
    together = {k: np.array([x[k] for x in each]) for k in each[0]}
    rows: dict[str, list[list[Any]]] = {}
    for witness, ask in question.witnesses.items():
        found = [x.values for x in answers_at(ask, p, together, len(each))]
        rows[witness] = [[*(x[a] for a in plain), *(g(x[a]) for a in angles for g in (np.cos, np.sin))] for x in found]
    return CheckResult(rows, tolerance, note=note)


def moving_check(
    id: str,
    build: Callable[[Any, str], Mechanism],
    fidelity: str,
    states: Callable[[Any], Iterable[mass_check.State]],
    from_reference: bool = False,
) -> Check:
    """Mass, momenta, energy, power and points of moving states in closed form, against three implementations.

    from_reference: the first state is at the reference pose, so all its coordinates are 0.
    """

    def run(p: Any) -> CheckResult:
        m, found = build(p, fidelity), list(states(p))
        if from_reference:
            found[0] = replace(found[0], is_reference=True)
        return mass_check.compare([(m, state) for state in found])

    return Check(id, mass_check.TEXT, run, mass_check.SOURCE)


def moving_in_fidelities(
    id: str,
    build: Callable[[Any, str], Mechanism],
    state: Callable[[Any, str], mass_check.State | None],
    fidelities: Iterable[str],
) -> Check:
    """As `moving_check`, with one moving state in each fidelity; state(p, fidelity) gives None where there is none."""

    def run(p: Any) -> CheckResult:
        states = {f: state(p, f) for f in fidelities}
        return mass_check.compare([(build(p, f), s) for f, s in states.items() if s is not None])

    return Check(id, mass_check.TEXT, run, mass_check.SOURCE)


def closed_form_recording(m: Mechanism, scene: Scene, t: Array, q: Array, v: Array) -> Recording:
    """The Recording of a closed form: coordinates (n, nq) and rates (n, nv) at the times t (n,) [s] of a scene."""
    channels, units = basic_channels(m, q, v)
    how = Settings(engine="analytic")
    return Recording(m, t, q, v, channels, units, settings=how, scene=scene.name, fidelity="minimal")


def end_of_run(
    m: Mechanism,
    scene: Scene,
    truth: Recording,
    settings: Iterable[Settings],
    tolerance: float,
    names: str | Sequence[str],
    note: str = "",
) -> CheckResult:
    """Compares channels at the end of a scene between engines, each with its settings, and a closed form or own equations (`truth`).

    A single name gives a number, several names a list.
    """

    def last(run: Recording) -> Any:
        return run.channel(names)[-1] if isinstance(names, str) else [run.channel(n)[-1] for n in names]

    runs = {s.engine: engine(s.engine).at_times(m, scene, s, [scene.duration]) for s in settings}
    return CheckResult({e: last(r) for e, r in runs.items()}, tolerance, last(truth), note)


def driven_run(
    m: Mechanism, scene: Scene, reference: Callable[[Any, Scene], Recording], p: Any, share: float
) -> CheckResult:
    """Every joint and shaft after a share of a scene with prescribed drive motions: MuJoCo against the closed form."""
    part = replace(scene, duration=share * scene.duration)
    truth = reference(p, part)
    names = [n for n in truth.mechanism.scalar_names if n in truth.channels]
    # Softness of MuJoCo's loops, time constant 2.8 or 2.4 ms: (1 - d) tc^2 x acceleration stays below 1e-6 here.
    # Runs of more than 1 s are slow motions.
    settings = Settings(timestep=7e-4, timeconst=4.0) if part.duration < 1.0 else Settings(timestep=1e-3, timeconst=2.4)
    return end_of_run(m, part, truth, (settings,), 1e-5, names, ", ".join(names))


def range_ends(inside: Callable[[float], bool], middle: float, reach: float, step: float = 1e-3) -> tuple[float, float]:
    """Low and high end of the interval about `middle` in which a condition holds, at most `reach` away.

    Found by steps outwards that are halved where the condition fails, down to 1e-9.
    """
    ends = []
    for sign in (-1.0, 1.0):
        way, h = 0.0, step
        while h > 1e-9:
            if way + h <= reach and inside(middle + sign * (way + h)):
                way += h
            else:
                h *= 0.5
        ends.append(middle + sign * way)
    return ends[0], ends[1]
