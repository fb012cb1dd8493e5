"""Event location on the dense output of a step: a sliding element comes to rest, a stuck one breaks loose."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mechlab.integrate.hybrid.modes import GRAZING, floor
from mechlab.integrate.hybrid.problem import Array, Modes, RoughProblem

LOOKS = 8
"""Points of a step at which the sign of a rate is looked at."""
Dense = Callable[[ArrayLike], Array]


class EventFinder:
    """Looks for the events of one segment: an integration in constant modes. `evaluations` counts holding forces.

    risen: elements whose rate has had the sign of their mode since the segment began; only those can come to rest.
    """

    def __init__(self, problem: RoughProblem, y: Array, modes: Modes) -> None:
        self.problem, self.modes = problem, modes
        self.evaluations = 0
        self.risen: list[bool] = list(np.array(modes) * (problem.rates @ y) > floor(problem, y))

    def first(self, dense: Dense, t0: float, t1: float) -> tuple[float, int] | None:
        """Time and element of the first event of a step, if there is one."""
        best: tuple[float, int] | None = None
        points = np.linspace(t0, t1, LOOKS + 1)
        states = np.asarray(dense(points))
        along = self.problem.rates @ states
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

        row = self.modes[k] * self.problem.rates[k]

        def along(t: float) -> float:
            return float(row @ dense(t))

        last = 0
        for i in range(len(points)):
            if rate[i] > least:
                self.risen[k], last = True, i
            elif rate[i] < -least:
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
            force = self.problem.holding(t, np.asarray(dense(t)), self.modes)[k]
            return float(self.problem.limits[k] * (1.0 + GRAZING) - abs(force))

        points = np.linspace(t0, t1, 4)
        values = [reserve(t) for t in points]
        for i, value in enumerate(values):
            if value < 0.0:
                if i == 0:
                    return t0
                return float(brentq(reserve, points[i - 1], points[i], xtol=1e-15, rtol=1e-15))
        return None
