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
from dataclasses import dataclass, replace

import numpy as np

from mechlab.analytic.burmester import POSITIONS, leading_dyads
from mechlab.analytic.path_synthesis.atlas import starts
from mechlab.analytic.path_synthesis.curves import FOURBAR, SIZES, Array, Complex, points, widest
from mechlab.analytic.path_synthesis.fit import Fitted, Limits, fit
from mechlab.errors import MechlabError
from mechlab.progress import counted, part, silent

TURNS = np.radians([50.0, 90.0, 140.0, 200.0, 270.0, 330.0])
"""Guesses of the crank's turn from the first point to the last, where no timing is prescribed."""
SUITED = 14
"""Most points by which the atlas is searched; of more, evenly spaced ones."""
KEPT = 48
"""Most linkages that are refined to the end."""
EACH = 16
"""Starts of the atlas for each guess of free crank angles."""
EXACT = 1e-9
"""Largest distance from a point, relative to the extent of the points, of a linkage that passes through it."""
DENSE = 361
"""Crank angles at which a linkage is followed from the first point to the last."""
OVER = np.radians(15.0)
"""What the crank may turn beyond a full turn, at the end of a closed path."""
RATIOS = (-1, 1, -2, 2)
"""Gear ratios of five-bars that are tried, second crank to first."""


@dataclass(frozen=True)
class PathTask:
    """Points (n,) as x + i y [m] in their order; timing: crank angles (n,) [rad], or None where they are free; size: longest bar [m];
    least: smallest angle between coupler and link [rad]. Raises MechlabError for points that coincide or are not finite, and for crank
    angles that do not grow, or fall, within a turn."""

    targets: Complex
    timing: Array | None
    size: float
    least: float = 0.0

    def __post_init__(self) -> None:
        p, t = self.targets, self.timing
        if not np.all(np.isfinite(p)) or (t is not None and not np.all(np.isfinite(t))):
            raise MechlabError("path synthesis: points and crank angles must be finite numbers.")
        for k in np.flatnonzero(np.abs(np.diff(p)) <= 1e-9 * self.extent):
            raise MechlabError(f"path synthesis: points {k + 1} and {k + 2} are the same.")
        if t is not None and (np.ptp(np.sign(np.diff(t))) > 0.0 or t[0] == t[1] or np.ptp(t) > 2.0 * np.pi + 1e-9):
            raise MechlabError("path synthesis: the crank angles must grow, or fall, from point to point, within one turn.")

    @property
    def extent(self) -> float:
        """Twice the largest distance of a point from the middle of all [m]."""
        return 2.0 * float(np.max(np.abs(self.targets - self.targets.mean())))

    @property
    def limits(self) -> Limits:
        """What every step of the fit keeps to."""
        return Limits(self.size, float(np.sin(self.least)))

    @property
    def timed(self) -> bool:
        """True where the crank angles are given."""
        return self.timing is not None


@dataclass(frozen=True)
class PathLinkage:
    """A linkage: its row and mode (`curves`), ratio of the gears (0: a four-bar), crank angles (n,) of the points, counted from the crank's
    direction in the row, distances (n,) from the points [m], least angle between coupler and link on the way [rad], whether the crank
    turns fully. defect: "", "branch" (it does not get from the first point to the last without being taken apart) or "order"."""

    row: Array
    mode: int
    ratio: int
    angles: Array
    distances: Array
    least_transmission_angle: float
    crank_turns: bool
    defect: str

    @property
    def squares(self) -> float:
        """Sum of squared distances [m^2]."""
        return float(np.sum(self.distances**2))


