"""Starts for path synthesis: some 1e5 four-bars, each in the place, size and with the coupler point that suit the points best.

For given crank angles t and a four-bar in its unit (crank 1, other bars b, c, d, phase f of the crank) the coupler point is

    P = o + w e^(i t) + q u(t)

with the coupler's direction u in that unit: linear in the pivot o, the crank w and q = w p, so all three follow in closed form. What a
four-bar misses is the part of the points that lies outside the span of 1, e^(i t) and u(t).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mechlab.analytic.path_synthesis.curves import SIZES, Array, Complex
from mechlab.analytic.path_synthesis.guided_body import missed_arrows
from mechlab.lazy_dataclass import dataclass

PHASES = 24
BARS = np.geomspace(0.3, 8.0, 17)
"""Lengths of coupler, rocker and ground in cranks."""


@dataclass(frozen=True)
class Starts:
    """Rows (k, 12) of four-bars, their modes (k,), and the sum of squared distances (k,) that each leaves at the points."""

    rows: Array
    modes: Array
    missed: Array


@lru_cache(maxsize=2)
def shapes() -> Array:
    """(n, 3): coupler, rocker and ground in cranks, of four-bars that assemble at more than half of the crank's angles."""
    b, c, d = (g.ravel() for g in np.meshgrid(BARS, BARS, BARS, indexing="ij"))
    t = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    way = np.abs(d[:, None] - np.exp(1j * t))
    closes = (way < (b + c)[:, None]) & (way > np.abs(b - c)[:, None])
    kept = np.mean(closes, axis=1) > 0.5
    return np.column_stack([b, c, d])[kept]


def starts(targets: Complex, t: Array, count: int, least: float = 0.0, arrows: Complex | None = None) -> Starts:
    """The best `count` of the atlas for points (n,) at crank angles (n,): one of each shape and mode, in its best phase. least: sine of the
    smallest angle between coupler and rocker; arrows: directions (n,) of a body on the coupler, if there is one."""
    b, c, d = (s[:, None, None] for s in shapes().T)
    phase = 2.0 * np.pi * np.arange(PHASES) / PHASES
    e = np.exp(1j * t)
    # the ground is turned against the crank: in the axes of the crank at t = 0 the pivot D is d e^(-i phase)
    way = d * np.exp(-1j * phase)[:, None] - e
    square = way.real**2 + way.imag**2
    along = (b * b + square - c * c) / (2.0 * b)
    rest = square - along * along
    closes = np.all(rest > max(1e-4, least * least) * c * c, axis=-1)
    basis = np.linalg.qr(np.column_stack([np.ones_like(e), e]))[0]
    aim = targets - basis @ (basis.conj().T @ targets)
    best = list[tuple[Array, Array, Array]]()
    for mode in (1, -1):
        with np.errstate(invalid="ignore", divide="ignore"):
            u = way * (along + 1j * mode * np.sqrt(rest)) / square
            v = u - (u @ basis.conj()) @ basis.T
            hit = np.abs(v.conj() @ aim) ** 2 / np.sum(v.real**2 + v.imag**2, axis=-1)
        turned = 0.0 if arrows is None else missed_arrows(u, arrows)
        missed = np.where(closes, np.real(np.vdot(aim, aim)) - hit + turned, np.inf)
        k = np.argmin(missed, axis=1)
        best.append((missed[np.arange(len(k)), k], k, np.full(len(k), mode)))
    left, chosen, modes = (np.concatenate(z) for z in zip(*best, strict=True))
    order = np.argsort(left)[:count]
    order = order[np.isfinite(left[order])]
    return _rows(targets, t, shapes()[order % len(shapes())], phase[chosen[order]], modes[order], left[order])


def _rows(targets: Complex, t: Array, shape: Array, phase: Array, modes: Array, missed: Array) -> Starts:
    """The linear fit, written out for the chosen ones."""
    rows = np.zeros((len(shape), SIZES))
    e = np.exp(1j * t)
    for k, ((b, c, d), f, mode) in enumerate(zip(shape, phase, modes, strict=True)):
        way = d * np.exp(-1j * f) - e
        square = np.abs(way) ** 2
        along = (b * b + square - c * c) / (2.0 * b)
        u = way * (along + 1j * mode * np.sqrt(square - along * along)) / square
        o, w, q = np.linalg.lstsq(np.column_stack([np.ones_like(e), e, u]), targets, rcond=None)[0]
        # u is in the axes of the crank at t = 0; those of the world are turned by arg w
        p, size = q * abs(w) / w if w else 0j, abs(w)
        d_world = o + w * d * np.exp(-1j * f)
        rows[k] = [o.real, o.imag, w.real, w.imag, d_world.real, d_world.imag, 0.0, 0.0, b * size, c * size, p.real, p.imag]
    return Starts(rows, modes, missed)
