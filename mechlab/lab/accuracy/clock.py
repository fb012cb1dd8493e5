"""The time that passes along a path, and its inverse: t(x) = integral of g from 0 to x, by Chebyshev polynomials in cells.

g must be smooth and positive. Refining doubles the nodes of every cell; the coarser set is part of the finer one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism.geometry import Array


@lru_cache(maxsize=16)
def nodes(n: int) -> Array:
    """(n + 1,) Chebyshev-Lobatto nodes from -1 to 1."""
    return -np.cos(np.pi * np.arange(n + 1) / n)


@lru_cache(maxsize=16)
def fitting(n: int) -> Array:
    """(n + 1, n + 1) values at the nodes to coefficients of Chebyshev polynomials."""
    k = np.arange(n + 1)
    half = np.where((k == 0) | (k == n), 0.5, 1.0)
    return (2.0 / n) * half[:, None] * half * np.cos(np.pi * np.outer(k, n - k) / n)


@lru_cache(maxsize=16)
def integrating(n: int) -> Array:
    """(n + 2, n + 1) coefficients of f to those of its integral from -1."""
    out = np.zeros((n + 2, n + 1))
    for k in range(n + 1):
        out[:, k] = np.pad(np.polynomial.chebyshev.chebint(np.eye(n + 1)[k], lbnd=-1), (0, n + 2))[: n + 2]
    return out


@lru_cache(maxsize=16)
def deriving(n: int) -> Array:
    """(n + 1, n + 1) coefficients of f to those of df/dxi."""
    out = np.zeros((n + 1, n + 1))
    for k in range(1, n + 1):
        found = np.polynomial.chebyshev.chebder(np.eye(n + 1)[k])
        out[: len(found), k] = found
    return out


def basis(xi: Array, n: int) -> Array:
    """(P, n + 1) Chebyshev polynomials at xi (P,)."""
    return np.cos(np.multiply.outer(np.arccos(np.minimum(np.maximum(xi, -1.0), 1.0)), _numbers(n + 1)))


@lru_cache(maxsize=16)
def _numbers(n: int) -> Array:
    return np.arange(float(n))


@dataclass(frozen=True)
class Clock:
    """t(x) on [low, high] in equal cells: slopes (cells, n + 1) coefficients of g, times (cells, n + 2) of t from 0."""

    low: float
    width: float
    slopes: Array
    times: Array
    starts: Array

    @staticmethod
    def of(low: float, high: float, values: Array) -> Clock:
        """From g (cells, n + 1) at the nodes of the cells of [low, high]."""
        cells, n = values.shape[0], values.shape[1] - 1
        width = (high - low) / cells
        slopes = values @ fitting(n).T
        times = 0.5 * width * (slopes @ integrating(n).T)
        ends = np.concatenate([[0.0], np.cumsum(np.sum(times, axis=1))])
        return Clock(low, width, slopes, times, ends)

    @property
    def total(self) -> float:
        """Time from one end to the other."""
        return float(self.starts[-1])

    def time(self, x: float) -> float:
        """t(x)."""
        cell = int(np.clip((x - self.low) / self.width, 0, len(self.times) - 1))
        xi = np.array([2.0 * (x - self.low - cell * self.width) / self.width - 1.0])
        return float(self.starts[cell] + basis(xi, self.times.shape[1] - 1)[0] @ self.times[cell])

    def invert(self, t: Array, last_step: float = 1e-7) -> tuple[NDArray[np.intp], Array, Array]:
        """Cell (P,), local place xi (P,) and its basis (P, n + 2) at times t (P,) of [0, total]; what is left after Newton's
        `last_step` is its square."""
        cells, n = len(self.times), self.slopes.shape[1] - 1
        at = _at_nodes(n)
        # cubic through the times and slopes at the nodes, then Newton: two steps for what half of the digits were right in
        known = (self.times @ at.T + self.starts[:-1, None]).ravel()
        k = np.minimum(np.maximum(np.searchsorted(known, t, side="right") - 1, 0), len(known) - 2)
        k -= k % (n + 1) == n
        rate = 1.0 / (0.5 * self.width * (self.slopes @ at[:, : n + 1].T).ravel())
        places = nodes(n)
        cell, i = np.divmod(k, n + 1)
        h = known[k + 1] - known[k]
        s = (t - known[k]) / h
        r = 1.0 - s
        xi = r * r * ((1.0 + 2.0 * s) * places[i] + s * h * rate[k])
        xi += s * s * ((3.0 - 2.0 * s) * places[i + 1] - r * h * rate[k + 1])
        into = t - self.starts[cell]
        times, slopes = self.times[cell], 0.5 * self.width * self.slopes[cell]
        if cells == 1:
            times, slopes = self.times[0], 0.5 * self.width * self.slopes[0]
        for _ in range(12):
            b = basis(xi, n + 1)
            step = ((b * times).sum(axis=1) - into) / (b[:, : n + 1] * slopes).sum(axis=1)
            xi = np.minimum(np.maximum(xi - step, -1.0), 1.0)
            if max(step.max(), -step.min()) < last_step:
                break
        return cell, xi, basis(xi, n + 1)


@lru_cache(maxsize=16)
def _at_nodes(n: int) -> Array:
    """(n + 1, n + 2) Chebyshev polynomials at the nodes."""
    return basis(nodes(n), n + 1)
