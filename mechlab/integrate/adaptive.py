"""Integration with step-size control: scipy's DOP853 (Hairer & Wanner) and Radau with dense output, and LSODA (Petzold 1983).

LSODA turns implicit by itself where the problem is stiff. Its compiled loop calls the right-hand side alone, so that its steps
cost no Python.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, unknown
from mechlab.integrate.work import ADAPTIVE_STAGE, LSODA_CALL, count_work
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
ADAPTIVE = ("DOP853", "Radau")


class IntegrationStatus(Enum):
    """How an integration ended, as a sentence."""

    COMPLETE = "complete"
    STEP_TOO_SMALL = (
        "the step size fell below rounding: a singularity, an impact or a stiff problem; try Radau or stop before it"
    )
    NOT_FINITE = "the right-hand side is not finite"
    TOO_MANY = "the largest number of evaluations was reached; try a larger tolerance, or Radau for a stiff problem"


@dataclass(frozen=True)
class Trajectory:
    """An integration: times (n,) and states (n, m) of the accepted steps, evaluations, outcome, and `at(t)` in
    between."""

    t: Array
    y: Array
    evaluations: int
    outcome: IntegrationStatus
    dense: Callable[[ArrayLike], Array]

    @property
    def complete(self) -> bool:
        """True when the end time was reached."""
        return self.outcome is IntegrationStatus.COMPLETE

    @property
    def last_step(self) -> float:
        """Larger of the last two steps (the end time may cut the last): a first step for a continuation; 0 if none."""
        steps = np.abs(np.diff(self.t))
        return float(np.max(steps[-2:])) if len(steps) else 0.0

    def at(self, t: ArrayLike) -> Array:
        """(..., m) state at times t (...,) by dense output; raises MechlabError for a time that was not reached."""
        times = np.asarray(t, dtype=float)
        low, high = min(self.t[0], self.t[-1]), max(self.t[0], self.t[-1])
        room = 1e-12 * max(abs(low), abs(high), 1e-300)
        if not np.all((times >= low - room) & (times <= high + room)):
            raise MechlabError(f"time {t!r} lies outside the integration ({low:g} to {high:g}; {self.outcome.value}).")
        return np.moveaxis(self.dense(times), 0, -1)


class _StopIntegration(Exception):
    def __init__(self, outcome: IntegrationStatus) -> None:
        self.outcome = outcome


def integrate_adaptive(
    f: Callable[[float, Array], Array],
    t0: float,
    y0: ArrayLike,
    t1: float,
    *,
    method: str = "DOP853",
    rtol: float = 1e-9,
    atol: float | ArrayLike = 1e-12,
    first_step: float | None = None,
    max_step: float = np.inf,
    most_evaluations: int = 10_000_000,
    times: ArrayLike | None = None,
) -> Trajectory:
    """dy/dt = f(t, y) from y0 (m,) at t0 to t1 (either direction). Never returns a state that is not finite: an
    integration that cannot go on ends with an `outcome` and the steps done so far. An exception raised by f reaches
    the caller. times: those at which the trajectory will be asked, by default all; elsewhere it lacks the dense output, three more
    evaluations a step.

    Raises MechlabError for an unknown method, or times that are equal or not finite.
    """
    from scipy.integrate import DOP853, OdeSolution, Radau

    if method not in ADAPTIVE:
        raise unknown("method", method, ADAPTIVE)
    if not (np.isfinite(t0) and np.isfinite(t1) and t0 != t1):
        raise MechlabError(f"times: expected two different finite numbers, got {t0!r} and {t1!r}.")
    count = 0

    def checked(t: float, y: Array) -> Array:
        nonlocal count
        count += 1
        count_work(ADAPTIVE_STAGE)
        if count > most_evaluations:
            raise _StopIntegration(IntegrationStatus.TOO_MANY)
        dy = np.asarray(f(t, y), dtype=float)
        if not np.isfinite(dy).all():
            raise _StopIntegration(IntegrationStatus.NOT_FINITE)
        return dy

    start, wanted = np.array(y0, dtype=float), None if times is None else np.asarray(times, dtype=float)
    ends, states, pieces = [float(t0)], [start], list[Callable[[Any], Any]]()
    outcome = IntegrationStatus.COMPLETE
    try:
        first = None if not first_step else min(first_step, abs(t1 - t0), max_step)
        kind = DOP853 if method == "DOP853" else Radau
        solver = kind(checked, t0, start, t1, rtol=rtol, atol=atol, first_step=first, max_step=max_step)
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                outcome = IntegrationStatus.STEP_TOO_SMALL
                break
            low, high = sorted((solver.t_old, solver.t))
            asked = wanted is None or bool(((low <= wanted) & (wanted <= high)).any())
            pieces.append(solver.dense_output() if asked else _unasked)
            ends.append(float(solver.t))
            states.append(solver.y.copy())
    except _StopIntegration as stop:
        outcome = stop.outcome
    if pieces:
        dense: Callable[[ArrayLike], Array] = OdeSolution(ends, pieces)
    else:
        dense = _constant(start)
    return Trajectory(np.array(ends), np.array(states), count, outcome, dense)


def _unasked(t: ArrayLike) -> Array:
    raise MechlabError(f"time {t!r} is in a step without dense output: it was not among the times of the integration.")


def _constant(y: Array) -> Callable[[ArrayLike], Array]:
    return lambda t: np.multiply.outer(y, np.ones(np.shape(t)))


COUNTED_CALLS = 32
"""Calls by LSODA whose work is counted together: a call takes some microseconds."""
MOST_STEPS = 500_000
"""Most steps of LSODA between two requested times."""


@dataclass(frozen=True)
class LsodaStates:
    """States y (n, m) at the first n requested times; steps, evaluations; `reason` of an early end, "" without one."""

    y: Array
    steps: int
    evaluations: int
    reason: str


def integrate_lsoda(
    f: Callable[[float, Array], Array],
    y0: Array,
    times: Array,
    tolerance: float,
    jacobian: Callable[[float, Array], Array] | None = None,
    price: float = 0.0,
) -> LsodaStates:
    """dy/dt = f(t, y) from y0 (m,) at times[0] to all of `times` (n,). `tolerance` is relative; the
    absolute one is a tenth of it. jacobian: df/dy (m, m); without it, it costs m calls of f. price: counted work [s] of a call of f, where
    f does not count it."""
    import warnings

    from scipy.integrate import ODEintWarning, odeint

    calls, each = 0, LSODA_CALL + price

    def counted(t: float, y: Array) -> Array:
        nonlocal calls
        calls += 1
        if not calls % COUNTED_CALLS:
            count_work(COUNTED_CALLS * each)
        return f(t, y)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ODEintWarning)
        y, report = odeint(
            counted,
            y0,
            times,
            tfirst=True,
            rtol=tolerance,
            atol=0.1 * tolerance,
            full_output=1,
            mxstep=MOST_STEPS,
            Dfun=jacobian,
        )
    count_work(calls % COUNTED_CALLS * each)
    fine = np.all(np.isfinite(y), axis=1)
    count = len(times)
    reason = ""
    if report["message"] != "Integration successful.":
        count = 1 + int(np.argmin(np.diff(report["tcur"]) > 0.0)) if len(times) > 2 else 1
        reason = f"LSODA stopped before t = {times[min(count, len(times) - 1)]:.4g} s: {report['message']}"
    elif not fine.all():
        reason = "the state is not finite"
    if not fine.all():
        count = min(count, int(np.argmin(fine)))
    return LsodaStates(np.asarray(y[:count]), int(report["nst"][-1]), int(report["nfe"][-1]), reason)
