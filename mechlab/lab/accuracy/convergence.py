"""The error of the last of several runs of one method, from how the tracked quantities change from run to run.

Where the changes fall with the power p of the step, the error of the last is change / (2^p - 1) (Richardson); p is the observed power,
but at most the theoretical order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from mechlab.lab.accuracy.measure import change
from mechlab.lab.accuracy.rules import RULES
from mechlab.mechanism.geometry import Array

TOO_FAST = 2.0
"""A change that falls this many times faster than in theory does so by chance: then it is the estimate itself."""
LONG_STEPS = 1.5
"""Two runs with steps longer than the distance of the outputs may agree by chance: their change counts so many times."""
KINK_RATIO = 16.0
"""With kinks in the motion the error is estimated as at least the change before the last over this ratio."""


def seen_order(tracked: Sequence[Array], hoped: float) -> float:
    """The order that the last three runs show, at most the hoped one, which counts before there are three."""
    if len(tracked) < 3:
        return hoped
    last, before = change(tracked[-1], tracked[-2]), change(tracked[-2], tracked[-3])
    return min(hoped, math.log2(before / last)) if 0.0 < last < before else 0.5


def error_of_tolerances(tracked: Sequence[Array], enough: int) -> float:
    """Error of the last of runs with a tenth of the tolerance each; infinite before there are `enough`."""
    # the change is the error of the coarser run; one that started far above the target may agree by chance
    return change(tracked[-1], tracked[-2]) if len(tracked) >= max(enough, 2) else math.inf


def error_of_steps(tracked: Sequence[Array], order: float, extrapolated: bool, kinks: bool, long: bool) -> float:
    """Error of the last of runs with half the step each; infinite before it can be told. order: largest power of the step with which
    the errors are taken to fall; long: the steps of the last run are longer than the distance of the outputs."""
    if len(tracked) < 2:
        return math.inf
    last = change(tracked[-1], tracked[-2])
    if len(tracked) < RULES.runs:
        # two runs of a method that does not extrapolate: the change itself, not a share of it; more with long steps
        return math.inf if extrapolated or kinks else LONG_STEPS * last if long else last
    before = change(tracked[-2], tracked[-3])
    if kinks:
        # which step a kink falls into is chance: two runs may agree by luck, and none is better than the change
        return max(last, before / KINK_RATIO)
    ratio, theory = before / last if last > 0.0 else math.inf, 2.0**order
    if ratio > TOO_FAST * theory and not extrapolated:
        return last
    # the observed ratio, never better than theory promises; without a falling error the change itself counts
    ratio = min(ratio, theory)
    return last / (ratio - 1.0) if ratio > 1.5 else 2.0 * max(last, before)
