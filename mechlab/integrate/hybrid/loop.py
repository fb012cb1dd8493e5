"""The loop of a hybrid integration: integrate in constant modes to the next event, change the modes there, repeat."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError
from mechlab.integrate.hybrid.problem import (
    Array,
    Ending,
    Event,
    EventFinder,
    HybridTrajectory,
    Modes,
    RoughProblem,
    against,
    modes_at,
)
from mechlab.integrate.work import ADAPTIVE_STAGE, count_work


def integrate_hybrid(
    problem: RoughProblem,
    y0: ArrayLike,
    times: ArrayLike,
    *,
    modes: Modes | None = None,
    rtol: float = 1e-10,
    atol: float | ArrayLike = 1e-12,
    most_evaluations: int = 5_000_000,
    max_step: float = np.inf,
) -> HybridTrajectory:
    """Integrate from y0 (n,) at times[0] through the increasing sample times (m,).

    modes: those at the start; default: by the signs of the rates, and by the force balance where a rate is zero. Raises
    MechlabError for times that do not increase or shapes that do not fit; exceptions of the problem reach the caller.
    """
    t = np.asarray(times, dtype=float)
    y = np.array(y0, dtype=float)
    if t.ndim != 1 or len(t) < 2 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
        raise MechlabError("hybrid integration: expected at least two increasing finite times.")
    if problem.rates.shape != (len(problem.limits), len(y)):
        raise MechlabError(
            f"hybrid integration: {len(problem.limits)} friction limits and {len(y)} states need rates of shape "
            f"({len(problem.limits)}, {len(y)}), got {problem.rates.shape}."
        )
    return _Run(problem, t, y, rtol, atol, most_evaluations, max_step).go(modes)


SAME_TIME = 1e-9
"""A sample within this share of the time span of an event shows what comes after it: forces jump there, and where rounding puts the event
must not decide what is seen."""


class _Stop(Exception):
    def __init__(self, ending: Ending) -> None:
        self.ending = ending


class _Run:
    """One integration under way."""

    def __init__(
        self,
        problem: RoughProblem,
        times: Array,
        y: Array,
        rtol: float,
        atol: float | ArrayLike,
        most: int,
        longest: float,
    ) -> None:
        self.problem, self.times, self.y = problem, times, y
        self.rtol, self.atol, self.most, self.longest = rtol, atol, most, longest
        self.t = float(times[0])
        self.evaluations = self.steps = 0
        self.taken = [y.copy()]
        self.seen: list[Modes] = []
        self.events: list[Event] = []
        self.stuck = np.zeros(len(problem.limits))
        self.idle_restarts = 0
        self.lost = False

    def go(self, modes: Modes | None) -> HybridTrajectory:
        problem = self.problem
        if modes is None:
            modes = modes_at(problem, self.t, self.y)
            if any(m == 0 for m in modes):
                self.taken[0] = self.y = np.asarray(problem.settle(self.t, self.y, modes))
        self.modes = modes
        self.seen.append(self.modes)
        ending = Ending.COMPLETE
        try:
            while self.t < self.times[-1]:
                self._segment()
            self._record(lambda t: self.y, self.t, self.modes)
        except _Stop as stop:
            ending = stop.ending
        n = len(self.taken)
        return HybridTrajectory(
            self.times[:n], np.array(self.taken), np.array(self.seen, dtype=np.int64).reshape(n, -1), tuple(self.events),
            self.stuck, self.evaluations, self.steps, ending, self.t, self.y, self.modes,
        )  # fmt: skip

    def _slope(self, modes: Modes) -> Callable[[float, Array], Array]:
        def f(t: float, y: Array) -> Array:
            self.evaluations += 1
            count_work(ADAPTIVE_STAGE)
            if self.evaluations > self.most:
                raise _Stop(Ending.TOO_MANY)
            dy = np.asarray(self.problem.slope(t, y, modes), dtype=float)
            # At a trial stage the equations may not be finite: the step is rejected and a smaller one is tried.
            self.lost = self.lost or not (math.isfinite(dy.dot(dy)) or np.isfinite(dy).all())
            return dy

        return f

    def _segment(self) -> None:
        """Integrate in the present modes to the next event or the end."""
        from scipy.integrate import DOP853

        start, modes, self.lost = self.t, self.modes, False
        solver = DOP853(
            self._slope(modes), start, self.y, self.times[-1], rtol=self.rtol, atol=self.atol, max_step=self.longest
        )
        if self.lost:
            raise _Stop(Ending.NOT_FINITE)
        finder = EventFinder(self.problem, self.y, modes)
        while solver.status == "running":
            self.lost = False
            with np.errstate(invalid="ignore"):
                solver.step()
            self.steps += 1
            if solver.status == "failed":
                raise _Stop(Ending.NOT_FINITE if self.lost else Ending.STEP_TOO_SMALL)
            dense = solver.dense_output()
            finder.evaluations = 0
            found = finder.first(dense, solver.t_old, solver.t)
            self.evaluations += finder.evaluations
            end = solver.t if found is None else found[0]
            self._record(dense, end if found is None else end - SAME_TIME * (self.times[-1] - self.times[0]), modes)
            self.stuck += (end - self.t) * (np.array(modes) == 0)
            self.t, self.y = end, (solver.y.copy() if found is None else np.asarray(dense(end)))
            if found is not None:
                self._switch(found[1], start)
                return

    def _record(self, dense: Callable[[float], Array], end: float, modes: Modes) -> None:
        while len(self.taken) < len(self.times) and self.times[len(self.taken)] <= end:
            self.taken.append(np.asarray(dense(self.times[len(self.taken)])))
            self.seen.append(modes)

    def _switch(self, k: int, start: float) -> None:
        """The modes after an event at element k; the segment began at `start`."""
        self.idle_restarts = self.idle_restarts + 1 if self.t <= start else 0
        if self.idle_restarts > 4 * (len(self.modes) + 1):
            raise _Stop(Ending.CHATTER)
        before = self.modes
        self.evaluations += 1
        if before[k]:
            trial = tuple(0 if i == k else m for i, m in enumerate(before))
            self.y = np.asarray(self.problem.settle(self.t, self.y, trial))
            self.modes = modes_at(self.problem, self.t, self.y, before, [k])
        else:
            released = against(self.problem.holding(self.t, self.y, before)[k])
            self.modes = tuple(released if i == k else m for i, m in enumerate(before))
        for i, (a, b) in enumerate(zip(before, self.modes, strict=True)):
            if a != b or i == k:
                self.events.append(Event(self.t, self.y.copy(), i, a, b))
