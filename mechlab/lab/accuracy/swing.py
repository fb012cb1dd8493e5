"""A motion to and fro, by its phase: what is smooth in x of phi = middle - radius cos x is a series of cosines, and time goes as

t(x) = mean x + sum of times_k sin(k x),

for all x: there is nothing to fold at the turning points. Evenly spaced nodes make the series; doubling them keeps the old ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mechlab.mechanism.geometry import Array


@lru_cache(maxsize=32)
def fitting(n: int) -> Array:
    """(n + 1, n + 1) values at x = pi j / n, j = 0 to n, to coefficients of cos(k x)."""
    k = np.arange(n + 1)
    half = np.where((k == 0) | (k == n), 0.5, 1.0)
    return (2.0 / n) * half[:, None] * half * np.cos(np.pi * np.outer(k, k) / n)


@lru_cache(maxsize=32)
def places(n: int) -> Array:
    """(1, n + 1) nodes from 0 to pi, of one cell."""
    return (np.pi / n) * np.arange(n + 1.0)[None]


@lru_cache(maxsize=32)
def between(n: int) -> Array:
    """(n, n + 1) values at n + 1 nodes to values of their series half-way between them."""
    x = (np.pi / n) * (np.arange(n) + 0.5)
    return np.asarray(np.cos(np.multiply.outer(x, np.arange(n + 1.0))) @ fitting(n))


@lru_cache(maxsize=32)
def numbers(n: int) -> Array:
    """(n + 1,) k."""
    return np.arange(n + 1.0)


@lru_cache(maxsize=32)
def _shares(n: int) -> Array:
    """(n + 1,) 1 / k; 0 for k = 0."""
    return np.concatenate([[0.0], 1.0 / np.arange(1.0, n + 1.0)])


def waves(x: Array, n: int) -> Array:
    """(n + 1, 2 P): cos(k x) and sin(k x) one after the other, for x (P,)."""
    w = np.empty((n + 1, len(x)), dtype=complex)
    w[0] = 1.0
    np.exp(1j * x, out=w[1])
    done = 1
    while done < n:
        more = min(done, n - done)
        np.multiply(w[1 : 1 + more], w[done], out=w[done + 1 : done + 1 + more])
        done += more
    return w.view(float)


@dataclass(frozen=True)
class Beat:
    """t(x) of a swing: slopes (n + 1,) coefficients of dt/dx, mean (of dt/dx), times (n + 1,) as above."""

    slopes: Array
    times: Array
    mean: float

    @staticmethod
    def of(values: Array) -> Beat:
        """From dt/dx (n + 1,) at the nodes."""
        n = len(values) - 1
        slopes = fitting(n) @ values
        return Beat(slopes, slopes * _shares(n), float(slopes[0]))

    @property
    def n(self) -> int:
        """Nodes less one."""
        return len(self.slopes) - 1

    def time(self, x: float) -> float:
        """t(x)."""
        return self.mean * x + float(self.times @ np.sin(x * numbers(self.n)))

    def passed(self, x: Array, w: Array) -> Array:
        """t(x) (P,), w: at least so many waves at x."""
        return np.asarray(self.mean * x + (self.times @ w[: self.n + 1])[1::2])

    def invert(self, t: Array, last_step: float) -> tuple[Array, Array]:
        """x (P,) and its waves at times t (P,); the last step of Halley's method leaves its cube: no more than the square of
        `last_step`."""
        n, period = self.n, 2.0 * np.pi * self.mean
        grid, sines = _fine(n)
        known = self.mean * grid
        known += self.times @ sines
        lap = np.floor(t / period)
        x = np.interp(t - period * lap, known, grid)
        x += 2.0 * np.pi * lap
        rows = np.array([self.times, self.slopes, self.slopes * numbers(n)])
        enough = 0.3 * last_step ** (2.0 / 3.0)
        for _ in range(12):
            found = rows @ waves(x, n)
            g = found[1, ::2]
            missing = (t - found[0, 1::2] - self.mean * x) / g
            # the parabola of t(x), whose slope falls by its third row
            missing += 0.5 * missing * missing * found[2, 1::2] / g
            x += missing
            if max(missing.max(), -missing.min()) < enough:
                break
        return x, waves(x, n)


GRID = 384
"""Places in half a round between which straight lines begin the inversion; they leave 1e-5 of a bend."""


@lru_cache(maxsize=8)
def _fine(n: int) -> tuple[Array, Array]:
    """(2 GRID + 1,) places of a whole round and (n + 1, 2 GRID + 1) sines there."""
    grid = (np.pi / GRID) * np.arange(2.0 * GRID + 1.0)
    return grid, np.sin(np.multiply.outer(numbers(n), grid))
