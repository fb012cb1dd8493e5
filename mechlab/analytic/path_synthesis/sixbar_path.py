"""Six-bars whose point passes through given points in their order, or whose link guides a body: Stephenson's third chain and Watt's first.

For given crank angles t, a four-bar in its unit (crank 1), a coupler point p and a dyad on it the point is

    Q = o + w (e^(i t) + p u(t)) + (w q) v(t)

linear in the pivot o, the crank w and w q, as the coupler point of a four-bar is (`atlas`). Four-bars to begin with are those found for
the same points, and with prescribed timing the best of the atlas; each is tried with many dyads, drawn so that they assemble at all points.
The best are moved by least squares as four-bars are: with free timing up to fifteen points have exact solutions, with timing up to eight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mechlab.analytic.path_synthesis.atlas import starts
from mechlab.analytic.path_synthesis.curves import COUPLER, LINK, Array, Complex, points
from mechlab.analytic.path_synthesis.fit import Fitted, Limits, fit
from mechlab.analytic.path_synthesis.guided_body import missed_arrows
from mechlab.analytic.path_synthesis.path import suited, timings
from mechlab.analytic.path_synthesis.sixbar import Sixbar, link_turn
from mechlab.analytic.path_synthesis.task import PathLinkage, PathTask, best, joined, judged, one_by_one, ordered
from mechlab.progress import counted, part, silent

SHAPES, DYADS = 120, 300
"""Most four-bars to begin with, and dyads tried on each."""
EACH = 5
"""Dyads of a four-bar that are kept."""
BEGUN, MOVED, KEPT = 500, 120, 20
"""Six-bars after the search, after the first rounds and after the second; numbers for up to POINTS points, fewer beyond."""
POINTS = 20
BETWEEN = 3
"""Places between two points at which the transmission angle is kept too: two dyads may come flat where no point is."""
SPARE = np.radians(0.5)
"""By so much more the transmission angle is kept there, as it is judged at other places [rad]."""
ROUNDS = 25, 80, 400
"""Rounds of the least squares before each of these choices, and in the end."""
CHAINS = (Sixbar(), Sixbar(on_rocker=True))
EXACT_POSITIONS = 8
"""Positions of a body that Watt's chain may meet exactly: 17 numbers and seven crank angles, three equations a position (Plecnik, McCarthy
and Wampler 2014)."""
PATIENT, LAST = 8, 1500
"""Six-bars of Watt's chain that are moved on, and for so many rounds, up to that many positions: their equations are nearly singular."""


def path_sixbars(
    task: PathTask, base: Sequence[PathLinkage], seed: int = 0, progress: Callable[[int, int], None] = silent
) -> tuple[PathLinkage, ...]:
    """Six-bars, the best first, as `path_fourbars` orders them; also those with a defect. base: four-bars found for the same task.
    seed: of the random dyads; progress hears (done, total)."""
    return tuple(task.from_unit(f) for f in _sixbars(task.unit, [task.to_unit(f) for f in base], seed, progress))


