"""Walking legs at equal step and equal weight: how long a foot stands, how level it goes, how high it lifts, what the crank carries."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.entry import Entry
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.compare.result import Column, Comparison, Panel, Row
from mechlab.studies.cycle.cycle import run_cycle

Flags = NDArray[np.bool_]
FAMILY = "walking"
POINTS = 360
FEET = ("foot", "foot_1", "foot_l")
"""The point that walks, the first that a mechanism has."""
LEVEL = 0.02
"""A foot stands while it is no higher over its lowest place than this part of the length of its path."""
SLOW = 1e-3
"""Crank speed [rad/s] at which the drive carries weights alone."""

COLUMNS = (
    Column("step", "step", "longest path", "way of the foot while it stands, over the length of its path from end to end", 1),
    Column("lift", "lift", "step", "how high the foot rises over its lowest place: the obstacle it clears", 1),
    Column("straightness", "rise while standing", "step", "height of the path while the foot stands: how much the body bobs", -1),
    Column("duty", "stands for", "turn", "share of the turn of an even crank", 1),
    Column("legs", "feet that always stand", "", "feet on one crank, evenly spread, of which one stands at every moment", -1),
    Column("evenness", "least over mean speed", "", "speed of the foot over the ground at an even crank, in that part of its stance, one "
           "over the feet of a turn long, in which it is most even", 1),
    Column("peak_torque", "peak torque for the body", "weight x step", "drive torque that carries a weight on the standing foot, by "
           "virtual work the weight times the rise of the foot per angle of the crank", -1),
    Column("own_torque", "peak torque for the leg", "its weight x step", "drive torque that turns the leg slowly against "
           "its own weight", -1),
)  # fmt: skip
TEXT = (
    "A foot counts as standing while it is no higher over its lowest place than a fiftieth of its path is long. Lengths are compared in "
    "steps, torques in weight times step, so that legs of all sizes stand side by side.",
    "A level stance at even speed carries the body without bobbing and asks the crank for little; a long swing lifts the foot over "
    "obstacles. No leg has both for nothing.",
)


@dataclass(frozen=True, eq=False)
class Stance:
    """One turn of a foot: crank angle phi (n,), place x, z (n,) [m]; `stands` (n,) while it stands, without a gap around the turn."""

    phi: Array
    x: Array
    z: Array

    @property
    def stands(self) -> Flags:
        """The longest stretch at the ground, cyclic; the last sample of the turn is the first."""
        low = self.z[:-1] - self.z[:-1].min() <= LEVEL * float(np.ptp(self.x))
        n = len(low)
        if low.all():
            return np.append(low, True)
        first = int(np.flatnonzero(~low)[0])
        rolled = np.roll(low, -first)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], rolled.astype(int), [0]])))
        begin, end = max(zip(edges[::2], edges[1::2], strict=True), key=lambda e: e[1] - e[0])
        kept = np.zeros(n, dtype=bool)
        kept[begin:end] = True
        kept = np.roll(kept, first)
        return np.append(kept, kept[0])

    def numbers(self, force: Array, weight: float) -> dict[str, float | None]:
        """Key of COLUMNS -> number. force (n,): that of the drive against the weight of the leg."""
        from scipy.interpolate import CubicSpline

        stands = self.stands
        step = float(np.ptp(self.x[stands]))
        rates = [CubicSpline(self.phi, np.append(c[:-1], c[0]), bc_type="periodic")(self.phi, 1) for c in (self.x, self.z)]
        duty = float(stands[:-1].mean())
        feet = ceil(1.0 / duty - 1e-9)
        return {
            "step": step / float(np.ptp(self.x)), "lift": float(np.ptp(self.z)) / step,
            "straightness": float(np.ptp(self.z[stands])) / step, "duty": duty, "legs": float(feet),
            "evenness": _evenness(rates[0], stands, feet), "peak_torque": float(np.abs(rates[1][stands]).max()) / step,
            "own_torque": float(np.abs(force).max()) / (weight * step),
        }  # fmt: skip


def _evenness(rate: Array, stands: Flags, feet: int) -> float:
    """Least over mean of the size of a periodic rate (n + 1,) in the window of 1 / feet of a turn, inside the stance, where it is
    largest; 0 where the rate changes its sign."""
    n = len(rate) - 1
    begin = int(np.flatnonzero(stands[:-1] & ~np.roll(stands[:-1], 1))[0]) if not stands.all() else 0
    window = n // feet
    standing = np.roll(rate[:-1], -begin)[: max(window, int(stands[:-1].sum()))]
    views = np.lib.stride_tricks.sliding_window_view(standing * np.sign(np.median(standing)), window)
    return float(max(0.0, (views.min(axis=1) / np.maximum(views.mean(axis=1), 1e-300)).max()))


def legs(entries: Iterable[Entry]) -> Comparison:
    """The comparison of all entries with a foot whose path has one crank."""
    rows, paths, heights, skipped = [], {}, {}, []
    for entry in entries:
        p = entry.parameters()
        m = entry.build(p, list(entry.fidelities)[-1])
        path = {} if entry.path is None else entry.path(p)
        foot = next((f for f in FEET if f in {x.name for x in m.frames}), None)
        if len(path) != 1 or foot is None:
            skipped.append(entry.name)
            continue
        (drive, span), = path.items()
        cycle = run_cycle(m, motion={f"{drive}_rate": SLOW}, drive=drive, span=span, points=POINTS)
        stance = Stance(cycle[drive], cycle[f"{foot}_x"], cycle[f"{foot}_z"])
        gravity = float(np.linalg.norm(m.gravity))
        numbers = stance.numbers(cycle[f"{drive}_force"], m.total_mass * gravity)
        rows.append(Row(entry.name, entry.title, numbers, difference=max(cycle.witnesses.values(), default=0.0)))
        stands = stance.stands
        step = float(np.ptp(stance.x[stands]))
        paths[entry.title] = (stance.x - stance.x[stands].min()) / step, (stance.z - stance.z.min()) / step
        turn = np.linspace(0.0, 1.0, POINTS + 1)
        begin = int(np.flatnonzero(stands[:-1] & ~np.roll(stands[:-1], 1))[0]) if not stands.all() else 0
        rolled = np.roll(stance.z[:-1], -begin)
        heights[entry.title] = turn, np.append(rolled - rolled.min(), rolled[0] - rolled.min()) / step
    panels = (
        Panel("Path of the foot", "along the ground [step]", "height [step]", paths, equal=True),
        Panel("Height of the foot", "turn of the crank, from touching down", "height [step]", heights),
    )
    order = tuple(sorted(rows, key=lambda r: r.values["straightness"] or 0.0))
    return Comparison("walking", "Which leg walks most evenly?", TEXT, COLUMNS, order, panels, tuple(skipped))
