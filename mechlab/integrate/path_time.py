"""The time t(x) along a path from its slope dt/dx at nodes, and the inverse x(t).

`PathTime`: t(x) = integral of dt/dx from the start, by Chebyshev polynomials in cells of equal width. dt/dx must be smooth and
positive. `SwingTime`: a motion between two turning points, phi = middle - radius cos x. Then dt/dx is a series of cosines, and

    t(x) = mean x + sum over k of times_k sin(k x)

holds for all x, also across the turning points. Twice as many nodes contain the coarser ones in both.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mechlab.integrate.adaptive import Array
from mechlab.lazy_dataclass import dataclass


@lru_cache(maxsize=16)
def chebyshev_nodes(n: int) -> Array:
    """(n + 1,) Chebyshev-Lobatto nodes from -1 to 1."""
    return -np.cos(np.pi * np.arange(n + 1) / n)


@lru_cache(maxsize=16)
def chebyshev_fit(n: int) -> Array:
    """(n + 1, n + 1) matrix from values at the nodes to coefficients of Chebyshev polynomials."""
    k = np.arange(n + 1)
    half = np.where((k == 0) | (k == n), 0.5, 1.0)
    return (2.0 / n) * half[:, None] * half * np.cos(np.pi * np.outer(k, n - k) / n)


@lru_cache(maxsize=16)
def chebyshev_integral(n: int) -> Array:
    """(n + 2, n + 1) matrix from the coefficients of f to those of its integral from -1."""
    # 2 T_k = T_k+1' / (k + 1) - T_k-1' / (k - 1)
    out, k = np.zeros((n + 2, n + 1)), np.arange(n + 1)
    out[k[1:] + 1, k[1:]] = 0.5 / (k[1:] + 1)
    out[k[2:] - 1, k[2:]] = -0.5 / (k[2:] - 1)
    out[1, 0] = 1.0
    out[0] = -((-1.0) ** np.arange(1, n + 2) @ out[1:])
    return out


@lru_cache(maxsize=16)
def chebyshev_derivative(n: int) -> Array:
    """(n + 1, n + 1) matrix from the coefficients of f to those of df/dxi."""
    # T_k' = 2 k (T_k-1 + T_k-3 + ...), of T_0 the half
    k = np.arange(n + 1)
    out = np.where((k > k[:, None]) & ((k - k[:, None]) % 2 == 1), 2.0 * k, 0.0)
    out[0] *= 0.5
    return out


def chebyshev_basis(xi: Array, n: int) -> Array:
    """(P, n + 1) Chebyshev polynomials at xi (P,)."""
    return np.cos(np.multiply.outer(np.arccos(np.minimum(np.maximum(xi, -1.0), 1.0)), _orders(n + 1)))


@lru_cache(maxsize=16)
def _orders(n: int) -> Array:
    return np.arange(float(n))


@dataclass(frozen=True)
class PathTime:
    """t(x) on [low, high] in cells of equal width: Chebyshev coefficients, slopes (cells, n + 1) of dt/dx and times (cells, n + 2) of t
    from the start of the cell; starts (cells + 1,): t at the ends of the cells."""

    low: float
    width: float
    slopes: Array
    times: Array
    starts: Array

    @staticmethod
    def of(low: float, high: float, values: Array) -> PathTime:
        """From dt/dx (cells, n + 1) at the nodes of the cells of [low, high]."""
        cells, n = values.shape[0], values.shape[1] - 1
        width = (high - low) / cells
        slopes = values @ chebyshev_fit(n).T
        times = 0.5 * width * (slopes @ chebyshev_integral(n).T)
        ends = np.concatenate([[0.0], np.cumsum(np.sum(times, axis=1))])
        return PathTime(low, width, slopes, times, ends)

    @property
    def total(self) -> float:
        """Time from one end to the other."""
        return float(self.starts[-1])

    def time(self, x: float) -> float:
        """t(x)."""
        cell = int(np.clip((x - self.low) / self.width, 0, len(self.times) - 1))
        xi = np.array([2.0 * (x - self.low - cell * self.width) / self.width - 1.0])
        return float(self.starts[cell] + chebyshev_basis(xi, self.times.shape[1] - 1)[0] @ self.times[cell])

    def invert(self, t: Array, last_step: float = 1e-7) -> tuple[NDArray[np.intp], Array, Array]:
        """Cell (P,), local place xi (P,) and its basis (P, n + 2) at times t (P,) of [0, total].

        Newton's method ends after a step below `last_step`, which leaves an error of its square.
        """
        cells, n = len(self.times), self.slopes.shape[1] - 1
        at = _basis_at_nodes(n)
        # start: the cubic through times and slopes at the nodes; from there two steps of Newton give all digits
        known = (self.times @ at.T + self.starts[:-1, None]).ravel()
        k = np.minimum(np.maximum(np.searchsorted(known, t, side="right") - 1, 0), len(known) - 2)
        k -= k % (n + 1) == n
        rate = 1.0 / (0.5 * self.width * (self.slopes @ at[:, : n + 1].T).ravel())
        places = chebyshev_nodes(n)
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
            b = chebyshev_basis(xi, n + 1)
            step = ((b * times).sum(axis=1) - into) / (b[:, : n + 1] * slopes).sum(axis=1)
            xi = np.minimum(np.maximum(xi - step, -1.0), 1.0)
            if max(step.max(), -step.min()) < last_step:
                break
        return cell, xi, chebyshev_basis(xi, n + 1)


@lru_cache(maxsize=16)
def _basis_at_nodes(n: int) -> Array:
    """(n + 1, n + 2) Chebyshev polynomials at the nodes."""
    return chebyshev_basis(chebyshev_nodes(n), n + 1)


@lru_cache(maxsize=32)
def cosine_fit(n: int) -> Array:
    """(n + 1, n + 1) matrix from values at x = pi j / n, j = 0 to n, to coefficients of cos(k x)."""
    k = np.arange(n + 1)
    half = np.where((k == 0) | (k == n), 0.5, 1.0)
    return (2.0 / n) * half[:, None] * half * np.cos(np.pi * np.outer(k, k) / n)


@lru_cache(maxsize=32)
def cosine_nodes(n: int) -> Array:
    """(1, n + 1) nodes from 0 to pi, of one cell."""
    return (np.pi / n) * np.arange(n + 1.0)[None]


@lru_cache(maxsize=32)
def cosine_midpoints(n: int) -> Array:
    """(n, n + 1) matrix from values at n + 1 nodes to those of their series half-way between the nodes."""
    x = (np.pi / n) * (np.arange(n) + 0.5)
    return np.asarray(np.cos(np.multiply.outer(x, np.arange(n + 1.0))) @ cosine_fit(n))


@lru_cache(maxsize=32)
def wave_numbers(n: int) -> Array:
    """(n + 1,) numbers k of the waves, from 0."""
    return np.arange(n + 1.0)


@lru_cache(maxsize=32)
def _inverse_wave_numbers(n: int) -> Array:
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
class SwingTime:
    """t(x) of a swing: cosine coefficients slopes (n + 1,) of dt/dx, its mean, and sine coefficients times (n + 1,) of t."""

    slopes: Array
    times: Array
    mean: float

    @staticmethod
    def of(values: Array) -> SwingTime:
        """From dt/dx (n + 1,) at the nodes."""
        n = len(values) - 1
        slopes = cosine_fit(n) @ values
        return SwingTime(slopes, slopes * _inverse_wave_numbers(n), float(slopes[0]))

    @property
    def n(self) -> int:
        """Number of nodes, less one."""
        return len(self.slopes) - 1

    def time(self, x: float) -> float:
        """t(x)."""
        return self.mean * x + float(self.times @ np.sin(x * wave_numbers(self.n)))

    def passed(self, x: Array, w: Array) -> Array:
        """t(x) (P,); w: at least n + 1 waves at x (P,), as of `waves`."""
        return np.asarray(self.mean * x + (self.times @ w[: self.n + 1])[1::2])

    def invert(self, t: Array, last_step: float) -> tuple[Array, Array]:
        """x (P,) and its waves at times t (P,), by Halley's method, whose last step leaves an error of its cube; that is at most the
        square of `last_step`."""
        n, period = self.n, 2.0 * np.pi * self.mean
        grid, sines = _start_grid(n)
        known = self.mean * grid
        known += self.times @ sines
        lap = np.floor(t / period)
        x = np.interp(t - period * lap, known, grid)
        x += 2.0 * np.pi * lap
        rows = np.array([self.times, self.slopes, self.slopes * wave_numbers(n)])
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


START_GRID = 384
"""The inversion starts by straight lines between this many places in half a round; they leave an error of 1e-5 of the curvature."""


@lru_cache(maxsize=8)
def _start_grid(n: int) -> tuple[Array, Array]:
    """(2 GRID + 1,) places of a whole round and (n + 1, 2 GRID + 1) sines there."""
    grid = (np.pi / START_GRID) * np.arange(2.0 * START_GRID + 1.0)
    return grid, np.sin(np.multiply.outer(wave_numbers(n), grid))