def _sixbars(task: PathTask, base: Sequence[PathLinkage], seed: int, progress: Callable[[int, int], None]) -> tuple[PathLinkage, ...]:
    rng, fewer = np.random.default_rng(seed), min(1.0, POINTS / len(task.targets))
    dyads = max(EACH, round(DYADS * fewer))
    shapes, between = _shapes(task, base, part(progress, 0, 60)), max(1, round(BETWEEN * fewer))
    limits = replace(task.limits, least=float(np.sin(task.least + SPARE)), between=between)
    out = list[PathLinkage]()
    for k, curve in enumerate(CHAINS):
        share = part(progress, 60 + 40 * k // len(CHAINS), 60 + 40 * (k + 1) // len(CHAINS))
        every = (_begun(task, curve, shape, limits, dyads, rng) for shape in counted(shapes, part(share, 0, 40)))
        begun = [f for f in every if len(f.rows)]
        if not begun:
            continue
        found = best(joined(begun), task, round(BEGUN * fewer))
        for rounds, kept in counted(list(zip(ROUNDS, (MOVED, KEPT, KEPT), strict=True)), part(share, 40, 100)):
            found = best(fit(task.aims, found, task.curve(curve), task.timed, limits, rounds), task, max(6, round(kept * fewer)))
        if task.arrows is not None and curve.on_rocker and len(task.targets) <= EXACT_POSITIONS:
            last = fit(task.aims, best(found, task, PATIENT), task.curve(curve), task.timed, limits, LAST)
            found = best(joined([last, found]), task, KEPT)
        out += [judged(f, task.curve(curve), task) for f in one_by_one(found)]
    return ordered(out, task)


Shape = tuple[Array, int, Array]
"""Row (12,), mode and crank angles (n,) of a four-bar."""


def _shapes(task: PathTask, base: Sequence[PathLinkage], progress: Callable[[int, int], None]) -> list[Shape]:
    """Four-bars to begin with: those found, and the best of the atlas for each guess of the crank angles."""
    guesses = timings(task)
    each, few = max(2, SHAPES // len(guesses)), suited(task)
    out = [(f.row, f.mode, f.angles) for f in base if np.all(np.isfinite(f.distances))][: SHAPES // 2]
    for t in counted(guesses, progress):
        found = starts(task.targets[few], t[few], each, np.sin(task.least), None if task.arrows is None else task.arrows[few])
        out += [(row, int(mode), t) for row, mode in zip(found.rows, found.modes, strict=True)]
    return out


def _begun(task: PathTask, curve: Sixbar, shape: Shape, limits: Limits, dyads: int, rng: np.random.Generator) -> Fitted:
    """The best dyads on a four-bar, each in the place and size that suit the points best."""
    row, mode, t = shape
    way = np.concatenate([t, limits.places(t[None])[0]])
    o, w, d = (complex(row[k], row[k + 1]) for k in (0, 2, 4))
    at, d = points(row[None], np.array([mode]), 0.0, way[None]), (d - o) / w
    # from here on the crank is 1 along the x axis at t = 0
    pin, joint, turn = (at.pin[0] - o) / w, (at.joint[0] - o) / w, at.turn[0] * abs(w) / w
    b, c = row[COUPLER] / abs(w), row[LINK] / abs(w)
    p = b * rng.uniform(0.3, 2.2, dyads) * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, dyads))
    p[: dyads // 3] = complex(row[10], row[11]) / abs(w)
    first = pin + p[:, None] * turn
    s = max(b, c, abs(d), 1.0) * rng.uniform(0.2, 2.0, dyads) * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, dyads))
    if not curve.on_rocker:
        s = s + first.mean(axis=1)
    between = (d + s[:, None] * (joint - d) / c if curve.on_rocker else s[:, None]) - first
    near, far = np.min(np.abs(between), axis=1), np.max(np.abs(between), axis=1)
    # lengths whose sum is above the longest way, and whose difference is below the shortest
    total, less = far * rng.uniform(1.05, 2.0, dyads), near * rng.uniform(-0.9, 0.9, dyads)
    rod, arm, side = 0.5 * (total + less), 0.5 * (total - less), np.where(rng.uniform(size=dyads) < 0.5, 1, -1)
    v, sine = link_turn(between, rod[:, None], arm[:, None], side[:, None])
    n = len(t)
    placed, missed = _placed(task.targets, first[:, :n], v[:, :n])
    if task.arrows is not None:
        missed = missed + missed_arrows(v[:, :n], task.arrows)
    flat = ~(np.minimum(np.min(np.abs(sine), axis=1), np.min(np.abs(at.margin))) >= limits.least)
    k = np.argsort(np.where(flat, np.inf, missed))[:EACH]
    k = k[np.isfinite(missed[k]) & ~flat[k]]
    o_, w_, q = placed[k].T
    scale = np.abs(w_)
    in_world = s[k] * scale if curve.on_rocker else o_ + w_ * s[k]
    numbers = (o_, w_, o_ + w_ * d, 0.0 * w_, scale * (b + 1j * c), p[k] * scale, in_world, scale * (rod[k] + 1j * arm[k]), q * scale / w_)
    found = np.stack([part for z in numbers for part in (z.real, z.imag)], axis=-1)
    fine = curve.widest(found) <= task.size
    angles = np.broadcast_to(t, (int(np.count_nonzero(fine)), n))
    return task.begun(curve, Fitted(found[fine], (mode + 2 * side[k])[fine], angles, missed[k][fine]))


def _placed(targets: Complex, first: Complex, turn: Complex) -> tuple[Complex, Array]:
    """o, w, w q (k, 3) of least squares for curves first + q turn (k, n), and the squares (k,) that are left."""
    table = np.stack([np.ones_like(first), first, turn], axis=-1)
    bad = ~np.all(np.isfinite(table), axis=(1, 2))
    table[bad] = 0.0
    adjoint = np.conj(np.swapaxes(table, 1, 2))
    normal = adjoint @ table + 1e-12 * np.eye(3)
    found = np.linalg.solve(normal, adjoint @ targets[:, None])[..., 0]
    left = np.abs((table @ found[..., None])[..., 0] - targets) ** 2
    return np.asarray(found), np.asarray(np.where(bad, np.inf, np.sum(left, axis=1)))
