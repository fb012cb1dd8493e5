"""Class III and IV groups: two closing links between two unknown turns, every assembly mode by one polynomial.

The group has two unknown unit numbers t = e^(i theta_t), u = e^(i theta_u) and two binary links that close it:

    z_i = w_i + p_i t + q_i u,   |z_i| = l_i,   i = 0, 1

w_i moves with the rest of the mechanism, p_i, q_i, l_i belong to the group. Eliminating u gives t A^2 - B C = 0 of
degree 6; roots come in pairs t, 1/conj(t), so there are 0, 2, 4 or 6 modes (with merged ones counted twice). The
polynomial is solved at all positions at once, and each root polished by Newton.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.plane import Complex, Flags, Point, Real, cross, dot, unit
from mechlab.analytic.blocks import pieces
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

MODES = 6
CIRCLE = 2e-2
"""A root this far from the unit circle is still tried: near a merge of two modes rounding moves it by the square root."""
MERGED = 1e-7  # [rad] nearer modes are one
CLOSED = 1e-12  # residual over the square of the size of the group
_DEGENERATE = 1e-9


@dataclass(frozen=True)
class TwoLoops:
    """Data of a group at one or many positions: w, p, q complex and l real, (2, ...); wd, wdd: rates of w."""

    w: Complex
    p: Complex
    q: Complex
    l: Real
    wd: Complex
    wdd: Complex

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the positions."""
        return tuple(np.broadcast_shapes(self.w.shape, self.p.shape, self.q.shape, self.l.shape)[1:])

    @property
    def scale(self) -> Real:
        """(...) square of the size of the group [m2], the measure for residuals."""
        return np.asarray(np.sum(np.abs(self.w) ** 2 + np.abs(self.p) ** 2 + np.abs(self.q) ** 2 + self.l**2, axis=0))

    def flat(self) -> TwoLoops:
        """The group with all positions on one axis: arrays (2, n)."""
        shape = (2, *self.shape)
        return self._each(lambda x: np.broadcast_to(x, shape).reshape(2, -1))

    def take(self, index: slice | np.ndarray) -> TwoLoops:
        """Some positions of a flat group."""
        return self._each(lambda x: x[:, index])

    def _each(self, change: Callable[[Any], Any]) -> TwoLoops:
        return TwoLoops(*(change(x) for x in (self.w, self.p, self.q, self.l, self.wd, self.wdd)))

    def z(self, theta_t: Real, theta_u: Real) -> tuple[Complex, Complex, Complex]:
        """(2, ...) closing links z, and p t, q u."""
        pt, qu = self.p * unit(theta_t), self.q * unit(theta_u)
        return self.w + pt + qu, pt, qu

    def residual(self, theta_t: Real, theta_u: Real) -> Real:
        """(2, ...) |z|^2 - l^2 [m2]."""
        z = self.z(theta_t, theta_u)[0]
        return np.asarray(dot(z, z) - self.l**2)


def two_loops(
    w: ArrayLike, p: ArrayLike, q: ArrayLike, l: ArrayLike, wd: ArrayLike = 0.0, wdd: ArrayLike = 0.0
) -> TwoLoops:
    """A TwoLoops; each argument (2, ...) or one number for both loops. Raises MechlabError unless finite and l > 0."""
    arrays = [np.asarray(x, dtype=complex) for x in (w, p, q, wd, wdd)]
    lengths = np.asarray(l, dtype=float)
    if not all(np.all(np.isfinite(x)) for x in (*arrays, lengths)) or np.any(lengths <= 0.0):
        raise MechlabError(f"two-loop group: expected finite numbers and link lengths > 0, got l = {l!r}.")
    shape = np.broadcast_shapes((2,), *(x.shape[:1] for x in (*arrays, lengths)))
    if shape != (2,):
        raise MechlabError(
            "two-loop group: the first axis of w, p, q, l must have length 2, one for each closing link."
        )
    cw, cp, cq, cwd, cwdd = (np.atleast_1d(x) for x in arrays)
    return TwoLoops(cw, cp, cq, np.atleast_1d(lengths), cwd, cwdd)


