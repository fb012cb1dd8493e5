"""Searches from many starts: whether the least square that a fit found is the lowest, and whether another one fits as well.

Starts are points of a Halton sequence in the ranges (Halton 1960), of which the ones with the smallest residuals are searched from, beside
the present values. Ends are compared by D = 2 ln(L_best / L), with L the likelihood at the noise that each end itself leaves: the sum over
channels of n ln(mean square residual), or of the squares over a stated noise. An end with D above `CLEAR` is worse; another one with a
smaller D fits as well, and the data cannot tell which is true.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import qmc

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.fit.solve import FitProblem, first_noise, search
from mechlab.studies.fit.unknowns import FitUnknown
from mechlab.tables import counted

SCREENED = 6
"""Points whose residuals are computed, for each start that is searched from."""
WIDE = 3.0
"""Factor to both sides of its present value, in which an unknown without a range is looked for; of one that counts absolutely, scales."""
DECADE = 10.0
"""Range, high over low, from which points lie evenly in the logarithm."""
CLEAR = 9.2
"""D from which an end is worse: less than a hundredth as likely."""
SAME_SERIES, SAME_VALUES = 0.1, 1e-2
"""Ends are one least square where their predictions differ by less than this share of the noise (rms), and their values by less of the
scale."""


@dataclass(frozen=True)
class FitEnd:
    """Where searches ended: values by unknown, how many did, and D = 2 ln(L_best / L)."""

    values: dict[str, float]
    count: int
    behind: float

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"values": self.values, "starts": self.count, "twice_log_likelihood_behind": self.behind}


@dataclass(frozen=True)
class FitStarts:
    """Searches from `count` starts: their ends, the best one first; failed: starts without a motion, and searches without an end."""

    count: int
    ends: tuple[FitEnd, ...]
    failed: int

    def others(self, loose: bool) -> tuple[FitEnd, ...]:
        """Ends that fit as well as the best one. loose: the data do not fix all unknowns, so that ends lie apart anyhow."""
        return () if loose else tuple(e for e in self.ends[1:] if e.behind <= CLEAR)

    @property
    def sentence(self) -> str:
        """How many starts came to the best end, and what the others found."""
        best, worse = self.ends[0].count, [e for e in self.ends[1:] if e.behind > CLEAR]
        text = f"{best} of {counted(self.count, 'start')} came to the values above"
        if worse:
            least = min(e.behind for e in worse)
            text += f", {sum(e.count for e in worse)} to local least squares that are far less likely (2 ln L lower by {least:.3g} or more)"
        if self.failed:
            text += f", {self.failed} to no end"
        if best == 1 and self.count > 2:
            text += "; as only one did, a lower one may have been missed: give more starts or narrower ranges"
        return text

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"count": self.count, "failed": self.failed, "ends": [e.to_dict() for e in self.ends], "sentence": self.sentence}


def from_many(problem: FitProblem, start: Array, count: int) -> tuple[Array, FitStarts]:
    """The unknowns (p,) at the best end of searches from `start` and count - 1 other places, and all ends.

    Raises MechlabError where no start has a motion, and for fewer than one start.
    """
    if count < 1:
        raise MechlabError(f"{problem.base.name}: starts = {count}; expected at least 1.")
    noise, found, failed = first_noise(problem), list[tuple[Array, float]](), 0
    for place in (start, *_screened(problem, count - 1)):
        try:
            x = search(problem, place, noise)[0]
            found.append((x, _behind(problem, x)))
        except MechlabError:
            failed += 1
    if not found:
        raise MechlabError(f"{problem.base.name}: none of {counted(count, 'start')} has a motion: give other ranges or starts.")
    found.sort(key=lambda item: item[1])
    lowest = found[0][1]
    groups: list[list[tuple[Array, float]]] = []
    for item in found:
        home = next((g for g in groups if _same(problem, g[0][0], item[0])), None)
        if home is None:
            groups.append([item])
        else:
            home.append(item)
    names = [u.name for u in problem.unknowns]
    ends = tuple(FitEnd(dict(zip(names, g[0][0].tolist(), strict=True)), len(g), g[0][1] - lowest) for g in groups)
    return found[0][0], FitStarts(count, ends, failed)


def _screened(problem: FitProblem, count: int) -> list[Array]:
    """The `count` of SCREENED times as many points of the ranges that fit best by themselves."""
    if count < 1:
        return []
    points = qmc.Halton(len(problem.unknowns), seed=0).random(SCREENED * count)
    places = np.column_stack([_in_range(u, x) for u, x in zip(problem.unknowns, points.T, strict=True)])
    rated = []
    for place in places:
        try:
            rated.append((_behind(problem, place), place))
        except MechlabError:
            continue
    rated.sort(key=lambda item: item[0])
    return [place for _, place in rated[:count]]


def _in_range(u: FitUnknown, share: Array) -> Array:
    """Values (n,) at shares (n,) of the range from 0 to 1."""
    low, high = u.low, u.high
    if u.relative and u.start > 0.0:
        low, high = max(low, u.start / WIDE) if not np.isfinite(low) else low, high if np.isfinite(high) else u.start * WIDE
    low, high = low if np.isfinite(low) else u.start - WIDE * u.scale, high if np.isfinite(high) else u.start + WIDE * u.scale
    if low > 0.0 and high / low > DECADE:
        return np.asarray(low * (high / low) ** share)
    return np.asarray(low + (high - low) * share)


def _behind(problem: FitProblem, x: Array) -> float:
    """-2 ln L of the residuals at x, but for a constant."""
    out = 0.0
    for name, r in problem.residuals(x).items():
        if name in problem.stated:
            out += float(np.sum(r**2)) / problem.stated[name] ** 2
        else:
            floor = 1e-12 * (float(np.nanstd(problem.measured[name])) or 1.0)
            out += len(r) * float(np.log(np.mean(r**2) + floor**2))
    return out


def _same(problem: FitProblem, a: Array, b: Array) -> bool:
    """Whether two ends are one: the same series and the same values."""
    if np.any(np.abs(a - b) > SAME_VALUES * problem.scales):
        return False
    one, two = problem.residuals(a), problem.residuals(b)
    sizes = {n: problem.stated.get(n) or float(np.sqrt(np.mean(r**2))) for n, r in one.items()}
    return all(float(np.sqrt(np.mean((one[n] - two[n]) ** 2))) <= SAME_SERIES * (sizes[n] or 1.0) for n in one)


def ambiguity(ends: Sequence[FitEnd]) -> str:
    """The sentence on ends that fit as well as the best one."""
    sets = "; ".join(", ".join(f"{n} = {x:.6g}" for n, x in e.values.items()) for e in ends)
    return f"other values fit as well, and the data cannot tell which are true ({sets}): narrow a range, or measure something else"