def path_fourbars(task: PathTask, progress: Callable[[int, int], None] = silent) -> tuple[PathLinkage, ...]:
    """Four-bars, the best first: exact ones in the order of their transmission angle, the others in that of their squares; also those with
    a defect. progress hears (done, total)."""
    if task.timed and len(task.targets) == POSITIONS:
        found = [_judged(f, 0, task, 1e-6) for f in _five(task)]
        if any(not f.defect and f.least_transmission_angle >= task.least for f in found):
            return _ordered(found, task)
    first = np.arange(len(task.targets))
    few = np.unique(np.linspace(0, first[-1], SUITED).round().astype(int)) if len(first) > SUITED else first
    fewer = replace(task, targets=task.targets[few], timing=None if task.timing is None else task.timing[few])
    begun = _joined([_begun(fewer, t) for t in counted(list(_timings(fewer)), part(progress, 0, 70))])
    begun = fit(fewer.targets, begun, 0.0, FOURBAR, task.timed, task.limits, 30 if task.timed else 12)
    begun = _best(begun, task, int(np.clip(2400 // len(first), 16, 2 * KEPT)))
    angles = np.array([np.interp(first, few, a) for a in begun.angles]).reshape(-1, len(first))
    if task.timing is not None:
        angles = np.broadcast_to(task.timing, angles.shape)
    done = fit(task.targets, replace(begun, angles=angles), 0.0, FOURBAR, task.timed, task.limits, 60)
    done = fit(task.targets, _best(done, task, int(np.clip(600 // len(first), 6, KEPT // 2))), 0.0, FOURBAR, task.timed, task.limits, 300)
    return _ordered([_judged(f, 0, task) for f in _rows(_best(done, task, KEPT))], task)


def path_fivebars(
    task: PathTask, base: Sequence[PathLinkage], progress: Callable[[int, int], None] = silent
) -> tuple[PathLinkage, ...]:
    """Geared five-bars that grow from four-bars: from each, a small second crank in four directions, in each of the ratios."""
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
        done = fit(task.targets, start, float(ratio), np.arange(SIZES), task.timed, task.limits, 100)
        out += [_judged(f, ratio, task) for f in _rows(_best(done, task, KEPT))]
    return _ordered(out, task)


Found = tuple[Array, int, Array]
"""Row, mode, crank angles."""


def _timings(task: PathTask) -> Iterable[Array]:
    """Crank angles (n,) to begin with: those given, or turns shared out as the way, and as the points, are."""
    if task.timing is not None:
        return [task.timing]
    steps = np.abs(np.diff(task.targets))
    even, way = np.linspace(0.0, 1.0, len(task.targets)), np.concatenate([[0.0], np.cumsum(steps) / np.sum(steps)])
    shares = [way] if np.max(np.abs(way - even)) < 0.03 else [way, 0.5 * (way + even), even]
    # at the ends of a stroke a crank turns further for the same way than in its middle
    shares.append(np.arccos(np.clip(1.0 - 2.0 * way, -1.0, 1.0)) / np.pi)
    gap, whole = abs(task.targets[-1] - task.targets[0]), float(np.sum(steps))
    # the ends of a closed path are as near as its other points: then the crank makes a turn, less their gap
    closed = len(steps) > 6 and gap < 2.0 * float(np.max(steps))
    turns = [2.0 * np.pi * whole / (whole + gap)] if closed else TURNS
    return [sign * turn * share for share in shares for turn in turns for sign in (1.0, -1.0)]


def _begun(task: PathTask, t: Array) -> Fitted:
    """The best of the atlas for these crank angles."""
    found = starts(task.targets, t, 4 * KEPT if task.timed else EACH, np.sin(task.least))
    kept = widest(found.rows) <= task.size
    angles = np.broadcast_to(t, (int(np.count_nonzero(kept)), len(t)))
    return Fitted(found.rows[kept], found.modes[kept], angles, found.missed[kept])


def _joined(parts: list[Fitted]) -> Fitted:
    return Fitted(*(np.concatenate([getattr(p, n) for p in parts]) for n in ("rows", "modes", "angles", "missed")))


def _best(found: Fitted, task: PathTask, count: int) -> Fitted:
    """The best `count` that differ by more than 1e-3 of the size of the points, or of the linkage."""
    kept = list[int]()
    for k in np.argsort(found.missed):
        if len(kept) == count or not np.isfinite(found.missed[k]):
            break
        row = found.rows[k]
        apart = 1e-3 * max(task.extent, float(np.max(np.abs(row))))
        same = np.max(np.abs(found.rows[kept] - row), axis=1) <= apart
        if not np.any(same & (found.modes[kept] == found.modes[k])):
            kept.append(int(k))
    return Fitted(*(getattr(found, n)[kept] for n in ("rows", "modes", "angles", "missed")))


def _rows(found: Fitted) -> Iterable[Found]:
    return ((row, int(mode), angles) for row, mode, angles in zip(found.rows, found.modes, found.angles, strict=True))


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


def _judged(found: Found, ratio: int, task: PathTask, near: float = 1.0) -> PathLinkage:
    """Follows the linkage from the first point to the last; it must come as near to all as `near` times their extent."""
    row, mode, t = found
    way, turn = np.linspace(t[0], t[-1], DENSE), np.linspace(0.0, 2.0 * np.pi, DENSE)
    at, path, round_ = (points(row[None], np.array([mode]), ratio, x[None]) for x in (t, way, turn))
    distances = np.abs(at.point[0] - task.targets)
    assembles = bool(np.all(np.isfinite(path.margin)))
    # a four-bar that meets one of five points in its other mode closes there, but elsewhere
    reached = assembles and bool(np.max(distances) <= near * task.extent)
    ordered = bool(np.ptp(np.sign(np.diff(t))) == 0.0 and np.ptp(t) <= 2.0 * np.pi + OVER)
    least = float(np.arcsin(np.clip(np.min(np.abs(path.margin)), 0.0, 1.0))) if assembles else 0.0
    defect = ("" if ordered else "order") if reached else "branch"
    return PathLinkage(row, mode, ratio, t, distances, least, bool(np.all(np.isfinite(round_.margin))), defect)


def _ordered(found: Iterable[PathLinkage], task: PathTask) -> tuple[PathLinkage, ...]:
    def key(f: PathLinkage) -> tuple[bool, float]:
        exact = bool(np.max(f.distances) < EXACT * task.extent)
        return (not exact, -f.least_transmission_angle if exact else f.squares)

    return tuple(sorted(found, key=key))
