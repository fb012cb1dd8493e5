"""Linkages whose coupler point passes through given points in their order: four-bars, and geared five-bars where those do not reach.

With prescribed timing (crank angles of the points, up to a common offset) five points have finitely many four-bars, all of them found in
closed form. Seen from the crank the point P_k stands at e^(-i t_k) (P_k - O) and keeps its distance from the crank pin W:

    | e^(-i t_k) P_k - e^(-i t_k) O - W | = const,    k = 1 ... 5

which is Burmester's problem for the positions (e^(-i t_k) P_k, -t_k) with the body point -O and the pivot W. Each solution fixes the
angles of the coupler, and those a second problem of Burmester with the link. More points, fewer, or free timing: least squares from the
best starts of an atlas (`atlas`), for free timing with several guesses of the crank angles, which are then unknown as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.burmester import POSITIONS, LeadingFourbar, leading_dyads, leading_fourbars
from mechlab.analytic.path_synthesis.atlas import starts
from mechlab.analytic.path_synthesis.curves import Array, Complex, Geared, widest
from mechlab.analytic.path_synthesis.fit import Fitted, fit
from mechlab.analytic.path_synthesis.task import Found, PathLinkage, PathTask, best, joined, judged, one_by_one, ordered
from mechlab.progress import counted, part, silent

FOUR = Geared()

TURNS = np.radians([50.0, 90.0, 140.0, 200.0, 270.0, 330.0])
"""Guesses of the crank's turn from the first point to the last, where no timing is prescribed."""
SUITED = 14
"""Most points by which the atlas is searched; of more, evenly spaced ones."""
KEPT = 48
"""Most linkages that are refined to the end."""
EACH = 16
"""Starts of the atlas for each guess of free crank angles."""
RATIOS = (-1, 1, -2, 2)
"""Gear ratios of five-bars that are tried, second crank to first."""


def path_fourbars(task: PathTask, progress: Callable[[int, int], None] = silent) -> tuple[PathLinkage, ...]:
    """Four-bars, the best first: exact ones in the order of their transmission angle, the others in that of their squares; also those with
    a defect. progress hears (done, total)."""
    return tuple(task.from_unit(f) for f in _fourbars(task.unit, progress))


