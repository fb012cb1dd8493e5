"""Dwells: six-bars of Stephenson's third kind whose output rests while the crank turns through a given angle.

Where the coupler point of a crank-rocker runs on an arc about R0, a link of that arc's radius keeps its far end in R0, and so does the
output that it drives. The arcs of an atlas are found by circles of least algebraic distance,

    |P|^2 = 2 P . R0 + k,    linear in R0 and k

with sums over a sliding window; each of the best gets the output pivot that suits it, and all sizes are then moved until the largest
deviation of the output from its rest is least, with swing, transmission angles and size as constraints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechlab.analytic.path_synthesis.curves import Array, Complex
from mechlab.analytic.path_synthesis.minimax import least_largest
from mechlab.analytic.path_synthesis.straight import coupler_turn, turning, turning_shapes
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, part, silent

TURN = 72
"""Crank angles of a full turn."""
FINE = 41
"""Crank angles of the dwell."""
POINTS = np.array([r * np.exp(1j * a) for r in (0.6, 1.0, 1.5, 2.2) for a in np.arange(12) * np.pi / 6.0])
"""Coupler points of the atlas, in couplers."""
ARCS, TRIED, REFINED = 80, 26, 6
"""Arcs that get an output pivot; six-bars that are moved a few rounds; those that are refined to the end."""
ROUNDS = 10, 40
"""Rounds of the first search and of the last."""


@dataclass(frozen=True)
class DwellSixbar:
    """Bars in cranks as of a crank-rocker with coupler point p; link P-R, output G-R and its pivot G, seen from the pivot of the crank in
    the axes of the ground; side of R from the way P -> G; first: crank angle where the dwell begins. deviation: width of the strip of
    angles in which the output rests [rad]; swing of the output [rad]; the least transmission angle at both dyads over the turn [rad];
    longest bar."""

    coupler: float
    rocker: float
    ground: float
    point: complex
    link: float
    output: float
    pivot: complex
    side: int
    first: float
    deviation: float
    swing: float
    least_transmission_angle: float
    longest: float


def dwell_sixbars(
    angle: float, swing: float, size: float, least: float, progress: Callable[[int, int], None] = silent
) -> tuple[DwellSixbar, ...]:
    """Six-bars that rest for a crank angle [rad] and swing by at least `swing` [rad], the stillest first. size: longest bar in cranks;
    least: smallest transmission angle [rad]; progress hears (done, total)."""

    def model(x: Array, side: int) -> tuple[Array, Array]:
        deviation = output_angle(x, x[:, 5, None] + np.linspace(-0.5, 0.5, FINE) * angle, side)[0] - x[:, 10, None]
        turned, sine = output_angle(x, np.broadcast_to(2.0 * np.pi * np.arange(TURN) / TURN, (len(x), TURN)), side)
        reach = np.ptp(np.unwrap(turned, axis=1), axis=1)
        kept = [turning(x, least), np.min(sine, axis=1) - np.sin(least), reach - swing, 1.0 - _longest(x) / size]
        return np.angle(np.exp(1j * deviation)), np.column_stack(kept)

    def moved(x: Array, side: int, rounds: int) -> tuple[float, Array, int]:
        found, value = least_largest(lambda rows: model(rows, side), x, rounds)
        return value, found, side

    begun = counted(_starts(angle, swing, size, least, part(progress, 0, 25)), part(progress, 25, 65))
    first = sorted((moved(x, side, ROUNDS[0]) for x, side in begun), key=lambda v: v[0])
    out = list[DwellSixbar]()
    for value, x, side in (moved(x, side, ROUNDS[1]) for _, x, side in counted(first[:REFINED], part(progress, 65, 100))):
        if np.isfinite(value) and np.min(model(x[None], side)[1]) > -1e-6:
            found = _found(x, side, angle)
            if all(abs(found.deviation / o.deviation - 1.0) > 1e-3 or abs(found.ground - o.ground) > 1e-2 for o in out):
                out.append(found)
    return tuple(sorted(out, key=lambda f: f.deviation))


def coupler_point(x: Array, t: Array) -> Complex:
    """P (k, n) of rows (b, c, d, p, ...) at crank angles (k, n)."""
    return np.asarray(np.exp(1j * t) + (x[:, 3] + 1j * x[:, 4])[:, None] * coupler_turn(x, t))


def output_angle(x: Array, t: Array, side: int) -> tuple[Array, Array]:
    """Output angle G-R (k, n) of rows (b, c, d, p, middle, link, pivot, output, rest), and the sine of the transmission angle at R."""
    rod, pivot, arm = x[:, 6, None], (x[:, 7] + 1j * x[:, 8])[:, None], x[:, 9, None]
    way = pivot - coupler_point(x, t)
    square = way.real**2 + way.imag**2
    along = (square + arm * arm - rod * rod) / 2.0
    with np.errstate(invalid="ignore"):
        across = side * np.sqrt(square * arm * arm - along * along)
    # R - G against the way from P to G
    return np.angle(way * (-along + 1j * across)), np.abs(across / (rod * arm))


def _longest(x: Array) -> Array:
    p, pivot = x[:, 3] + 1j * x[:, 4], x[:, 7] + 1j * x[:, 8]
    sizes = [x[:, :3], np.abs(p)[:, None], np.abs(p - x[:, 0])[:, None], np.abs(x[:, 6:7]), np.abs(pivot)[:, None], np.abs(x[:, 9:10])]
    return np.asarray(np.max(np.column_stack(sizes), axis=1))


def _arcs(angle: float, size: float, least: float) -> tuple[Array, Complex]:
    """Rows (k, 7) (b, c, d, p, middle, radius) of the best arcs, and their centres (k,)."""
    shapes = turning_shapes(least)
    shapes = shapes[np.max(shapes, axis=1) < size][::3]
    if not len(shapes):
        return np.zeros((0, 7)), np.zeros(0, dtype=complex)
    t = 2.0 * np.pi * np.arange(TURN) / TURN
    u = coupler_turn(shapes, np.broadcast_to(t, (len(shapes), TURN)))
    p = POINTS * shapes[:, :1]
    z = (np.exp(1j * t) + p[..., None] * u[:, None]).reshape(-1, TURN)
    points, bars = p.ravel(), np.repeat(shapes, len(POINTS), axis=0)
    count = max(5, 1 + round(angle / (2.0 * np.pi) * TURN))
    square = z.real**2 + z.imag**2
    sums = []
    for v in (z.real, z.imag, z.real**2, z.imag**2, z.real * z.imag, z.real * square, z.imag * square, square, square**2):
        total = np.cumsum(np.concatenate([np.zeros((len(z), 1)), v, v[:, :count]], axis=1), axis=1)
        sums.append((total[:, count:] - total[:, :-count])[:, :TURN:3] / count)
    x, y, xx, yy, xy, xs, ys, s, ss = sums
    a, b, c, f, g = xx - x * x, yy - y * y, xy - x * y, xs - x * s, ys - y * s
    with np.errstate(divide="ignore", invalid="ignore"):
        det = a * b - c * c
        centre = 0.5 * ((f * b - g * c) + 1j * (g * a - f * c)) / det
        rest = ss - s * s - 2.0 * (centre.real * f + centre.imag * g)
        radius = np.sqrt(s - 2.0 * (x * centre.real + y * centre.imag) + np.abs(centre) ** 2)
        # of |P|^2 the error is 2 radius times that of the distance; the end R0 moves by the latter
        miss = np.sqrt(np.maximum(rest, 0.0)) / (2.0 * radius)
    miss[~((radius < 0.8 * size) & (radius > 0.4) & np.isfinite(miss))] = np.inf
    miss = np.where(np.abs(points)[:, None] > size, np.inf, miss)
    best = np.argmin(miss, axis=1)
    row = np.arange(len(z))
    place = points / bars[:, 0]
    chosen = list[int]()
    for k in np.argsort(miss[row, best]):
        if len(chosen) == ARCS or not np.isfinite(miss[k, best[k]]):
            break
        if all(np.max(np.abs(np.log(bars[k] / bars[c]))) > 0.3 or abs(place[k] - place[c]) > 0.7 for c in chosen):
            chosen.append(int(k))
    at = best[chosen]
    middle = t[3 * at] + 0.5 * (count - 1) * 2.0 * np.pi / TURN
    rows = np.column_stack([bars[chosen], points[chosen].real, points[chosen].imag, middle, radius[chosen, at]])
    return rows, centre[chosen, at]


def _starts(
    angle: float, swing: float, size: float, least: float, progress: Callable[[int, int], None]
) -> list[tuple[Array, int]]:
    """Rows (11,) with the output pivot that suits each arc, and the side of R."""
    arcs, centres = _arcs(angle, size, least)
    t = 2.0 * np.pi * np.arange(TURN) / TURN
    lengths, directions = np.meshgrid(np.array([0.7, 1.2, 2.0, 3.2, 5.0]), np.arange(24) * np.pi / 12.0)
    out = list[tuple[float, Array, int]]()
    for arc, centre in counted(list(zip(arcs, centres, strict=True)), progress):
        pivots = centre + lengths.ravel() * np.exp(1j * directions.ravel())
        rest = np.angle(centre - pivots)
        many = np.ones((len(pivots), 1))
        x = np.column_stack([many * arc, pivots.real, pivots.imag, lengths.ravel(), rest])
        # R0 lies on this side of the way from P, in the middle of the dwell, to the pivot
        p = coupler_point(x, x[:, 5, None])[:, 0]
        side = np.where(np.imag(np.conj(pivots - p) * (centre - p)) > 0.0, 1, -1)
        worth = np.full(len(x), np.inf)
        for s in (1, -1):
            turned, sine = output_angle(x, np.broadcast_to(t, (len(x), TURN)), s)
            fine = (side == s) & np.all(np.isfinite(sine), axis=1)
            with np.errstate(invalid="ignore"):
                reach = np.ptp(np.unwrap(turned, axis=1), axis=1)
                lack = np.maximum(0.0, swing - reach) + np.maximum(0.0, np.sin(least) - np.min(sine, axis=1))
            worth = np.where(fine & (_longest(x) < size), lack, worth)
        k = int(np.argmin(worth))
        if np.isfinite(worth[k]):
            out.append((float(worth[k]), x[k], int(side[k])))
    # the arcs come in the order of their fit, which says more than what the pivot still lacks
    return [(x, side) for worth, x, side in sorted(out, key=lambda v: v[0] > 0.3)[:TRIED]]


def _found(x: Array, side: int, angle: float) -> DwellSixbar:
    rest = np.unwrap(output_angle(x[None], x[None, 5, None] + np.linspace(-0.5, 0.5, 10 * FINE) * angle, side)[0][0])
    turned, sine = output_angle(x[None], np.linspace(0.0, 2.0 * np.pi, 10 * TURN)[None], side)
    least = min(float(np.arccos(np.max(1.0 - turning(x, 0.0)))), float(np.arcsin(np.min(sine))))
    return DwellSixbar(
        float(x[0]), float(x[1]), float(x[2]), complex(x[3], x[4]), float(x[6]), float(x[9]), complex(x[7], x[8]), side,
        float(x[5] - 0.5 * angle), float(np.ptp(rest)), float(np.ptp(np.unwrap(turned[0]))), least, float(_longest(x[None])[0]),
    )  # fmt: skip
