"""Equations with dry friction: the problem, its modes (sticking or sliding, Coulomb's law), events, and the result.

Events are found on the dense output of a step: a sliding element comes to rest, or a stuck one breaks loose.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
Modes = tuple[int, ...]
"""One number for each friction element: +1 or -1 sliding that way, 0 stuck."""


class RoughProblem(Protocol):
    """Equations with dry friction: functions of (t, state) and the modes only.

    An element may have `targets` (k,): it sticks where its rate is that instead of 0.
    """

    limits: Array
    """(k,) largest friction forces, > 0; or (k, 2) the bounds of the force, low <= 0 <= high, which may be infinite."""
    rates: Array
    """(k, n) rows: the rate of element i is rates[i] @ y."""

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(n,) dy/dt in these modes."""
        ...

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(k,) friction forces: of stuck elements those that keep them at rest, of the others the bound against their mode."""
        ...

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the rates of stuck elements exactly at their targets."""
        ...


FLOOR = 1e-12
"""A rate is standstill below this share of 1 + the sum of the absolute terms that it consists of."""
GRAZING = 1e-9
"""A holding force is beyond its limit when it exceeds it by this share: rounding must not break an element loose."""


def slip(problem: RoughProblem, y: Array) -> Array:
    """(k, ...) rates of the elements less their targets at a state (n,) or states (n, m)."""
    found = problem.rates @ y
    targets = getattr(problem, "targets", None)
    return found if targets is None else found - np.reshape(targets, (-1, *[1] * (y.ndim - 1)))


def bounds(problem: RoughProblem) -> Array:
    """(k, 2) lowest and highest forces of the elements."""
    limits = np.asarray(problem.limits, dtype=float)
    return np.stack([-limits, limits], axis=1) if limits.ndim == 1 else limits


def beyond(problem: RoughProblem, forces: Array) -> Array:
    """(k,) by how much forces exceed their bounds (negative inside), as a share of the larger finite bound; of 1 without one."""
    low, high = bounds(problem).T
    size = np.maximum(*(np.where(np.isfinite(x), np.abs(x), 0.0) for x in (low, high)))
    return np.asarray(np.maximum(forces - high, low - forces) / np.where(size > 0.0, size, 1.0))


def floor(problem: RoughProblem, y: Array) -> Array:
    """(k,) largest rates that count as standstill, because rounding cannot tell them from zero."""
    return np.asarray(FLOOR * (1.0 + np.abs(problem.rates) @ np.abs(y)))


def modes_at(problem: RoughProblem, t: float, y: Array, modes: Modes | None = None, still: ArrayLike = ()) -> Modes:
    """The modes in which a state goes on: signs of the rates; elements at standstill, and those in `still`, stick if
    their limits allow it, else they slide against the holding force. Modes of moving elements are kept when given. An element
    that an unbounded force would brake sticks at once: `settle` stops it."""
    rate = slip(problem, y)
    low, high = bounds(problem).T
    resting = {int(k) for k in np.flatnonzero(np.abs(rate) <= floor(problem, y))} | {
        int(k) for k in np.asarray(still, dtype=int)
    } | {int(k) for k in np.flatnonzero(np.isinf(np.where(rate > 0.0, low, high)))}
    out = [0 if k in resting else (modes[k] if modes and modes[k] else int(np.sign(x))) for k, x in enumerate(rate)]
    for _ in range(len(out) + 1):
        stuck = [k for k in range(len(out)) if out[k] == 0]
        if not stuck:
            break
        force = problem.holding(t, y, tuple(out))
        over = beyond(problem, force)
        worst = max(stuck, key=lambda k: over[k])
        if over[worst] <= GRAZING:
            break
        out[worst] = against(force[worst])
    return tuple(out)


def against(holding: float) -> int:
    """The mode of an element that breaks loose from a holding force."""
    return -1 if holding > 0 else 1


LOOKS = 8
"""Intervals of a step; the sign of a rate is checked at their ends."""
Dense = Callable[[ArrayLike], Array]


class EventFinder:
    """Finds the events of one segment, an integration in constant modes. `evaluations` counts holding forces.

    risen: elements whose rate has had the sign of their mode since the segment began; only those can come to rest.
    """

    def __init__(self, problem: RoughProblem, y: Array, modes: Modes) -> None:
        self.problem, self.modes = problem, modes
        self.evaluations = 0
        self.began = np.array(modes) * slip(problem, y)
        self.risen: list[bool] = list(self.began > floor(problem, y))

    def first(self, dense: Dense, t0: float, t1: float) -> tuple[float, int] | None:
        """Time and element of the first event of a step, if there is one."""
        best: tuple[float, int] | None = None
        points = np.linspace(t0, t1, LOOKS + 1)
        states = np.asarray(dense(points))
        along = slip(self.problem, states)
        least = floor(self.problem, states[:, -1])
        for k, mode in enumerate(self.modes):
            if mode:
                found = self._stops(dense, points, mode * along[k], k, least[k])
            else:
                found = self._breaks(dense, t0, t1, k)
            if found is not None and (best is None or found < best[0]):
                best = (found, k)
        return best

    def _stops(self, dense: Dense, points: Array, rate: Array, k: int, least: float) -> float | None:
        """When a sliding element comes to rest: the first change of sign after its rate has had the sign of its mode."""
        from scipy.optimize import brentq

        def along(t: float) -> float:
            return float(self.modes[k] * slip(self.problem, dense(t))[k])

        last = 0
        for i in range(len(points)):
            if rate[i] > least:
                self.risen[k], last = True, i
            elif rate[i] < -least:
                if not self.risen[k] and rate[i] >= self.began[k]:
                    continue  # where an event put it, within the tolerance, on its way to the sign of its mode
                if not self.risen[k]:
                    return float(points[0])  # it would slide the other way at once
                if not along(points[last]) > 0.0:
                    return float(points[last])
                return float(brentq(along, points[last], points[i], xtol=1e-15, rtol=1e-15))
        return None

    def _breaks(self, dense: Dense, t0: float, t1: float, k: int) -> float | None:
        """When the holding force of a stuck element reaches its limit."""
        from scipy.optimize import brentq

        def reserve(t: float) -> float:
            self.evaluations += 1
            return GRAZING - float(beyond(self.problem, self.problem.holding(t, np.asarray(dense(t)), self.modes))[k])

        points = np.linspace(t0, t1, 4)
        values = [reserve(t) for t in points]
        for i, value in enumerate(values):
            if value < 0.0:
                if i == 0:
                    return t0
                return float(brentq(reserve, points[i - 1], points[i], xtol=1e-15, rtol=1e-15))
        return None


class Ending(Enum):
    """How a hybrid integration ended, as a sentence."""

    COMPLETE = "complete"
    STEP_TOO_SMALL = "the step size fell below rounding: a singularity or a stiff problem"
    NOT_FINITE = "the state is not finite"
    TOO_MANY = "the largest number of evaluations was reached; try a larger tolerance"
    CHATTER = "events follow each other without time passing: the friction law has no consistent continuation here"


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