def class_three(
    pins: tuple[Point, Point, Point], legs: tuple[float, float, float], platform: tuple[complex, complex]
) -> TwoLoops:
    """A platform on three links (class III): leg k from pins[k] to platform point P_k; `platform`: P2 - P1 and P3 - P1 in
    its own axes. theta_t: angle of leg 1, theta_u: angle of the platform. Cut at legs 2 and 3: w_i = G1 - G_i, p = l1."""
    g1, g2, g3 = pins
    w = np.stack(np.broadcast_arrays(g1.p - g2.p, g1.p - g3.p))
    wd = np.stack(np.broadcast_arrays(g1.v - g2.v, g1.v - g3.v))
    wdd = np.stack(np.broadcast_arrays(g1.a - g2.a, g1.a - g3.a))
    extra = (1,) * (w.ndim - 1)
    return two_loops(
        w, np.full((2, *extra), legs[0]), np.reshape(platform, (2, *extra)), np.reshape(legs[1:], (2, *extra)), wd, wdd
    )


def class_four(
    crank_pin: Point,
    pivot: Point,
    first: tuple[complex, complex],
    second: tuple[complex, complex],
    links: tuple[float, float],
) -> TwoLoops:
    """Two ternary links, joined by two binary ones (class IV, order 2). `first`: the far joints C, D of the link on
    crank_pin, `second`: B, E of the link on pivot, in their own axes; `links`: lengths of C-B and D-E."""
    difference = [np.asarray(getattr(crank_pin, k) - getattr(pivot, k)) for k in ("p", "v", "a")]
    extra = (1,) * max(x.ndim for x in difference)
    w, wd, wdd = (x[None] for x in difference)
    p, q, l = (np.reshape(np.asarray(x), (2, *extra)) for x in (first, -np.asarray(second), links))
    return two_loops(w, p, q, l, wd, wdd)


@dataclass(frozen=True)
class Modes:
    """All modes: theta_t, theta_u, det (..., 6), padded with NaN after `count` (...), in the order of theta_t.

    det: determinant of J (see `closure_jacobian`) [m4]; it vanishes where two modes merge; before that they have
    opposite signs.
    """

    theta_t: Real
    theta_u: Real
    det: Real
    count: np.ndarray

    def __getitem__(self, index: int) -> tuple[Real, Real, Real]:
        return self.theta_t[..., index], self.theta_u[..., index], self.det[..., index]


def closure_jacobian(group: TwoLoops, theta_t: Real, theta_u: Real) -> tuple[Real, Real, Real, Real, Complex]:
    """J = [Re conj(z_i) i p_i t, Re conj(z_i) i q_i u]: its entries J00, J01, J10, J11 (...), and z (2, ...)."""
    z, pt, qu = group.z(theta_t, theta_u)
    jt, ju = cross(pt, z), cross(qu, z)  # Re(conj(z) i a) = a x z
    return jt[0], ju[0], jt[1], ju[1], z


def determinant(group: TwoLoops, theta_t: Real, theta_u: Real) -> Real:
    """(...) det J [m4]."""
    a, b, c, d, _ = closure_jacobian(group, theta_t, theta_u)
    return a * d - b * c


