"""Dry friction integrated as it is: set-valued at standstill, with located events, without chatter or smoothing.

Each friction element i acts along a scalar rate r_i = rates[i] @ y with a force in [-limit_i, +limit_i]. Its mode is +1
or -1 (sliding that way, force -mode limit) or 0 (stuck: the force is whatever keeps the rate at zero). Between events the
equations are smooth and DOP853 (Hairer, Norsett & Wanner 1993) integrates them; events are found on its dense output.
At standstill the next modes follow from the force that sticking would take: within its limit an element sticks,
otherwise it slides against that force (Coulomb; Acary & Brogliato 2008, chapter 1). A restart keeps the sliding sense as
its mode and waits for the rate to take that sign, so that an event cannot trigger itself again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError

Array = NDArray[np.float64]
Modes = tuple[int, ...]
FLOOR = 1e-12
"""Rates below this share of the terms that they are summed from, or of 1, are standstill."""
LOOKS = 8
"""Points of a step at which the sign of a rate is looked at."""
GRAZING = 1e-9
"""A holding force is beyond its limit when it exceeds it by this share: rounding must not break an element loose."""


class Ending(Enum):
    """How a hybrid integration ended, as a sentence."""

    COMPLETE = "complete"
    STEP_TOO_SMALL = "the step size fell below rounding: a singularity or a stiff problem"
    NOT_FINITE = "the state is not finite"
    TOO_MANY = "the largest number of evaluations was reached; try a larger tolerance"
    CHATTER = "events follow each other without time passing: the friction law has no consistent continuation here"


class RoughProblem(Protocol):
    """Equations with dry friction: functions of (t, state) and the modes only."""

    limits: Array
    """(k,) largest friction forces, > 0."""
    rates: Array
    """(k, n) rows: the rate of element i is rates[i] @ y."""

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(n,) dy/dt in these modes."""
        ...

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(k,) friction forces: of stuck elements what keeps them still, of the others -mode limit."""
        ...

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the rates of stuck elements exactly zero."""
        ...


@dataclass(frozen=True)
class Event:
    """An element changed its mode: time, state, index of the element, modes before and after."""

    t: float
    y: Array
    element: int
    before: int
    after: int


@dataclass(frozen=True)
class HybridTrajectory:
    """States y (m, n) and modes (m, k) at the sample times t (m,); events; time stuck (k,); evaluations; modes at the end.

    An integration that could not go on has the samples up to there and says why in `ending`; `last_t`, `last_y` is
    where it stopped.
    """

    t: Array
    y: Array
    modes: NDArray[np.int64]
    events: tuple[Event, ...]
    stuck_time: Array
    evaluations: int
    steps: int
    ending: Ending
    last_t: float
    last_y: Array
    last_modes: Modes

    @property
    def complete(self) -> bool:
        """True when the end time was reached."""
        return self.ending is Ending.COMPLETE


class _Stop(Exception):
    def __init__(self, ending: Ending) -> None:
        self.ending = ending


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
    MechlabError for times that do not increase or shapes that do not fit; what the problem raises reaches the caller.
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


def modes_at(problem: RoughProblem, t: float, y: Array, modes: Modes | None = None, still: ArrayLike = ()) -> Modes:
    """The modes in which a state goes on: signs of the rates; elements at standstill, and those in `still`, stick if
    their limits allow it, else they slide against the holding force. Modes of moving elements are kept when given."""
    rate = problem.rates @ y
    resting = {int(k) for k in np.flatnonzero(np.abs(rate) <= _floor(problem, y))} | {
        int(k) for k in np.asarray(still, dtype=int)
    }
    out = [0 if k in resting else (modes[k] if modes and modes[k] else int(np.sign(x))) for k, x in enumerate(rate)]
    for _ in range(len(out) + 1):
        stuck = [k for k in range(len(out)) if out[k] == 0]
        if not stuck:
            break
        force = problem.holding(t, y, tuple(out))
        over = {k: abs(force[k]) / problem.limits[k] for k in stuck}
        worst = max(stuck, key=lambda k: over[k])
        if over[worst] <= 1.0 + GRAZING:
            break
        out[worst] = -1 if force[worst] > 0 else 1
    return tuple(out)


