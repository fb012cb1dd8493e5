"""A motion that was found as a whole: checked by an engine, its error judged."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.experiment.settings import Settings
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.check_method import Checker
from mechlab.study.error_control.measure import Measure
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.motion import Motion, States
from mechlab.study.error_control.result import Neighbour, Result
from mechlab.study.error_control.verdict import LOW, ROUNDING, verdict
from mechlab.study.methods import Problem


@dataclass(frozen=True)
class Asked:
    """What is asked: a problem at the times t (n,) from q0, v0, within `max_error` of the tracked quantities; the engine that
    checks it, ready, and the meter that counts."""

    problem: Problem
    measure: Measure
    max_error: float
    t: Array
    q0: Array
    v0: Array
    checker: Checker
    meter: Meter


@dataclass(frozen=True)
class Found:
    """A motion with its states at the output times and their tracked quantities; error: estimated in all, rounding: of
    which it is; chosen: by what it was found and why, in words; method, step, control, evaluations as of `Result`, integrator
    as of `Settings`; share: of the difference of `motion.cruder()` that is error."""

    motion: Motion
    states: States
    tracked: Array
    error: float
    rounding: float
    chosen: str
    method: str
    step: float
    control: str
    evaluations: int
    integrator: str
    share: float = 1.0


def judged(asked: Asked, found: Found) -> Result:
    """The result: `found`, checked by an engine over as much of the scene as its cost allows."""
    a, x, unit = asked, found, asked.measure.unit
    checked = a.checker.check(a.measure, x.tracked, a.meter)
    spent, size = a.meter.cpu_s, float(abs(x.tracked).max(initial=1.0))
    part, cause = (f"rounding {x.rounding:.1g}", ROUNDING) if a.max_error < LOW else ("", "")
    ok, sentence = verdict(x.error, a.max_error, a.measure, x.chosen, checked, size, part, cause)
    settings = Settings(
        engine="one_freedom", integrator=x.integrator, timestep=a.problem.scene.duration / a.problem.outputs,
        tolerance=max(x.error, 1e-16), preset="max_error",
    )  # fmt: skip
    return Result(
        a.t, x.states.q, x.states.v, x.error, a.max_error, unit, x.method, x.step, x.control, spent, x.evaluations,
        ok, sentence, settings, checked, x.motion, neighbours=(Neighbour(x.share, settings, x.states.q, x.states.v, x.motion.cruder()),),
    )  # fmt: skip