def _fourbars(task: PathTask, progress: Callable[[int, int], None]) -> tuple[PathLinkage, ...]:
    if task.timed and task.turns is None and len(task.targets) == POSITIONS:
        found = [judged(f, FOUR, task, 1e-6) for f in _five(task)]
        if any(not f.defect and f.least_transmission_angle >= task.least for f in found):
            return ordered(found, task)
    exact = list[PathLinkage]()
    if not task.timed and task.turns is not None and len(task.targets) == POSITIONS:
        exact = [judged(f, task.curve(FOUR), task, 1e-6) for f in _carrying(task, task.turns)]
    first, few = np.arange(len(task.targets)), suited(task)
    timing, turns = (None if z is None else z[few] for z in (task.timing, task.turns))
    fewer = replace(task, targets=task.targets[few], timing=timing, turns=turns)
    begun = joined([_begun(fewer, t) for t in counted(timings(fewer), part(progress, 0, 70))])
    curve = task.curve(FOUR)
    begun = fit(fewer.aims, begun, curve, task.timed, task.limits, 30 if task.timed else 12)
    begun = best(begun, task, int(np.clip(2400 // len(first), 16, 2 * KEPT)))
    angles = np.array([np.interp(first, few, a) for a in begun.angles]).reshape(-1, len(first))
    if task.timing is not None:
        angles = np.broadcast_to(task.timing, angles.shape)
    done = fit(task.aims, replace(begun, angles=angles), curve, task.timed, task.limits, 60)
    done = fit(task.aims, best(done, task, int(np.clip(600 // len(first), 6, KEPT // 2))), curve, task.timed, task.limits, 300)
    return ordered([*exact, *(judged(f, curve, task) for f in one_by_one(best(done, task, KEPT)))], task)


def path_fivebars(
    task: PathTask, base: Sequence[PathLinkage], progress: Callable[[int, int], None] = silent
) -> tuple[PathLinkage, ...]:
    """Geared five-bars that grow from four-bars: from each, a small second crank in four directions, in each of the ratios."""
    return tuple(task.from_unit(f) for f in _fivebars(task.unit, [task.to_unit(f) for f in base], progress))


def _fivebars(task: PathTask, base: Sequence[PathLinkage], progress: Callable[[int, int], None]) -> tuple[PathLinkage, ...]:
    chosen = [f for f in base if not f.defect][: int(np.clip(500 // len(task.targets), 2, 8))]
    if not chosen:
        return ()
    rows = np.repeat([f.row for f in chosen], 4, axis=0)
    small = 0.05 * np.hypot(rows[:, 2], rows[:, 3])
    turn = np.tile(0.5 * np.pi * np.arange(4), len(chosen)) + 0.3
    rows[:, 6], rows[:, 7] = small * np.cos(turn), small * np.sin(turn)
    start = Fitted(rows, np.repeat([f.mode for f in chosen], 4), np.repeat([f.angles for f in chosen], 4, axis=0), np.zeros(len(rows)))
    out = list[PathLinkage]()
    for ratio in counted(RATIOS, progress):
        curve = Geared(float(ratio))
        done = fit(task.targets, start, curve, task.timed, task.limits, 100)
        out += [judged(f, curve, task) for f in one_by_one(best(done, task, KEPT))]
    return ordered(out, task)


def suited(task: PathTask) -> NDArray[np.int_]:
    """The points by which the atlas is searched."""
    count = len(task.targets)
    return np.unique(np.linspace(0, count - 1, min(count, SUITED)).round().astype(int))


def timings(task: PathTask) -> list[Array]:
    """Crank angles (n,) to begin with: those given, or turns shared out as the way, and as the points, are."""
    if task.timing is not None:
        return [task.timing]
    steps = task.ways
    even, way = np.linspace(0.0, 1.0, len(task.targets)), np.concatenate([[0.0], np.cumsum(steps) / np.sum(steps)])
    shares = [way] if np.max(np.abs(way - even)) < 0.03 else [way, 0.5 * (way + even), even]
    # at the ends of a stroke a crank turns further for the same way than in its middle
    shares.append(np.arccos(np.clip(1.0 - 2.0 * way, -1.0, 1.0)) / np.pi)
    gap, whole = float(np.linalg.norm(task.aims[-1] - task.aims[0])), float(np.sum(steps))
    # the ends of a closed path are as near as its other points: then the crank makes a turn, less their gap
    closed = len(steps) > 6 and gap < 2.0 * float(np.max(steps))
    turns = [2.0 * np.pi * whole / (whole + gap)] if closed else TURNS
    return [sign * turn * share for share in shares for turn in turns for sign in (1.0, -1.0)]


def _begun(task: PathTask, t: Array) -> Fitted:
    """The best of the atlas for these crank angles."""
    found = starts(task.targets, t, 4 * KEPT if task.timed else EACH, np.sin(task.least), task.arrows)
    kept = widest(found.rows) <= task.size
    angles = np.broadcast_to(t, (int(np.count_nonzero(kept)), len(t)))
    return task.begun(FOUR, Fitted(found.rows[kept], found.modes[kept], angles, found.missed[kept]))


def _five(task: PathTask) -> Iterable[Found]:
    """All four-bars through five points at their crank angles, in closed form."""
    targets, t, small = task.targets, np.asarray(task.timing), 1e-6 * task.extent
    for first in leading_dyads(targets * np.exp(-1j * t), -t):
        o, w = -first.point, first.pivot
        turns = np.angle(targets - o - w * np.exp(1j * t))
        own = -first.length  # the crank pin, in the axes of the coupler: P is their origin, x points from pin to P
        for second in leading_dyads(targets, turns):
            span = second.point - own
            if abs(span) < small or abs(w) < small or second.length < small:
                continue
            p = first.length * abs(span) / span
            row = np.array([o.real, o.imag, w.real, w.imag, second.pivot.real, second.pivot.imag, 0.0, 0.0, abs(span), second.length,
                            p.real, p.imag])  # fmt: skip
            pin, joint = o + w * np.exp(1j * t[0]), targets[0] + np.exp(1j * turns[0]) * second.point
            side = np.imag(np.conj(second.pivot - pin) * (joint - pin))
            if widest(row) <= task.size:
                yield row, 1 if side > 0 else -1, t


def leading_row(f: LeadingFourbar, places: Complex, turns: Array) -> Found:
    """A four-bar that carries a body through positions exactly; its coupler point is the origin of the body. The crank's direction in the
    row is the x axis, so that the crank angles are counted from there."""
    pin, joint = (places + np.exp(1j * turns) * dyad.point for dyad in (f.first, f.second))
    side = np.imag(np.conj(f.second.pivot - pin) * (joint - pin))[0]
    span, o, d = f.second.point - f.first.point, f.first.pivot, f.second.pivot
    point = -f.first.point * abs(span) / span
    row = np.array([o.real, o.imag, f.first.length, 0.0, d.real, d.imag, 0.0, 0.0, f.coupler, f.second.length, point.real, point.imag])
    return row, 1 if side > 0 else -1, np.unwrap(np.angle(pin - o))


def _carrying(task: PathTask, turns: Array) -> Iterable[Found]:
    """All four-bars through five positions that need not be taken apart, in closed form."""
    for f in leading_fourbars(task.targets, turns):
        row, mode, t = leading_row(f, task.targets, turns)
        if f.same_mode and widest(row) <= task.size:
            start = task.begun(FOUR, Fitted(row[None], np.array([mode]), t[None], np.zeros(1)))
            yield start.rows[0], mode, t
