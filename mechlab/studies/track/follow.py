"""From one closed pose to the next: steps of the QP, each closed again by Newton, until the priorities can gain no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.track.closed import Closed
from mechlab.studies.track.goals import Goal
from mechlab.studies.track.limits import Bound, bound_rows
from mechlab.studies.track.qp import lexicographic

STEPS = 100
"""Most steps for one pose; a target within reach takes three to five."""
LONGEST = 0.3
"""Largest change of a coordinate in one step [rad, sizes of the mechanism]."""
FARTHEST = 0.35
"""Largest change from one pose to the next; beyond it the way is halved, so that the assembly mode is kept."""
HALVINGS, RETRIES = 7, 1
"""How often the way is halved where it is too far, and where the search does not settle."""
HALVED = 8
"""How often a step that loses is halved."""
SMALL = 0.03
"""A step that is small enough for its losses to be of second order [rad, sizes]."""
STILL = 1e-12
"""A step below this ends the search."""
SETTLED = 1e-9
"""Below this a step that no direction is free to correct has squared its error away: the next one is not taken."""
NEGLIGIBLE = 1e-7
"""A search whose last step is below this has settled as far as rounding lets it."""
NO_GAIN = 1e-9
"""Share of what is missing below which a step that promises no more is none; beyond reach the steps shrink slowly, by a factor each."""
PRESSING = 1e-9
"""A bound whose multiplier is larger is what stops the motion."""


@dataclass(frozen=True)
class Pose:
    """A closed pose: coordinates, the bounds that stop the motion there, the steps that it took, whether the search ended, and where it
    did not whether it had nothing more to gain."""

    q: Array
    pressing: tuple[tuple[Bound, bool], ...]
    steps: int
    settled: bool
    nothing_to_gain: bool = False


class Follower:
    """Leads a `Closed` to targets, goal by goal in the order of their priorities."""

    def __init__(self, closed: Closed, goals: Sequence[Goal]) -> None:
        self.closed, self.goals = closed, tuple(goals)
        self.priorities = sorted({g.priority for g in self.goals})
        first = [g for g in self.goals if g.priority == self.priorities[0]] if self.goals else []
        closed.aim(lambda: np.vstack([np.zeros((0, closed.m.nv)), *(g.rows(closed.plant) for g in first)]))

    def values(self) -> list[Array]:
        """What the goals have at the present pose."""
        return [g.value(self.closed.plant) for g in self.goals]

    def lead(
        self, q: Array, begin: Sequence[Array], end: Sequence[Array], bounds: tuple[Bound, ...], depth: int = 0
    ) -> Pose:
        """From the closed pose q, where the targets are `begin`, to the targets `end`."""
        found = self._search(q, end, bounds)
        far = float(np.max(np.abs(self.closed.between(q, found.q)), initial=0.0))
        if depth >= (HALVINGS if far > FARTHEST else RETRIES) or (far <= FARTHEST and found.settled):
            return found
        middle = [g.blend(a, b, 0.5) for g, a, b in zip(self.goals, begin, end, strict=True)]
        half = self.lead(q, begin, middle, bounds, depth + 1)
        last = self.lead(half.q, middle, end, bounds, depth + 1)
        return replace(last, steps=found.steps + half.steps + last.steps)

    def _search(self, start: Array, targets: Sequence[Array], bounds: tuple[Bound, ...]) -> Pose:
        """Steps from a closed pose; least motion is counted from there."""
        closed, q = self.closed, start
        pressing: tuple[tuple[Bound, bool], ...] = ()
        closed.set(q)
        for count in range(1, STEPS + 1):
            basis = closed.basis
            levels = self._levels(basis, targets, closed.between(start, q))
            rows, low, high = bound_rows(closed, basis, bounds)
            for careful in (False, True):
                step = lexicographic(levels, rows, low, high, careful)
                pressing = tuple((b, m > 0) for b, m in zip(bounds, step.multipliers, strict=True) if abs(m) > PRESSING)
                dv = basis @ step.z
                size = float(np.max(np.abs(dv), initial=0.0))
                if size < STILL:
                    return Pose(q, pressing, count, True)
                taken = self._take(q, dv, targets, levels[0], step.z, HALVED if careful else 1)
                if taken is not None:
                    break
            else:
                return Pose(q, pressing, count, size < NEGLIGIBLE)
            promised = float(np.linalg.norm(levels[0][1])) - float(np.linalg.norm(levels[0][1] - levels[0][0] @ step.z))
            q = taken
            if size < SETTLED and not step.free and not pressing:
                return Pose(q, pressing, count, True)
        return Pose(q, pressing, STEPS, size < NEGLIGIBLE, promised < NO_GAIN * float(np.linalg.norm(levels[0][1])))

    def _take(
        self, q: Array, dv: Array, targets: Sequence[Array], first: tuple[Array, Array], z: Array, tries: int
    ) -> Array | None:
        """The closed pose after the step dv, or the first of its halves, that does not lose at the first priority; None, at q,
        where none does.

        What bounds make it lose by its rows is no loss. A step for the lower priorities, or along a bound, loses with the
        square of its size; the next step gains that back.
        """
        size, unmet = float(np.max(np.abs(dv))), float(np.linalg.norm(first[1]))
        scale = min(1.0, LONGEST / size)
        for _ in range(tries):
            squared = (scale * size) ** 2
            trial = self.closed.close(self.closed.moved(q, scale * dv))
            after = self._unmet(self.closed.set(trial.q), targets)
            bent = squared if unmet <= 0.01 * squared or scale * size < SMALL else 0.0
            expected = float(np.linalg.norm(first[1] - scale * (first[0] @ z)))
            if trial.closed and after <= max(unmet, expected) * (1.0 + 1e-9) + bent + 1e-13:
                return trial.q
            scale *= 0.5
        self.closed.set(q)
        return None

    def _unmet(self, closed: Closed, targets: Sequence[Array]) -> float:
        """Norm of what is missing at the first priority."""
        missing = [
            g.weight * g.missing(g.value(closed.plant), t)
            for g, t in zip(self.goals, targets, strict=True)
            if g.priority == self.priorities[0]
        ]
        return float(np.linalg.norm(np.concatenate(missing))) if missing else 0.0

    def _levels(self, basis: Array, targets: Sequence[Array], moved: Array) -> list[tuple[Array, Array]]:
        """(rows, right side) of each priority over the free motions, and last the least motion from the start."""
        out = []
        for priority in self.priorities:
            chosen = [(g, t) for g, t in zip(self.goals, targets, strict=True) if g.priority == priority]
            rows = [g.weight * (g.rows(self.closed.plant) @ basis) for g, _ in chosen]
            sides = [g.weight * g.missing(g.value(self.closed.plant), t) for g, t in chosen]
            out.append((np.vstack(rows), np.concatenate(sides)))
        return [*out, (np.eye(basis.shape[1]), -(basis.T @ moved))]
