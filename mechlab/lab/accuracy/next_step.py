"""The steps [s] and tolerances of the runs of one method, from coarse to fine."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mechlab.lab.accuracy.convergence import seen_order
from mechlab.lab.accuracy.rules import RULES, MethodRule

FINE, RATIOS = 1e-4, (1.25, 1.6, 2.0)
"""Errors below FINE [m or rad] are approached by halving the step. Above, the next step is the longest of the last one over these ratios
that is expected to meet the error."""


def first_step(between: float, longest: int, stable: float, fastest: float) -> float:
    """The distance of the outputs [s] times or over a power of 2: at most `longest` times that, and `stable` over the fastest rate
    [1/s]."""
    first = min(between * longest, stable / fastest if stable and fastest > 0.0 else math.inf)
    return between / 2 ** math.ceil(math.log2(between / first) - 1e-9)


def shorter_step(step: float, ratio: float, duration: float, outputs: int) -> float:
    """About `step` over the ratio: it divides the duration into an even number of parts, or the distance of the outputs."""
    count = ratio * duration / step - 1e-6
    return duration / (2 * math.ceil(0.5 * count) if count <= outputs else outputs * math.ceil(count / outputs))


def ratio_enough(changes: Sequence[float], steps: Sequence[float], order: float, target: float) -> float:
    """The least of RATIOS with which the error after the next of at least two runs is expected to be met, told by the first order as
    `error_of_steps` does; 2 where none is enough. order: the highest that is hoped for."""
    order = seen_order(changes, steps, order)
    left = changes[-1] / ((steps[-2] / steps[-1]) ** order - 1.0)
    enough = (r for r in RATIOS if RULES.safety * left * (1.0 - r**-order) / (r - 1.0) <= target)
    return next(enough, RATIOS[-1])


def next_tolerance(rule: MethodRule, target: float, last: Sequence[float]) -> float | None:
    """The tolerance after the last ones; None where it was the sharpest. A method that starts near its target goes on with a quarter,
    which is enough to tell the error of its first run, then with a tenth."""
    factor, power = rule.error_left
    if not factor:
        left = [x for x in RULES.tolerances if not last or x < last[-1]]
        return left[0] if left else None
    start = min(max((target / factor) ** (1.0 / power), 10.0 * RULES.sharpest), RULES.tolerances[0])
    value = (0.1 if len(last) > 1 else 0.25) * last[-1] if last else start
    return value if value > 0.5 * RULES.sharpest else None