def polish(group: TwoLoops, theta_t: Real, theta_u: Real, steps: int = 40) -> tuple[Real, Real, Flags]:
    """theta_t, theta_u and whether they close, (n,) each: Newton on both closures in steps of at most 0.2 rad."""
    t, u = np.array(theta_t, dtype=float), np.array(theta_u, dtype=float)
    scale = np.broadcast_to(group.scale, t.shape)
    busy = np.arange(t.size)
    last = np.full(t.size, np.inf)
    for _ in range(steps):
        some = group.take(busy) if busy.size < t.size else group
        a, b, c, d, z = closure_jacobian(some, t[busy], u[busy])
        f = 0.5 * (dot(z, z) - some.l**2)
        size = np.max(np.abs(f), axis=0)
        det = a * d - b * c
        det = np.where(det == 0.0, np.finfo(float).tiny, det)
        dt, du = (b * f[1] - d * f[0]) / det, (c * f[0] - a * f[1]) / det
        go = (size > 4e-16 * scale[busy]) & ((size < 0.9 * last[busy]) | (size > CLOSED * scale[busy]))
        last[busy] = size
        if not np.any(go):
            break
        limit = np.minimum(1.0, 0.2 / np.maximum(np.maximum(np.abs(dt), np.abs(du)), 1e-300))
        busy, dt, du = busy[go], (dt * limit)[go], (du * limit)[go]
        t[busy] += dt
        u[busy] += du
    closed = np.max(np.abs(group.residual(t, u)), axis=0) < CLOSED * scale
    return t, u, closed


def all_modes(group: TwoLoops) -> Modes:
    """All modes of a group at all its positions.

    alpha_i u^2 + beta_i u + gamma_i = 0 with alpha = conj(w) q t + conj(p) q, beta = conj(w) p t^2 + c t + w conj(p),
    gamma = t (p conj(q) t + w conj(q)), c = |w|^2 + |p|^2 + |q|^2 - l^2; the resultant is t (t A^2 - B C).
    """
    shape, flat = group.shape, group.flat()
    n = flat.w.shape[1]
    parts = [_block(flat.take(part)) for part in pieces(n)]
    t, u, det, count = (np.concatenate([x[i] for x in parts]) for i in range(4))
    full = (*shape, MODES)
    return Modes(t.reshape(full), u.reshape(full), det.reshape(full), count.reshape(shape))


def coefficients(group: TwoLoops) -> tuple[Complex, Complex, Complex]:
    """(7, n) coefficients of t A^2 - B C, rising powers; and A (3, n), B (4, n) of u = -t A / B."""
    w, p, q = group.w, group.p, group.q
    c = np.abs(w) ** 2 + np.abs(p) ** 2 + np.abs(q) ** 2 - group.l**2 + 0j
    alpha = [np.conj(p) * q, np.conj(w) * q]
    beta = [w * np.conj(p), c, np.conj(w) * p]
    gamma = [w * np.conj(q), p * np.conj(q)]

    def crossed(x: list[Complex], y: list[Complex]) -> Complex:
        """x_0 y_1 - x_1 y_0 of polynomials that carry the two loops on their first axis."""
        out = np.zeros((len(x) + len(y) - 1, w.shape[1]), dtype=complex)
        for i, a in enumerate(x):
            for j, b in enumerate(y):
                out[i + j] += a[0] * b[1] - a[1] * b[0]
        return out

    a, b, c_ = crossed(alpha, gamma), crossed(alpha, beta), crossed(beta, gamma)
    out = np.zeros((7, w.shape[1]), dtype=complex)
    for i in range(3):
        for j in range(3):
            out[i + j + 1] += a[i] * a[j]
    for i in range(4):
        for j in range(4):
            out[i + j] -= b[i] * c_[j]
    return out, a, b


def _roots(poly: Complex) -> Complex:
    """(n, 6) roots of polynomials (7, n); missing ones, where the degree is lower, stand at infinity."""
    n = poly.shape[1]
    lead, size = np.abs(poly[6]), np.max(np.abs(poly), axis=0)
    good = lead > 1e-12 * np.maximum(size, 1e-300)
    out = np.full((n, 6), np.inf, dtype=complex)
    companion = np.zeros((int(np.count_nonzero(good)), 6, 6), dtype=complex)
    companion[:, np.arange(5), np.arange(1, 6)] = 1.0
    companion[:, 5, :] = (-poly[:6, good] / poly[6, good]).T
    out[good] = np.linalg.eigvals(companion)
    for k in np.flatnonzero(~good):
        some = (
            np.roots(np.where(np.abs(poly[::-1, k]) > 1e-12 * size[k], poly[::-1, k], 0.0))
            if size[k] > 0
            else np.array([])
        )
        out[k, : len(some)] = some
    return out


