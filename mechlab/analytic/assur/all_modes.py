"""Every assembly mode of class III and IV groups: the polynomial of degree 6, vectorised, each root polished by Newton."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.assur.plane import Complex, Real, unit
from mechlab.analytic.assur.two_loops import CIRCLE, MERGED, MODES, Modes, TwoLoops, determinant, polish

BLOCK = 4096  # positions solved at a time
_DEGENERATE = 1e-9


def all_modes(group: TwoLoops) -> Modes:
    """All modes of a group at all its positions.

    alpha_i u^2 + beta_i u + gamma_i = 0 with alpha = conj(w) q t + conj(p) q, beta = conj(w) p t^2 + c t + w conj(p),
    gamma = t (p conj(q) t + w conj(q)), c = |w|^2 + |p|^2 + |q|^2 - l^2; the resultant is t (t A^2 - B C).
    """
    shape, flat = group.shape, group.flat()
    n = flat.w.shape[1]
    parts = [_block(flat.take(slice(k, k + BLOCK))) for k in range(0, n, BLOCK)]
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
