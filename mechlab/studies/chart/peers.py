"""CPU time for a stated error: `--max-error` against the fastest of the other engines, both by the same clock.

Our cost is that of the whole call up to the returned recording: models built, since everything that was kept is forgotten
before, trial runs, checks, channels. That of another engine (a peer) is building its model, stepping and output. Imports count on
neither side. The peer is given the closed start of the scene, and the search for its best setting is free: the largest step (or
tolerance) that meets the target is found with the reference, and only its run counts.
"""

from __future__ import annotations

import inspect
import math
import statistics
import sys
from collections.abc import Callable, Iterator
from dataclasses import field, replace
from functools import partial
from importlib import metadata

import numpy as np

from mechlab.engines.peers.engine import CAUTIONS, PEERS
from mechlab.engines.peers.process import PeerStopped
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording, Trace
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.methods import PEER_METHODS, Method, Problem
from mechlab.lab.run import run_scene
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import silent
from mechlab.studies.chart.data import DIVERGED, NOT_RUN, OK, ChartPoint, PeerRow, PeerTable
from mechlab.studies.chart.score import Reference, score

TARGETS = (1e-3, 1e-6, 1e-9)
"""Errors to be met [m or rad]."""
TOLERANCES = tuple(10.0**-k for k in range(2, 14))
HALVINGS = 16
COSTLY = (0.3, 3.0)
"""A peer is refined until a run costs FAR times as much CPU time as ours; the limit lies within these bounds [s]."""
FAR = 3.0
REPEATS, ENOUGH_S, REPEATS_LIMIT = 5, 0.05, 50
"""A median is taken of REPEATS runs; short runs are repeated until they take ENOUGH_S [s] together, REPEATS_LIMIT at
most."""
OF_PROCESS = ("mechlab.integrate.", "mechlab.algebra_threads")
"""Modules whose tables know no models: those of numerical methods, and the libraries that are loaded."""
CONTENDERS = 2
"""Number of cheapest peers of a target that are timed again, after up to BISECTIONS settings between two of the
sweep."""
BISECTIONS = 3


def compare(problem: Problem, truth: Reference, progress: Callable[[int], None] = silent) -> PeerTable:
    """The comparison of a problem under TARGETS. progress: called with the number of targets and methods that are done."""
    mine = []
    for k, target in enumerate(TARGETS):
        progress(k)
        mine.append(ours(problem, truth, target))
    costly = min(max(FAR * max(x.cpu_s for x in mine), COSTLY[0]), COSTLY[1])
    search = _Search(problem, truth, costly)
    skipped: dict[str, str] = {}
    for k, m in enumerate(PEER_METHODS):
        progress(len(TARGETS) + k)
        why = m.available(problem)
        if why:
            skipped[m.name] = why
            continue
        search.sweep(m)
    rows = tuple(_row(target, x, search) for target, x in zip(TARGETS, mine, strict=True))
    return PeerTable(rows, tuple(search.points), skipped, _versions(), truth.unit, costly, tuple(_cautions(search)))


@dataclass(frozen=True)
class Ours:
    """A run with error control: CPU time of all of it [s], true error [m or rad], the method that it chose, and whether it reports
    the target as reached."""

    cpu_s: float
    error: float
    method: str
    reached: bool


def ours(problem: Problem, truth: Reference, target: float) -> Ours:
    """A run under a target [m or rad], and the name of the method that it takes."""
    method = solve_to(problem.design, problem.scene, target, problem.outputs).method
    cpu_s, made = whole_run(problem, target)
    at = np.searchsorted(made.t, np.linspace(0.0, problem.scene.duration, problem.outputs + 1) * (1.0 - 1e-12))
    at = at[at < len(made.t)]
    errors = score(problem, truth, Trace(made.q[at], made.v[at], cpu_s, 0))
    return Ours(cpu_s, errors.error, method, made.health.finding("max_error").severity == "ok")


def whole_run(problem: Problem, target: float) -> tuple[float, Recording]:
    """CPU time [s] of a run under a target, from the call to the recording, without imports, and the recording.

    Nothing is kept from earlier runs: a peer builds its model in each run too.
    """
    _forget()
    scene = problem.scene
    made = run_scene(
        replace(problem.design), scene.name, fidelity=scene.fidelity, duration=scene.duration, max_error=target
    )
    return made.cost.total_s - made.cost.parts.imports, made


def _forget() -> None:
    """Empty every table of results on models that the package keeps between calls.

    What belongs to the process, as imports do, stays: functions without arguments (versions of packages), and OF_PROCESS.
    """
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "mechlab":
            for one in list(vars(module).values()):
                kept = hasattr(one, "cache_clear") and inspect.signature(one).parameters
                if kept and not one.__module__.startswith(OF_PROCESS):  # wherever it was imported to
                    one.cache_clear()


def _once_more(times: list[float], repeats: int, costly: float) -> bool:
    """True while the median needs another run: up to `repeats` runs, but only two where they take `costly` [s]
    together; runs that take less than ENOUGH_S [s] together go on, up to REPEATS_LIMIT."""
    spent, n = sum(times), len(times)
    if n < repeats:
        return n < 2 or spent < costly
    return 1 < repeats and n < REPEATS_LIMIT and spent < ENOUGH_S