def _block(group: TwoLoops) -> tuple[Real, Real, Real, np.ndarray]:
    n = group.w.shape[1]
    poly, a, b = coefficients(group)
    roots = _roots(poly)
    with np.errstate(invalid="ignore"):
        row, slot = np.nonzero(np.abs(np.abs(roots) - 1.0) < CIRCLE)
    t = roots[row, slot]
    top = -t * (a[0, row] + t * (a[1, row] + t * a[2, row]))
    bottom = b[0, row] + t * (b[1, row] + t * (b[2, row] + t * b[3, row]))
    weak = np.abs(bottom) < _DEGENERATE * np.sqrt(np.max(np.abs(b[:, row]), axis=0) ** 2 + 1e-300)
    u = top / np.where(weak, 1.0, bottom)
    weak |= np.abs(np.abs(u) - 1.0) > 0.5
    theta_t, theta_u = np.angle(t), np.angle(u)
    if np.any(weak):
        row, theta_t, theta_u = _with_quadratic(group, row, theta_t, theta_u, weak)
    theta_t, theta_u, closed = polish(group.take(row), theta_t, theta_u)
    row, theta_t, theta_u = row[closed], _wrapped(theta_t[closed]), _wrapped(theta_u[closed])
    det = determinant(group.take(row), theta_t, theta_u)
    return _distinct(n, row, theta_t, theta_u, det)


def _with_quadratic(
    group: TwoLoops, row: np.ndarray, theta_t: Real, theta_u: Real, weak: np.ndarray
) -> tuple[np.ndarray, Real, Real]:
    """Where the linear formula for u degenerates: both solutions u of each single loop are tried."""
    r, th = row[weak], theta_t[weak]
    rows, ts, us = [row[~weak]], [theta_t[~weak]], [theta_u[~weak]]
    for i in (0, 1):
        some = group.take(r)
        base = some.w[i] + some.p[i] * unit(th)
        cosine = (some.l[i] ** 2 - np.abs(base) ** 2 - np.abs(some.q[i]) ** 2) / np.maximum(
            2.0 * np.abs(base) * np.abs(some.q[i]), 1e-300
        )
        spread = np.arccos(np.clip(cosine, -1.0, 1.0))
        for sign in (1.0, -1.0):
            rows.append(r)
            ts.append(th)
            us.append(np.angle(base) + sign * spread - np.angle(some.q[i]))
    return np.concatenate(rows), np.concatenate(ts), np.concatenate(us)


def _distinct(n: int, row: np.ndarray, t: Real, u: Real, det: Real) -> tuple[Real, Real, Real, np.ndarray]:
    """Modes sorted by row and theta_t, each once, as (n, 6) arrays and their number."""
    order = np.lexsort((t, row))
    row, t, u, det = row[order], t[order], u[order], det[order]
    keep = np.ones(len(row), dtype=bool)
    for ahead in range(1, min(4 * MODES, len(row))):
        same_row = row[ahead:] == row[:-ahead]
        if not np.any(same_row):
            break
        near = np.maximum(np.abs(_wrapped(t[ahead:] - t[:-ahead])), np.abs(_wrapped(u[ahead:] - u[:-ahead])))
        # Two modes about to merge are near each other too, but on opposite sides of det J = 0.
        same = same_row & ((near < 1e-3 * MERGED) | ((near < MERGED) & (np.sign(det[ahead:]) == np.sign(det[:-ahead]))))
        keep[ahead:] &= ~(same & keep[:-ahead])
    row, t, u, det = row[keep], t[keep], u[keep], det[keep]
    count = np.bincount(row, minlength=n)
    slot = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    inside = slot < MODES
    out = [np.full((n, MODES), np.nan) for _ in range(3)]
    for array, values in zip(out, (t, u, det), strict=True):
        array[row[inside], slot[inside]] = values[inside]
    return out[0], out[1], out[2], np.minimum(count, MODES)


def _wrapped(angle: Real) -> Real:
    """The angle modulo full turns, in (-pi, pi]."""
    return -((-np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi)
