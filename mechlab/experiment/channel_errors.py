"""The error of every channel of a run, from a second run of the same scene: the largest difference at the times of both.

    error = factor max_t |x(t) - y(t)|,      plus a few units in the last place of the largest value

with x the run that is kept and y a coarser or other one. The factor is the caller's: 1 where y is the cruder and nothing is known
of how fast runs converge, 1 / (2^p - 1) for a step twice as large with a method of order p.
"""

from __future__ import annotations

import math

import numpy as np

from mechlab.experiment.recording import Recording

SAME_TIME = 1e-9
"""Share of the duration by which two recorded times may differ and be one."""
UNITS = 16.0 * 2.2e-16
"""Of the largest value of a channel: what rounding leaves in it at least."""


def differences(fine: Recording, coarse: Recording, factor: float) -> dict[str, float]:
    """Channel of `fine` -> `factor` times its largest difference from `coarse` at the times that both recorded, in its unit.

    Infinite for a channel that `coarse` has not, where a value of one is not finite and of the other is, and for all where
    `coarse` does not reach the end of `fine` or shares fewer than two of its times. Angles are compared with their turns.
    """
    mine, other = shared_times(fine, coarse)
    reaches = len(mine) > 1 and mine[-1] == len(fine.t) - 1 or len(fine.t) == 1 == len(mine)
    out = {}
    for name, values in fine.channels.items():
        if not reaches or name not in coarse.channels:
            out[name] = math.inf
            continue
        a, b = np.asarray(values, dtype=float), np.asarray(coarse.channels[name], dtype=float)[other]
        out[name] = largest_difference(a[mine], b, factor) + UNITS * _size(a)
    return out


def shared_times(a: Recording, b: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the samples of `a`, and of `b`, at the times that both recorded."""
    near = np.clip(np.searchsorted(b.t, a.t), 1, max(len(b.t) - 1, 1)) if len(b.t) > 1 else np.zeros(len(a.t), int)
    if len(b.t) > 1:
        near -= np.abs(b.t[near - 1] - a.t) < np.abs(b.t[near] - a.t)
    span = max(float(a.t[-1] - a.t[0]), 1e-12)
    mine = np.flatnonzero(np.abs(b.t[near] - a.t) <= SAME_TIME * span)
    return mine, near[mine]


def largest_difference(a: np.ndarray, b: np.ndarray, factor: float = 1.0) -> float:
    """factor max |a - b|; values that are not finite count as equal where both are the same, else as infinitely far apart."""
    with np.errstate(invalid="ignore"):
        gaps = np.abs(a - b)
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    gaps = np.where(same, 0.0, np.where(np.isfinite(gaps), gaps, math.inf))
    return float(factor * np.max(gaps, initial=0.0))


def _size(values: np.ndarray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(np.max(finite, initial=0.0))
