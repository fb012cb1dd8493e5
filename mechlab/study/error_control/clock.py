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
    return np.cos(np.arccos(np.clip(xi, -1.0, 1.0))[:, None] * np.arange(n + 1))


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

    def invert(self, t: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Cell (P,), local place xi (P,) and its basis (P, n + 2) at times t (P,) of [0, total]."""
        cell = np.clip(np.searchsorted(self.starts, t, side="right") - 1, 0, len(self.times) - 1).astype(np.intp)
        into = t - self.starts[cell]
        n = self.slopes.shape[1] - 1
        times, slopes = self.times[cell], 0.5 * self.width * self.slopes[cell]
        coarse = basis(nodes(n), n + 1) @ self.times.T
        xi = np.empty(len(t))
        for k in range(len(self.times)):
            mine = cell == k
            if mine.any():
                xi[mine] = np.interp(into[mine], coarse[:, k], nodes(n))
        for _ in range(12):
            b = basis(xi, n + 1)
            step = (np.sum(b * times, axis=1) - into) / np.sum(b[:, : n + 1] * slopes, axis=1)
            xi = np.clip(xi - step, -1.0, 1.0)
            if np.max(np.abs(step)) < 1e-9:
                break
        return cell, xi, basis(xi, n + 1)
