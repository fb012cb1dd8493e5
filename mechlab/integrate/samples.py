"""Integrals of sampled functions, as scipy's `cumulative_trapezoid` and `cumulative_simpson` compute them, digit by digit: importing those
takes longer than most runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def integral_by_chords(t: Array, y: Array) -> Array:
    """(n,) integral of the samples y (n,) from t[0] to each time of t (n,): trapezoidal rule."""
    return _summed(np.diff(t) * (y[1:] + y[:-1]) / 2.0)


def integral_by_parabolas(t: Array, y: Array) -> Array:
    """(n,) integral of the samples y (n,) from t[0] to each time of t (n,), n > 2: Simpson's rule for uneven steps (Cartwright 2017).

    Raises ValueError for times that do not increase.
    """
    steps = np.diff(t)
    if np.any(steps <= 0.0):
        raise ValueError("the times of samples must increase")
    parts = np.empty(len(steps))
    parts[:-1:2] = _first_of_two(steps, y)[::2]
    later = _first_of_two(steps[::-1], y[::-1])[::-1]
    parts[1::2], parts[-1] = later[::2], later[-1]
    return _summed(parts)


def _first_of_two(steps: Array, y: Array) -> Array:
    """(n - 2,) integrals over the first of two neighbouring steps, of the parabola through their three samples."""
    first, second = steps[:-1], steps[1:]
    share = first / (first + second)
    far = share * (first / second)
    return first / 6 * ((3 - share) * y[:-2] + (3 + far + share) * y[1:-1] + -far * y[2:])


def _summed(parts: Array) -> Array:
    return np.cumsum(np.concatenate([[0.0], parts]))
