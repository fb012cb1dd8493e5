"""Error control against other people's engines: what a stated error costs here, and with the fastest of them.

Ours is the whole of `solve_to`, its probing and its check included. A peer is given its best setting for nothing: the
largest step (or tolerance) that meets the target is looked for against the reference, and only the run with it counts.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab.engines.peers import PEERS, PeerStopped
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Trace
from mechlab.lab.methods import PEER_METHODS, Method, Problem
from mechlab.studies.chart.score import Reference, score
from mechlab.tables import number, table

if TYPE_CHECKING:
    from mechlab.lab.accuracy.result import Solution
    from mechlab.studies.chart.data import Point

TARGETS = (1e-3, 1e-6, 1e-9)
"""Errors to be met [m or rad]."""
TOLERANCES = tuple(10.0**-k for k in range(2, 14))
HALVINGS = 16
COSTLY = (0.3, 3.0)
"""A peer is refined until a run costs FAR times as much as ours, at least and at most this CPU time [s]."""
FAR = 20.0
REPEATS, ENOUGH, MOST = 5, 0.05, 50
"""Medians are of so many runs, and of up to MOST of those that take no more than ENOUGH together [s]."""
CONTENDERS = 2
"""So many of the cheapest peers of a target are looked at again, with BISECTIONS settings between two of the sweep."""
BISECTIONS = 3


@dataclass(frozen=True)
class PeerRow:
    """One target [m or rad]: ours and the fastest peer that meets it; `peer` is empty when none does, with the best that
    they reach in `peer_error`. Missing numbers are nan."""

    target: float
    ours_cpu_s: float
    ours_error: float
    ours_method: str
    ours_reached: bool
    peer: str
    peer_step: float
    peer_cpu_s: float
    peer_error: float

    @property
    def ratio(self) -> float:
        """Our CPU time over the peer's; nan where one of them does not meet the target."""
        met = self.ours_reached and self.ours_error <= self.target
        return self.ours_cpu_s / self.peer_cpu_s if met and self.peer else math.nan

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; a missing number is null."""
        names = ("target", "ours_cpu_s", "ours_error", "peer_cpu_s", "peer_error", "peer_step", "ratio")
        numbers = {n: getattr(self, n) for n in names}
        shown = {n: x if math.isfinite(x) else None for n, x in numbers.items()}
        return shown | {"ours_method": self.ours_method, "ours_reached": self.ours_reached, "peer": self.peer or None}


@dataclass(frozen=True)
class PeerTable:
    """The comparison of a scene: a row for each target, every point of the peers, what could not be run and why."""

    rows: tuple[PeerRow, ...]
    points: tuple[Point, ...]
    skipped: dict[str, str]
    versions: dict[str, str]
    unit: str
    costly: float

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        rows = [r.to_dict() for r in self.rows]
        return {"peers": rows, "peers_refined_to_cpu_s": self.costly, "peer_versions": dict(self.versions)}

    def text(self) -> str:
        """The table for a person."""
        heads = [
            f"target [{self.unit}]",
            "--max-error: cpu_s",
            "error",
            "by",
            "fastest peer",
            "cpu_s",
            "error",
            "ratio",
        ]
        rows = [
            [
                f"{r.target:.0e}", number(r.ours_cpu_s), number(r.ours_error) + ("" if r.ours_reached else " (not reached)"),
                r.ours_method, r.peer or f"none reaches it in {self.costly:.2g} s", _shown(r.peer_cpu_s), _shown(r.peer_error),
                _shown(r.ratio),
            ]
            for r in self.rows
        ]  # fmt: skip
        with_versions = ", ".join(f"{n} {v}" for n, v in self.versions.items()) or "none installed"
        return "\n".join(
            [
                f"--max-error (its own probing included) against the fastest peer at its best setting ({with_versions}):",
                table(heads, rows),
            ]
        )


def _shown(x: float) -> str:
    return number(x) if math.isfinite(x) else "-"


def compare(problem: Problem, truth: Reference, progress: Callable[[str], None] = lambda line: None) -> PeerTable:
    """The comparison of a problem under TARGETS."""
    mine = []
    for target in TARGETS:
        progress(f"--max-error {target:g}")
        mine.append(ours(problem, truth, target))
    costly = min(max(FAR * max(x.cpu_s for x in mine), COSTLY[0]), COSTLY[1])
    search = _Search(problem, truth, costly)
    skipped: dict[str, str] = {}
    for m in PEER_METHODS:
        why = m.available(problem)
        if why:
            skipped[m.name] = why
            continue
        progress(m.name)
        search.sweep(m)
    rows = tuple(_row(target, x, search) for target, x in zip(TARGETS, mine, strict=True))
    return PeerTable(rows, tuple(search.points), skipped, _versions(), truth.unit, costly)


@dataclass(frozen=True)
class Ours:
    """What error control gave: CPU time [s] (of one run, or the median of several), true error, method, whether it says that
    the target is reached."""

    cpu_s: float
    error: float
    method: str
    reached: bool


def ours(problem: Problem, truth: Reference, target: float) -> Ours:
    """`solve_to` under a target [m or rad], once."""
    found = _solved(problem, target)
    away = score(problem, truth, Trace(found.q, found.v, found.cpu_s, 0))
    return Ours(found.cpu_s, away.error, found.method, found.reached)


def _solved(problem: Problem, target: float) -> Solution:
    from mechlab.lab.accuracy.solve import solve_to

    return solve_to(problem.design, problem.scene, target, problem.outputs)


def _once_more(times: list[float], repeats: int, costly: float) -> bool:
    """Whether a run is to be repeated for its median; costly [s]: no more than two of what takes longer together."""
    spent, n = sum(times), len(times)
    if n < repeats:
        return n < 2 or spent < costly
    return 1 < repeats and n < MOST and spent < ENOUGH


def _row(target: float, x: Ours, search: _Search) -> PeerRow:
    best = search.fastest(target)
    mine, theirs = _duel(search, target, best)
    told = (target, mine, x.error, x.method, x.reached)
    if best is None:
        nearest = min((p.error for p in search.points if p.ok), default=math.nan)
        return PeerRow(*told, "", math.nan, math.nan, nearest)
    return PeerRow(*told, best.method, best.step, theirs, best.error)


def _duel(search: _Search, target: float, best: Point | None) -> tuple[float, float]:
    """Median CPU times [s] of ours and of the peer's best setting, some runs of each in turns: what slows the machine for a
    while slows both. Each has run before."""
    mine, theirs = list[float](), list[float]()
    while True:
        before = len(mine) + len(theirs)
        for _ in range(REPEATS):
            if _once_more(mine, REPEATS, COSTLY[1]):
                mine.append(_solved(search.problem, target).cpu_s)
        for _ in range(REPEATS):
            if best is not None and _once_more(theirs, REPEATS, search.costly):
                theirs.append(search.method(best.method).run(search.problem, best.step).cpu_s)
        if len(mine) + len(theirs) == before:
            return statistics.median(mine), statistics.median(theirs) if theirs else math.nan


@dataclass
class _Search:
    """Runs of peers on a problem, judged by the truth."""

    problem: Problem
    truth: Reference
    costly: float
    points: list[Point] = field(default_factory=list)

    def sweep(self, m: Method) -> None:
        """Ever smaller values, until the sharpest target is met twice or a run is costly."""
        between = self.problem.scene.duration / self.problem.outputs
        values = TOLERANCES if m.control == "tolerance" else tuple(between / 2**k for k in range(HALVINGS))
        met = 0
        for value in values:
            p = self.point(m, value)
            self.points.append(p)
            met += p.ok and p.error <= min(TARGETS)
            if met >= 2 or (p.ok and p.cpu_s > self.costly) or p.status == "not run":
                return

    def point(self, m: Method, value: float, repeats: int = 1) -> Point:
        """One setting: median CPU time of `repeats` runs, and the error."""
        from mechlab.studies.chart.data import DIVERGED, NOT_RUN, OK, Point

        nan = math.nan
        lost = Point(m.name, value, m.control, nan, nan, nan, nan, nan, DIVERGED)
        times: list[float] = []
        while _once_more(times, repeats, self.costly):
            try:
                trace = m.run(self.problem, value)
            except PeerStopped as late:
                return replace(lost, status=NOT_RUN, reason=str(late))
            except MechlabError as why:
                return replace(lost, reason=str(why))
            times.append(trace.cpu_s)
        found = score(self.problem, self.truth, trace)
        if not math.isfinite(found.error):
            return replace(lost, reason=trace.reason or "the state is not finite")
        cpu = statistics.median(times)
        return Point(m.name, value, m.control, cpu, found.error, found.e_g, found.energy, found.gap, OK)

    @staticmethod
    def method(name: str) -> Method:
        """The peer's method of that name."""
        return next(m for m in PEER_METHODS if m.name == name)

    def fastest(self, target: float) -> Point | None:
        """The cheapest setting of all peers that meets the target: the medians of the cheapest ones of the sweep, and of
        settings between theirs and the next coarser one."""
        cheapest: dict[str, Point] = {}
        for p in sorted((p for p in self.points if p.ok and p.error <= target), key=lambda p: p.cpu_s):
            cheapest.setdefault(p.method, p)
        out = [self._sharpened(self.method(n), p, target) for n, p in list(cheapest.items())[:CONTENDERS]]
        return min(out, key=lambda p: p.cpu_s, default=None)

    def _sharpened(self, m: Method, good: Point, target: float) -> Point:
        """The largest value that meets the target, looked for by single runs; the median time of several runs with it."""
        low = good.step
        high = min((p.step for p in self.points if p.method == m.name and p.step > low), default=low)
        for _ in range(BISECTIONS):
            middle = self._on_grid(m, math.sqrt(low * high))
            if not 1.0001 * low < middle < 0.9999 * high:
                break
            p = self.point(m, middle)
            if p.ok and p.error <= target:
                low = middle
            else:
                high = middle
        found = self.point(m, low, REPEATS)
        return found if found.ok and found.error <= target else good

    def _on_grid(self, m: Method, value: float) -> float:
        """A step that divides the distance of the outputs."""
        if m.control == "tolerance":
            return value
        between = self.problem.scene.duration / self.problem.outputs
        return float(between / np.round(between / value))


def _versions() -> dict[str, str]:
    out = {}
    for name in PEERS:
        try:
            out[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return out


__all__ = ["TARGETS", "PeerRow", "PeerTable", "compare", "ours"]