def _row(target: float, x: Ours, search: _Search) -> PeerRow:
    best = search.fastest(target)
    mine, theirs = _duel(search, target, best)
    ours_row = (target, mine, x.error, x.method, x.reached)
    if best is None:
        nearest = min((p.error for p in search.points if p.ok), default=math.nan)
        return PeerRow(*ours_row, "", math.nan, math.nan, nearest)
    return PeerRow(*ours_row, best.method, best.step, theirs, best.error)


def _duel(search: _Search, target: float, best: ChartPoint | None) -> tuple[float, float]:
    """Median CPU times [s] of our run and of the peer's best setting.

    The runs alternate in groups, so that a slow phase of the machine slows both.
    """
    mine, theirs = list[float](), list[float]()
    while True:
        before = len(mine) + len(theirs)
        for _ in range(REPEATS):
            if _once_more(mine, REPEATS, COSTLY[1]):
                mine.append(whole_run(search.problem, target)[0])
        for _ in range(REPEATS):
            if best is not None and _once_more(theirs, REPEATS, search.costly):
                theirs.append(search.method(best.method).run(search.problem, best.step).total_s)
        if len(mine) + len(theirs) == before:
            return statistics.median(mine), statistics.median(theirs) if theirs else math.nan


@dataclass
class _Search:
    """Runs of peers on a problem, with their errors against the reference; costly [s]: CPU time at which a sweep
    ends."""

    problem: Problem
    truth: Reference
    costly: float
    points: list[ChartPoint] = field(default_factory=list)

    def sweep(self, m: Method) -> None:
        """Ever smaller values, until the sharpest target is met twice or a run is costly."""
        between = self.problem.scene.duration / self.problem.outputs
        values = TOLERANCES if m.control == "tolerance" else tuple(between / 2**k for k in range(HALVINGS))
        met = 0
        for value in values:
            p = self.point(m, value)
            self.points.append(p)
            met += p.ok and p.error <= min(TARGETS)
            if met >= 2 or (p.ok and p.total_s > self.costly) or p.status == NOT_RUN:
                return

    def point(self, m: Method, value: float, repeats: int = 1) -> ChartPoint:
        """One setting: median CPU time of `repeats` runs, and the error."""
        lost = partial(ChartPoint.without_numbers, m.name, value, m.control)
        times: list[float] = []
        while _once_more(times, repeats, self.costly):
            try:
                trace = m.run(self.problem, value)
            except PeerStopped as late:
                return lost(NOT_RUN, str(late))
            except MechlabError as why:
                return lost(DIVERGED, str(why))
            times.append(trace.total_s)
        found = score(self.problem, self.truth, trace)
        if not math.isfinite(found.error):
            return lost(DIVERGED, trace.reason or "the state is not finite")
        numbers = (trace.cpu_s, found.error, found.e_g, found.energy, found.gap)
        return ChartPoint(m.name, value, m.control, *numbers, OK, total_s=statistics.median(times))

    @staticmethod
    def method(name: str) -> Method:
        """The peer's method of that name."""
        return next(m for m in PEER_METHODS if m.name == name)

    def fastest(self, target: float) -> ChartPoint | None:
        """The cheapest setting of all peers that meets the target, None when no peer meets it.

        The cheapest CONTENDERS of the sweep are refined towards the next coarser setting and timed again.
        """
        cheapest: dict[str, ChartPoint] = {}
        for p in sorted((p for p in self.points if p.ok and p.error <= target), key=lambda p: p.total_s):
            cheapest.setdefault(p.method, p)
        out = [self._sharpened(self.method(n), p, target) for n, p in list(cheapest.items())[:CONTENDERS]]
        return min(out, key=lambda p: p.total_s, default=None)

    def _sharpened(self, m: Method, good: ChartPoint, target: float) -> ChartPoint:
        """The largest value that meets the target, found by single runs, then the median time of several runs with it."""
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
        """The nearest step [s] that divides the time between outputs; a tolerance is returned unchanged."""
        if m.control == "tolerance":
            return value
        between = self.problem.scene.duration / self.problem.outputs
        return float(between / np.round(between / value))


def _cautions(search: _Search) -> Iterator[str]:
    """A sentence for each peer that ran and needs one, with the least error that it reached."""
    for peer, caution in CAUTIONS.items():
        names = {m.name for m in PEER_METHODS if m.engine == peer}
        ran = [p for p in search.points if p.ok and p.method in names]
        if ran:
            best = min(ran, key=lambda p: p.error)
            least = f"{best.error:.1e} {search.truth.unit} with {best.method} at {1e3 * best.step:.3g} ms"
            yield f"{caution}. Least error here: {least}; the smallest step tried was {1e3 * min(p.step for p in ran):.3g} ms."


def _versions() -> dict[str, str]:
    out = {}
    for name in PEERS:
        try:
            out[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return out
