"""Straight lines: crank-rockers whose coupler point goes straight while the crank turns through a given angle.

In cranks, P = e^(i t) + p u(t) with u the direction of the coupler. For bars b, c, d the straightest point and line follow in closed
form: the distance from the line with the normal n is Re(conj(n) e^(i t)) + Re(q u) - h with q = conj(n) p, linear in (n, q, h); its
least squares under |n| = 1 are an eigenvalue problem of order two. The best of an atlas are then moved until the largest deviation is
least, with transmission angle and size as constraints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechlab.analytic.path_synthesis.curves import Array, Complex
from mechlab.analytic.path_synthesis.minimax import least_largest
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, part, silent

BARS = np.geomspace(1.15, 9.0, 20)
"""Lengths of coupler, rocker and ground in cranks."""
WINDOWS = 36
"""Crank angles at which the straight part may have its middle."""
COARSE, FINE = 13, 61
"""Crank angles of the straight part in the atlas, and in the end."""
REFINED = 9
"""Starts that are refined."""


@dataclass(frozen=True)
class StraightFourbar:
    """Bars in cranks, coupler point p in the axes of the coupler, middle of the straight part [rad], direction of the line [rad] and its
    stroke [cranks]; deviation: width of the strip in which P stays, over the stroke; least transmission angle of the whole turn [rad];
    longest: longest bar over the stroke."""

    coupler: float
    rocker: float
    ground: float
    point: complex
    middle: float
    direction: float
    stroke: float
    deviation: float
    least_transmission_angle: float
    longest: float


def turning_shapes(least: float) -> Array:
    """(n, 3): bars of BARS in cranks whose crank turns fully with a transmission angle of at least `least` [rad]."""
    b, c, d = (g.ravel() for g in np.meshgrid(BARS, BARS, BARS, indexing="ij"))
    shapes = np.column_stack([b, c, d])
    return shapes[np.min(turning(shapes, least), axis=1) >= 0.0]


def turning(shapes: Array, least: float) -> Array:
    """(..., 2), at least 0 where the transmission angle is at least `least` [rad] with crank and ground in line, stretched and folded; then
    it is so in the whole turn, and the crank turns fully."""
    b, c, d = shapes[..., 0], shapes[..., 1], shapes[..., 2]
    return np.stack([np.cos(least) - np.abs(b * b + c * c - (d + s) ** 2) / (2.0 * b * c) for s in (1.0, -1.0)], axis=-1)


def coupler_turn(shapes: Array, t: Array) -> Complex:
    """Direction u (k, n) of the coupler of bars (k, 3+) in cranks at crank angles (k, n); the joint left of the way A -> D."""
    b, c, d = (shapes[..., n, None] for n in range(3))
    way = d - np.exp(1j * t)
    square = way.real**2 + way.imag**2
    along = (b * b + square - c * c) / (2.0 * b)
    with np.errstate(invalid="ignore"):
        return np.asarray(way * (along + 1j * np.sqrt(square - along * along)) / square)


def straight_fourbars(
    angle: float, size: float, least: float, progress: Callable[[int, int], None] = silent
) -> tuple[StraightFourbar, ...]:
    """Crank-rockers whose coupler point goes straight for a crank angle [rad], the straightest first. size: longest bar over the stroke;
    least: smallest transmission angle [rad]; progress hears (done, total)."""

    def model(x: Array) -> tuple[Array, Array]:
        t = x[:, 5, None] + np.linspace(-0.5, 0.5, FINE) * angle
        z = np.exp(1j * t) + (x[:, 3] + 1j * x[:, 4])[:, None] * coupler_turn(x, t)
        line = z * np.exp(-1j * x[:, 6, None])
        stroke = np.ptp(line.real, axis=1)
        return (line.imag - x[:, 7, None]) / stroke[:, None], np.column_stack([turning(x, least), size - _longest(x) / stroke[:, None]])

    out = list[StraightFourbar]()
    for start in counted(straight_starts(angle, size, least, REFINED, part(progress, 0, 15)), part(progress, 15, 100)):
        x, value = least_largest(model, start)
        if not np.isfinite(value) or np.min(model(x[None])[1]) < -1e-6:
            continue
        found = _found(x, angle)
        if all(abs(found.deviation / o.deviation - 1.0) > 1e-3 or abs(found.ground - o.ground) > 1e-2 for o in out):
            out.append(found)
    return tuple(sorted(out, key=lambda f: f.deviation))


def _longest(x: Array) -> Array:
    """(k, 6): crank, coupler, rocker, ground, and from the coupler's joints to the point."""
    p = x[:, 3] + 1j * x[:, 4]
    return np.column_stack([np.ones(len(x)), x[:, :3], np.abs(p), np.abs(p - x[:, 0])])


