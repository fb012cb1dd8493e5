"""The error of the last of several runs of one method, from how the tracked quantities change from run to run.

Where errors fall with the power p of the step h, the runs with h0 > h1 > h2 change by c1 ~ h0^p - h1^p and c2 ~ h1^p - h2^p, and the
error of the last is c2 / ((h1 / h2)^p - 1) (Richardson); p is the observed power, but at most the theoretical order.
"""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.analytic.roots import brentq
from mechlab.lab.accuracy.rules import RULES

TOO_FAST = 2.0
"""A change that falls this many times faster than in theory does so by chance: it counts as if it fell so fast, and no order but the first
is relied on."""
LONG_STEPS = 1.5
"""Two runs with steps longer than the distance of the outputs may agree by chance: their change counts so many times."""
KINK_RATIO = 16.0
"""With kinks in the motion the error is estimated as at least the change before the last over this ratio."""
LOWEST, HIGHEST = 0.05, 20.0
SLOW = 0.585
"""Orders that are told apart, and the one (of halved steps whose changes fall by 1.5) below which errors do not fall."""


def seen_order(changes: Sequence[float], steps: Sequence[float], hoped: float) -> float:
    """The order that the last three runs show, at least 1/2 and at most the hoped one, which counts before there are three."""
    if len(changes) < 2 or changes[-1] == 0.0:
        return hoped
    return min(hoped, max(0.5, _order(changes[-2] / changes[-1], *steps[-3:])))


def _falls(p: float, *steps: float) -> float:
    """Ratio of two changes of three runs whose errors fall with the power p."""
    first, second, third = steps
    return ((first / second) ** p - 1.0) / (1.0 - (third / second) ** p)


def _order(ratio: float, *steps: float) -> float:
    """The order under which two changes of three runs are in this ratio, between LOWEST and HIGHEST."""
    low, high = (_falls(p, *steps) for p in (LOWEST, HIGHEST))
    if not low < ratio < high:
        return LOWEST if ratio <= low else HIGHEST
    return brentq(lambda p: _falls(p, *steps) - ratio, LOWEST, HIGHEST, xtol=1e-6)


def error_of_tolerances(changes: Sequence[float], enough: int) -> float:
    """Error of the last of runs with a smaller tolerance each; infinite before there are `enough`."""
    # the change is the error of the coarser run; one that started far above the target may agree by chance
    return changes[-1] if len(changes) + 1 >= max(enough, 2) else float("inf")


def error_of_steps(
    changes: Sequence[float], steps: Sequence[float], orders: tuple[float, float], extrapolated: bool, kinks: bool, long: bool
) -> float:
    """Error of the last of runs with ever shorter steps; infinite before it can be told. orders: the largest power of the step with which
    the errors are taken to fall, and the one expected; long: the steps of the last run are longer than the distance of the outputs."""
    if not changes:
        return float("inf")
    last = changes[-1]
    sure = last / (steps[-2] / steps[-1] - 1.0)
    if len(changes) + 1 < RULES.runs:
        # two runs of a method that does not extrapolate: by the first order; more with long steps
        return float("inf") if extrapolated or kinks else LONG_STEPS * sure if long else sure
    before = changes[-2]
    if kinks:
        # which step a kink falls into is chance: two runs may agree by luck, and none is better than the change
        return max(sure, before / KINK_RATIO)
    least = before / (TOO_FAST * _falls(orders[1], *steps[-3:]))
    if last <= least and not extrapolated:
        return least / (steps[-2] / steps[-1] - 1.0)
    if last == 0.0:
        return sure
    # the observed order, never better than theory promises; without a falling error the change itself counts
    p = min(_order(before / last, *steps[-3:]), orders[0])
    return last / ((steps[-2] / steps[-1]) ** p - 1.0) if p > SLOW else 2.0 * max(sure, before / (steps[-3] / steps[-2] - 1.0))
