"""What a motion must keep, as bounds of a step: ranges of joints, rates, the distance from singularity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.track.closed import DIFFERENCE, Closed

REGAINED = 0.02
"""A distance from singularity that lacks less is regained: steps along its limit lose the square of their size."""


@dataclass(frozen=True)
class Bound:
    """A limit that can be met: its kind ("range", "rate", "singularity"), the joint, shaft or distance, and its two ends
    (in the unit of the `Closed`)."""

    kind: str
    of: str
    low: float
    high: float


@dataclass(frozen=True)
class Limits:
    """All limits of a motion. ranges and rates by joint or shaft, in the unit of the `Closed`; distances: kind -> least."""

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rates: Mapping[str, float] = field(default_factory=dict)
    distances: Mapping[str, float] = field(default_factory=dict)

    def bounds(self, before: Mapping[str, float], dt: float) -> tuple[Bound, ...]:
        """The bounds of the way from one time to the next, `dt` [s] later; before: values of the joints at the first, none
        where rates do not count yet."""
        out = [Bound("range", name, *ends) for name, ends in self.ranges.items()]
        out += [Bound("rate", n, before[n] - r * dt, before[n] + r * dt) for n, r in self.rates.items() if n in before]
        return (*out, *(Bound("singularity", of, least, np.inf) for of, least in self.distances.items()))


def bound_rows(closed: Closed, basis: Array, bounds: tuple[Bound, ...]) -> tuple[Array, Array, Array]:
    """Rows (c, f) over the free motions `basis`, and lower and upper bounds (c,) of a step from the present pose.

    Where a distance from singularity is far too small already, it shall not fall further.
    """
    rows, now = np.zeros((len(bounds), basis.shape[1])), np.zeros(len(bounds))
    for k, bound in enumerate(bounds):
        if bound.kind == "singularity":
            now[k], rows[k] = _slope(closed, basis, bound.of)
        else:
            now[k], rows[k] = closed.plant.value(bound.of), closed.m.row(bound.of) @ basis
    low, high = np.array([b.low for b in bounds]) - now, np.array([b.high for b in bounds]) - now
    lost = np.array([b.kind == "singularity" for b in bounds], dtype=bool) & (low > REGAINED)
    return rows, np.where(lost, 0.0, low), high


def excess(closed: Closed, bounds: tuple[Bound, ...]) -> tuple[float, Bound | None]:
    """By how much the present pose lies outside its bounds at most, and the bound; 0 and None within all of them."""
    worst: tuple[float, Bound | None] = (0.0, None)
    for bound in bounds:
        now = closed.distance(bound.of) if bound.kind == "singularity" else closed.plant.value(bound.of)
        worst = max(worst, (max(bound.low - now, now - bound.high), bound), key=lambda pair: pair[0])
    return worst


def _slope(closed: Closed, basis: Array, of: str) -> tuple[float, Array]:
    """A distance from singularity and its derivative (f,) along the free motions, by central differences."""
    q = closed.q
    here = closed.distance(of)
    out = np.zeros(basis.shape[1])
    for k in range(basis.shape[1]):
        ends = [closed.set(closed.moved(q, s * DIFFERENCE * basis[:, k])).distance(of) for s in (1.0, -1.0)]
        out[k] = (ends[0] - ends[1]) / (2.0 * DIFFERENCE)
    closed.set(q)
    return here, out