def straight_starts(angle: float, size: float, least: float, count: int, progress: Callable[[int, int], None] = silent) -> list[Array]:
    """The `count` straightest of the atlas, of unlike bars: rows (8,) of b, c, d, p, middle, direction, offset. size: longest bar over the
    stroke; least: smallest transmission angle [rad]; progress hears (done, total)."""
    shapes = turning_shapes(least)
    if not len(shapes):
        return []
    middles = 2.0 * np.pi * np.arange(WINDOWS) / WINDOWS
    rows, worths = [], []
    for middle in counted(list(middles), progress):
        t = middle + np.linspace(-0.5, 0.5, COARSE) * angle
        e, u = np.exp(1j * t), coupler_turn(shapes, np.broadcast_to(t, (len(shapes), COARSE)))
        one = np.broadcast_to(e, u.shape)
        table = np.stack([one.real, one.imag, u.real, -u.imag], axis=-1)
        table = table - table.mean(axis=1, keepdims=True)
        gram = np.swapaxes(table, 1, 2) @ table
        solved = np.linalg.solve(gram[:, 2:, 2:] + 1e-14 * np.eye(2), gram[:, 2:, :2])
        left, vectors = np.linalg.eigh(gram[:, :2, :2] - gram[:, :2, 2:] @ solved)
        n = vectors[:, :, 0]
        q = -(solved @ n[..., None])[..., 0]
        p = (q[:, 0] + 1j * q[:, 1]) / (n[:, 0] - 1j * n[:, 1])
        direction = np.angle(n[:, 0] + 1j * n[:, 1]) - 0.5 * np.pi
        line = (e + p[:, None] * u) * np.exp(-1j * direction)[:, None]
        stroke = np.ptp(line.real, axis=1)
        x = np.column_stack([shapes, p.real, p.imag, np.full(len(shapes), middle), direction, line.imag.mean(axis=1)])
        over = np.log(np.maximum(1.0, np.max(_longest(x), axis=1) / stroke / size))
        rows.append(x)
        worths.append(np.sqrt(np.maximum(left[:, 0], 0.0)) / stroke + 0.05 * over)
    every, worth = np.concatenate(rows), np.concatenate(worths)
    chosen = list[Array]()
    for k in np.argsort(worth)[:4000]:
        if all(np.max(np.abs(np.log(every[k, :3] / c[:3]))) > 0.2 or abs(every[k, 5] - c[5]) > 0.5 for c in chosen):
            chosen.append(every[k])
        if len(chosen) == count:
            break
    return chosen


def _found(x: Array, angle: float) -> StraightFourbar:
    t = x[5] + np.linspace(-0.5, 0.5, 10 * FINE) * angle
    p = complex(x[3], x[4])
    line = (np.exp(1j * t) + p * coupler_turn(x[None], t[None])[0]) * np.exp(-1j * x[6])
    stroke = float(np.ptp(line.real))
    least = float(np.arccos(np.max(1.0 - turning(x, 0.0))))
    return StraightFourbar(
        float(x[0]), float(x[1]), float(x[2]), p, float(x[5]), float(x[6]), stroke, float(np.ptp(line.imag)) / stroke, least,
        float(np.max(_longest(x[None]))) / stroke,
    )  # fmt: skip
