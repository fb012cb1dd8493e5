"""All solutions of n + n bilinear equations by continuation, with the number of paths as the proof that none is missed.

    U_k(x) V_k(y) + R_k(x) S_k(y) = c_k x_0 y_0,   k = 1 .. 2 n,   x, y in P^n,   U_k, V_k, R_k, S_k linear

has at most binomial(2 n, n) isolated solutions (multihomogeneous Bezout number of bidegree (1, 1)). The start system
l_k(x) m_k(y) = 0 with random l, m has exactly so many: n of the l vanish, and the other n of the m. Along
(1 - t) gamma l_k m_k + t (U_k V_k + R_k S_k - c_k x_0 y_0) = 0 with a random complex gamma each isolated solution at t = 1 is the end of a
path, with probability one (Morgan & Sommese 1987; Sommese & Wampler 2005). Random affine patches of both spaces keep ends at infinity
finite.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import combinations
from math import comb

import numpy as np

from mechlab.analytic.assur.plane import Complex
from mechlab.lazy_dataclass import dataclass

LONGEST, SHORTEST, STEPS = 0.1, 1e-9, 3000
ACCURATE = 1e-9
"""Last change of Newton's method along a path."""
AT_INFINITY = 1e-7
"""|x_0| or |y_0| of an end at infinity, its patch scaled to 1."""
_SEED = 2009


@dataclass(frozen=True)
class Paths:
    """Ends of all paths: x, y (..., paths, n) affine, where `finite` (..., paths); `lost` (...): paths that reached no end."""

    x: Complex
    y: Complex
    finite: np.ndarray
    lost: np.ndarray


@dataclass(frozen=True)
class Bilinear:
    """Coefficients (..., 2 n, n + 1) of U_k, V_k, those of x_0 and y_0 first; r, s: of R_k, S_k, or None where there are none; c (2 n,)."""

    u: Complex
    v: Complex
    r: Complex | None = None
    s: Complex | None = None
    c: np.ndarray | float = 1.0

    def paths(self, count: int) -> Bilinear:
        """The equations of each path, `count` at each position, with one leading axis."""
        return self._each(lambda a: np.repeat(a.reshape(-1, *a.shape[-2:]), count, axis=0))

    def of(self, rows: np.ndarray) -> Bilinear:
        """The equations of some paths."""
        return self._each(lambda a: a[rows])

    def _each(self, change: Callable[[Complex], Complex]) -> Bilinear:
        r, s = (None if a is None else change(a) for a in (self.r, self.s))
        return Bilinear(change(self.u), change(self.v), r, s, self.c)


@dataclass(frozen=True)
class _Start:
    l: Complex
    m: Complex
    gamma: complex
    patch: Complex
    points: Complex


@lru_cache(maxsize=8)
def _start(n: int) -> _Start:
    """Start system and its binomial(2 n, n) solutions (paths, 2 n + 2) on the patches (2, n + 1)."""
    rng = np.random.default_rng(_SEED + n)

    def random(*shape: int) -> Complex:
        return np.asarray(np.exp(2j * np.pi * rng.random(shape)) * rng.uniform(0.5, 1.5, shape))

    l, m, patch = random(2 * n, n + 1), random(2 * n, n + 1), random(2, n + 1)
    points = []
    one = np.zeros(n + 1, dtype=complex)
    one[-1] = 1.0
    for first in combinations(range(2 * n), n):
        second = [k for k in range(2 * n) if k not in first]
        x = np.linalg.solve(np.vstack([l[list(first)], patch[0]]), one)
        y = np.linalg.solve(np.vstack([m[second], patch[1]]), one)
        points.append(np.concatenate([x, y]))
    return _Start(l, m, complex(np.exp(2j * np.pi * rng.random())), patch, np.array(points))


def path_count(n: int) -> int:
    """binomial(2 n, n), the largest number of isolated solutions."""
    return comb(2 * n, n)