def _floor(problem: RoughProblem, y: Array) -> Array:
    """(k,) rates that rounding cannot tell from zero."""
    return np.asarray(FLOOR * (1.0 + np.abs(problem.rates) @ np.abs(y)))


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

    def go(self, modes: Modes | None) -> HybridTrajectory:
        problem = self.problem
        self.modes = modes_at(problem, self.t, self.y) if modes is None else modes
        self.seen.append(self.modes)
        ending = Ending.COMPLETE
        try:
            while self.t < self.times[-1]:
                self._segment()
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
            if self.evaluations > self.most:
                raise _Stop(Ending.TOO_MANY)
            dy = np.asarray(self.problem.slope(t, y, modes), dtype=float)
            if not np.all(np.isfinite(dy)):
                raise _Stop(Ending.NOT_FINITE)
            return dy

        return f

    def _segment(self) -> None:
        """Integrate in the present modes to the next event or the end."""
        from scipy.integrate import DOP853

        start, modes = self.t, self.modes
        solver = DOP853(
            self._slope(modes), start, self.y, self.times[-1], rtol=self.rtol, atol=self.atol, max_step=self.longest
        )
        risen = list(np.array(modes) * (self.problem.rates @ self.y) > _floor(self.problem, self.y))
        while solver.status == "running":
            solver.step()
            self.steps += 1
            if solver.status == "failed":
                raise _Stop(Ending.STEP_TOO_SMALL)
            dense = solver.dense_output()
            found = self._first_event(dense, solver.t_old, solver.t, modes, risen)
            end = solver.t if found is None else found[0]
            self._record(dense, end, modes)
            self.stuck += (end - self.t) * (np.array(modes) == 0)
            self.t, self.y = end, (solver.y.copy() if found is None else np.asarray(dense(end)))
            if found is not None:
                self._switch(found[1], start)
                return

    def _record(self, dense: Callable[[float], Array], end: float, modes: Modes) -> None:
        while len(self.taken) < len(self.times) and self.times[len(self.taken)] <= end:
            self.taken.append(np.asarray(dense(self.times[len(self.taken)])))
            self.seen.append(modes)

    def _first_event(
        self, dense: Callable[[ArrayLike], Array], t0: float, t1: float, modes: Modes, risen: list[bool]
    ) -> tuple[float, int] | None:
        """Time and element of the first event of a step, if there is one."""
        best: tuple[float, int] | None = None
        points = np.linspace(t0, t1, LOOKS + 1)
        states = np.asarray(dense(points))
        along = self.problem.rates @ states
        floor = _floor(self.problem, states[:, -1])
        for k, mode in enumerate(modes):
            if mode:
                found = self._stops(dense, points, mode * along[k], k, mode, risen, floor[k])
            else:
                found = self._breaks(dense, t0, t1, modes, k)
            if found is not None and (best is None or found < best[0]):
                best = (found, k)
        return best

    def _stops(
        self,
        dense: Callable[[ArrayLike], Array],
        points: Array,
        rate: Array,
        k: int,
        mode: int,
        risen: list[bool],
        floor: float,
    ) -> float | None:
        """When a sliding element comes to rest: the first change of sign after its rate has had the sign of its mode."""
        from scipy.optimize import brentq

        row = mode * self.problem.rates[k]

        def along(t: float) -> float:
            return float(row @ dense(t))

        last = 0
        for i in range(len(points)):
            if rate[i] > floor:
                risen[k], last = True, i
            elif rate[i] < -floor:
                if not risen[k]:
                    return float(points[0])  # it would slide the other way at once
                if not along(points[last]) > 0.0:
                    return float(points[last])
                return float(brentq(along, points[last], points[i], xtol=1e-15, rtol=1e-15))
        return None

    def _breaks(self, dense: Callable[[ArrayLike], Array], t0: float, t1: float, modes: Modes, k: int) -> float | None:
        """When the holding force of a stuck element reaches its limit."""
        from scipy.optimize import brentq

        def reserve(t: float) -> float:
            self.evaluations += 1
            force = self.problem.holding(t, np.asarray(dense(t)), modes)[k]
            return float(self.problem.limits[k] * (1.0 + GRAZING) - abs(force))

        points = np.linspace(t0, t1, 4)
        values = [reserve(t) for t in points]
        for i, value in enumerate(values):
            if value < 0.0:
                if i == 0:
                    return t0
                return float(brentq(reserve, points[i - 1], points[i], xtol=1e-15, rtol=1e-15))
        return None

    def _switch(self, k: int, start: float) -> None:
        """The modes after an event at element k; the segment began at `start`."""
        self.idle_restarts = self.idle_restarts + 1 if self.t <= start else 0
        if self.idle_restarts > 4 * (len(self.modes) + 1):
            raise _Stop(Ending.CHATTER)
        before = self.modes
        if before[k]:
            trial = tuple(0 if i == k else m for i, m in enumerate(before))
            self.y = np.asarray(self.problem.settle(self.t, self.y, trial))
            self.evaluations += 1
            self.modes = modes_at(self.problem, self.t, self.y, before, [k])
        else:
            force = self.problem.holding(self.t, self.y, before)[k]
            self.evaluations += 1
            released = -1 if force > 0 else 1
            self.modes = tuple(released if i == k else m for i, m in enumerate(before))
        for i, (a, b) in enumerate(zip(before, self.modes, strict=True)):
            if a != b or i == k:
                self.events.append(Event(self.t, self.y.copy(), i, a, b))
