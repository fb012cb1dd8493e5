"""Many prescribed motions as linear forms of one vector of functions of time, for repeated evaluation:

    phi(t) = (1, t, sin(w_1 t + p_1), ..., cos(w_1 t + p_1), ..., values, rates and accelerations of other motions)

Holds, ramps and sines need no call of their own, splines over the same times are evaluated together.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mechlab.experiment.motion import AtRate, Hold, PrescribedMotion, Ramp, Sine, Spline
from mechlab.mechanism.geometry import Array

Gains = tuple[float, float, float]
"""Factors of value, rate and acceleration of a motion."""


class TimeBasis:
    """phi (size,) of the motions given; `values(t, out)` writes it, `row(motion, gains)` is the form of one of the motions."""

    def __init__(self, motions: Sequence[PrescribedMotion]) -> None:
        inner = [_inner(m) for m in motions]
        waves = dict.fromkeys((m.frequency, m.phase) for m in inner if type(m) is Sine)
        self._waves = {wave: k for k, wave in enumerate(waves)}
        count = len(waves)
        # one by one: up to ten waves cost less than the calls of numpy for all
        self._called = [(2 + k, 2 + count + k, *wave) for k, wave in enumerate(waves)]
        self._sine, self._cosine = slice(2, 2 + count), slice(2 + count, 2 + 2 * count)
        at = 2 + 2 * count
        self._others: list[tuple[slice, Callable[[float], Any]]] = []
        self._place: dict[int, tuple[int, int]] = {}
        self._known = inner  # keeps the ids of `_place` alive
        tables: dict[tuple[float, ...], list[Spline]] = {}
        for m in inner:
            if id(m) in self._place or type(m) in (Hold, Ramp, Sine):  # a class derived of one has its own `at`
                continue
            if type(m) is Spline:
                tables.setdefault(m.times, []).append(m)
            else:
                self._others.append((slice(at, at + 3), m.at))
                self._place[id(m)] = at, 1
                at += 3
        for splines in tables.values():
            group = _SplineTable(splines)
            step = len(splines)
            self._others.append((slice(at, at + 3 * step), group))
            for k, m in enumerate(splines):
                self._place[id(m)] = at + k, step
            at += 3 * step
        self.size = at

    def values(self, t: float, out: Array) -> None:
        """Write phi(t) into out (size,)."""
        out[0], out[1] = 1.0, t
        for sine, cosine, frequency, phase in self._called:
            angle = frequency * t + phase
            out[sine], out[cosine] = math.sin(angle), math.cos(angle)
        for where, function in self._others:
            out[where] = function(t)

    def many(self, t: Array) -> Array:
        """(P, size) phi at the times t (P,)."""
        out = np.empty((len(t), self.size))
        out[:, 0], out[:, 1] = 1.0, t
        for sine, cosine, frequency, phase in self._called:
            angle = frequency * t + phase
            out[:, sine], out[:, cosine] = np.sin(angle), np.cos(angle)
        for where, function in self._others:
            out[:, where] = [function(x) for x in t.tolist()]
        return out

    def row(self, motion: PrescribedMotion, gains: Gains) -> Array:
        """(size,) r with r @ phi(t) = gains @ (value, rate, acceleration) of one of the motions at t."""
        if type(motion) is AtRate:
            return self.row(motion.rates, (gains[1], gains[2], 0.0))
        out = np.zeros(self.size)
        if id(motion) in self._place:
            at, step = self._place[id(motion)]
            out[at], out[at + step], out[at + 2 * step] = gains
            return out
        match motion:
            case Hold():
                out[0] = gains[0] * motion.value
            case Ramp():
                out[0] = gains[0] * motion.value + gains[1] * motion.rate
                out[1] = gains[0] * motion.rate
            case Sine():
                k, w = self._waves[motion.frequency, motion.phase], motion.frequency
                out[0] = gains[0] * motion.offset
                out[self._sine][k] = motion.amplitude * (gains[0] - gains[2] * w * w)
                out[self._cosine][k] = gains[1] * motion.amplitude * w
        return out


def _inner(motion: PrescribedMotion) -> PrescribedMotion:
    return _inner(motion.rates) if type(motion) is AtRate else motion


class _SplineTable:
    """Splines over the same times as one: values, then rates, then accelerations of all."""

    def __init__(self, splines: Sequence[Spline]) -> None:
        from scipy.interpolate import PPoly

        self._breaks: list[float] = []
        parts = []
        for s in splines:
            made = PPoly.from_spline(s.curve)
            self._breaks = made.x.tolist()
            parts.append(made.c[::-1])
        # (intervals, degree + 1, splines) coefficients of powers of the time since the break
        self._coefficients = np.ascontiguousarray(np.stack(parts, axis=-1).transpose(1, 0, 2))
        degree = self._coefficients.shape[1] - 1
        self._first, self._last = splines[0].times[0], splines[0].times[-1]
        self._powers = range(degree + 1)
        self._degree = degree
        ends = self._breaks[degree : len(self._breaks) - degree]
        self._inner, self._skip = ends[1:-1], degree

    def __call__(self, t: float) -> Array:
        inside = min(max(t, self._first), self._last)
        k = bisect_right(self._inner, inside) + self._skip
        x = inside - self._breaks[k]
        powers = [x**n for n in self._powers]
        rows = (
            powers,
            [n * powers[n - 1] if n else 0.0 for n in self._powers],
            [n * (n - 1) * powers[n - 2] if n > 1 else 0.0 for n in self._powers],
        )
        out = np.array(rows).dot(self._coefficients[k])
        if inside != t:
            out[1:] = 0.0
        return out.ravel()