def all_solutions(equations: Bilinear) -> Paths:
    """Ends of all paths for the equations at each position."""
    shape, n = equations.u.shape[:-2], equations.u.shape[-1] - 1
    s = _start(n)
    count = len(s.points)
    each = equations.paths(count)
    z = np.tile(s.points, (len(each.u) // count, 1))
    z, arrived = _track(s, each, z)
    x, y = z[:, : n + 1], z[:, n + 1 :]
    scale = np.abs(x[:, 0] / np.abs(x).max(axis=1)), np.abs(y[:, 0] / np.abs(y).max(axis=1))
    finite = arrived & (scale[0] > AT_INFINITY) & (scale[1] > AT_INFINITY)
    safe = np.where(finite, 1.0, np.nan)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        ends = [(a[:, 1:] / a[:, :1] * safe).reshape(*shape, count, n) for a in (x, y)]
    lost = np.count_nonzero(~arrived.reshape(*shape, count), axis=-1)
    return Paths(ends[0], ends[1], finite.reshape(*shape, count), np.asarray(lost))


def _system(s: _Start, e: Bilinear, z: Complex, t: np.ndarray) -> tuple[Complex, Complex, Complex]:
    """Values (p, 2 n + 2), Jacobian, and derivative by t, at points z (p, 2 n + 2)."""
    half = z.shape[1] // 2
    x, y = z[:, :half], z[:, half:]
    l, m = x @ s.l.T, y @ s.m.T
    fu, fv = np.einsum("pki,pi->pk", e.u, x), np.einsum("pki,pi->pk", e.v, y)
    begin, end = (1.0 - t)[:, None] * s.gamma, t[:, None]
    f = fu * fv - e.c * (x[:, 0] * y[:, 0])[:, None]
    if e.r is not None and e.s is not None:
        fr, fs = np.einsum("pki,pi->pk", e.r, x), np.einsum("pki,pi->pk", e.s, y)
        f = f + fr * fs
    value = begin * l * m + end * f
    dx = begin[..., None] * m[..., None] * s.l + end[..., None] * fv[..., None] * e.u
    dy = begin[..., None] * l[..., None] * s.m + end[..., None] * fu[..., None] * e.v
    if e.r is not None and e.s is not None:
        dx, dy = dx + end[..., None] * fs[..., None] * e.r, dy + end[..., None] * fr[..., None] * e.s
    dx[:, :, 0] -= end * e.c * y[:, :1]
    dy[:, :, 0] -= end * e.c * x[:, :1]
    rows = 2 * half
    jacobian = np.zeros((len(z), rows, rows), dtype=complex)
    jacobian[:, : rows - 2, :half], jacobian[:, : rows - 2, half:] = dx, dy
    jacobian[:, rows - 2, :half], jacobian[:, rows - 1, half:] = s.patch
    closing = np.stack([x @ s.patch[0] - 1.0, y @ s.patch[1] - 1.0], axis=1)
    slope = np.concatenate([f - s.gamma * l * m, np.zeros((len(z), 2))], axis=1)
    return np.concatenate([value, closing], axis=1), jacobian, slope


def _solve(jacobian: Complex, right: Complex) -> Complex:
    try:
        return np.asarray(np.linalg.solve(jacobian, right[..., None])[..., 0])
    except np.linalg.LinAlgError:  # exactly singular somewhere: the least squares one there
        return np.stack([np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(jacobian, right, strict=True)])


def _track(s: _Start, e: Bilinear, z: Complex) -> tuple[Complex, np.ndarray]:
    """Points at t = 1 and which paths arrived: each path with its own step, a Runge-Kutta predictor and Newton's corrector."""
    z = z.copy()
    t, h, good = np.zeros(len(z)), np.full(len(z), 0.02), np.zeros(len(z), dtype=int)
    busy = np.arange(len(z))
    for _ in range(STEPS):
        if not busy.size:
            break
        part, at, now = e.of(busy), z[busy], t[busy]
        step = np.minimum(h[busy], 1.0 - now)

        def flow(point: Complex, time: np.ndarray, part: Bilinear = part) -> Complex:
            _, jacobian, slope = _system(s, part, point, time)
            return -_solve(jacobian, slope)

        k1 = flow(at, now)
        k2 = flow(at + 0.5 * step[:, None] * k1, now + 0.5 * step)
        k3 = flow(at + 0.5 * step[:, None] * k2, now + 0.5 * step)
        k4 = flow(at + step[:, None] * k3, now + step)
        new = at + step[:, None] / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        ahead, first = now + step, np.zeros(len(new))
        for turn in range(3):
            value, jacobian, _ = _system(s, part, new, ahead)
            change = _solve(jacobian, -value)
            size = np.abs(change).max(axis=1) / np.maximum(np.abs(new).max(axis=1), 1e-300)
            first = size if turn == 0 else first
            new = new + change
        with np.errstate(invalid="ignore"):
            # a far prediction could lie nearer to another path
            take = (size < ACCURATE) & (first < 1e-3)
        z[busy[take]], t[busy[take]] = new[take], ahead[take]
        good[busy] = np.where(take, good[busy] + 1, 0)
        h[busy] = np.where(take, np.where(good[busy] >= 3, np.minimum(2.0 * h[busy], LONGEST), h[busy]), 0.5 * step)
        good[busy] = np.where(good[busy] >= 3, 0, good[busy])
        # near t = 1 a path to a double end, or to one at infinity, creeps: what is left is as good as the end
        busy = busy[(t[busy] < 1.0) & (h[busy] > SHORTEST)]
    return z, t > 1.0 - 1e-5
