"""The states of a run at even times, beside those of a run with other steps."""

from __future__ import annotations

import numpy as np

from mechlab.clock import spent_on
from mechlab.lab.accuracy.dense import cubic
from mechlab.lab.accuracy.measure import ErrorMeasure, largest
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class EvenRun:
    """q (n, nq), v (n, nv) and tracked quantities (n, names) at n even times t (n,), both ends included."""

    t: Array
    q: Array
    v: Array
    tracked: Array

    @classmethod
    def of(cls, measure: ErrorMeasure, q: Array, v: Array) -> EvenRun:
        """The states of a scene as measured."""
        t = np.linspace(0.0, measure.problem.scene.duration, len(q))
        return cls(t, q, v, measure(t, q, v))

    def at(self, t: Array) -> tuple[Array, Array]:
        """States at other even times (k,): its own where these are some of its times, else (for joints with one rate each) on the cubics
        through coordinates and rates, and on the cubic spline through rates."""
        each, left = divmod(len(self.t) - 1, len(t) - 1)
        if not left:
            return self.q[::each], self.v[::each]
        with spent_on("imports"):
            from scipy.interpolate import CubicSpline
        return cubic(self.t, self.q, self.v, t), np.asarray(CubicSpline(self.t, self.v)(t))

    def apart(self, other: EvenRun, measure: ErrorMeasure) -> float:
        """Largest difference of the tracked quantities [unit] at the times of the run with fewer states."""
        fewer, more = sorted((self, other), key=lambda x: len(x.t))
        each, left = divmod(len(more.t) - 1, len(fewer.t) - 1)
        theirs = measure(fewer.t, *more.at(fewer.t)) if left else more.tracked[::each]
        return largest(theirs - fewer.tracked)
