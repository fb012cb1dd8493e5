"""--max-error on the benchmark problems and on driven scenes: python -m tests.benchmarks.bench_max_error
[mechanism ...]. No limits are asserted.

For each problem and target: the true error of `ml.simulate(..., max_error=E)` beside the target, against the entry's own equations
(1e-12 or better) or Pinocchio at 1e-12; all CPU seconds from the call to the returned recording, and those of choosing and solving
alone, each beside the cheapest method of the chart that meets the target when it is run alone, at the best step or tolerance of a
ladder, at this and at every smaller step, with an error that goes on falling: its whole call to a recording, as ours is (where an
engine makes one; nothing is estimated or checked), that to bare states at 101 times, and its stepping. (One that meets the target at a
single step, or whose error stays as it is, is right by chance: without the truth nobody could choose it; nor one whose recording its own
health record refuses, as a loop that opens.) Each is the smallest of TURNS runs that are made in turn, without imports.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.lab.methods import METHODS, TOLERANCES, Method, Problem, steps
from mechlab.lab.single_run import engine_run
from mechlab.studies.chart.score import Reference, reference_of, tracked
from tests.benchmarks.rows import Row

BENCHMARKS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("pendulum", {}), ("n_fourbar", {"N": 2}), ("andrews", {}), ("bricard", {}), ("flyball", {}), ("slider_crank", {}),
)  # fmt: skip
TARGETS = (1e-3, 1e-6, 1e-9)
DRIVEN: tuple[tuple[str, str, float | None, str | None, float], ...] = (
    ("fourbar", "driven-crank", None, None, 1e-3), ("quick_return", "driven-crank", None, None, 1e-3),
    ("fivebar", "driven-crank", None, None, 1e-3), ("gear_linkage", "knife-drive", 2.0, None, 1e-3),
    ("closed_differential", "internal-drag", 1.0, None, 1e-3), ("delta6", "head-tracking", 0.3, None, 1e-3),
    ("delta6", "head-tracking", 0.3, "full", 1e-3), ("prosthetic_leg", "stance-drop", None, None, 1e-3),
)  # fmt: skip
REPEATS, TURNS = 2, 5
"""How often a run of a ladder is made, and the chosen one, its recording and ours, in turn."""
OUTPUTS = 100
DEAREST = 0.5
"""A method is refined no further once a run takes so many CPU seconds."""
FURTHER = 8.0
"""A row that meets the target is followed to runs that cost this many times as much."""
CONVERGED = 0.1
"""Share of the target that the error of a method falls to at the end of its row."""
RESOLVED = 1e-10
"""True errors [m or rad] below this one are those of the references."""


@dataclass(frozen=True)
class Alone:
    """A method alone, with step or tolerance, and the CPU seconds of its stepping."""

    method: Method
    value: float
    stepping: float

    @property
    def name(self) -> str:
        """Its name with step or tolerance."""
        return f"{self.method.name} {self.value:.3g}"

    def recordings(self, problem: Problem) -> list[Recording]:
        """Its recordings: none where no engine makes one, two where it extrapolates from two runs."""
        if self.method.engine not in ("mujoco", "pinocchio") or self.method.integrator == "LSODA":
            return []
        values = (self.value, 0.5 * self.value) if self.method.constraints == "extrapolated" else (self.value,)
        return [engine_run(problem.design, problem.scene, self.method.settings(x)) for x in values]

    def recorded(self, problem: Problem, times: int = REPEATS) -> float:
        """CPU seconds of the whole call to a recording with channels and health, without imports; NaN where no engine makes one."""
        found = []
        for _ in range(times):
            began = time.process_time()
            made = self.recordings(problem)
            found.append(time.process_time() - began)
        return min(found) if made else math.nan


def runs_of(m: Method, problem: Problem, truth: Reference) -> Iterator[tuple[float, float, float]]:
    """Value, error and CPU seconds of stepping of a method, from coarse to fine."""
    for value in steps(problem) if m.control == "step" else TOLERANCES:
        best = (math.inf, math.inf)
        error = math.inf
        for _ in range(REPEATS):
            began = time.process_time()
            try:
                trace = m.run(problem, value)
            except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError):
                break
            best = min(best, (time.process_time() - began, trace.cpu_s))
            if not trace.complete or not np.all(np.isfinite(trace.q)) or len(trace.q) != len(truth.values):
                break
            error = float(np.max(np.abs(tracked(problem, truth.names, trace.q, trace.v) - truth.values)))
            if best[0] > 0.1:
                break
        yield value, error, best[1]
        if math.isfinite(best[0]) and best[0] > DEAREST:
            return


def cheapest(problem: Problem, truth: Reference, targets: tuple[float, ...]) -> tuple[dict[float, Alone], dict[float, tuple[Alone, float]]]:
    """Target -> the cheapest method of the chart that can be known to meet it (`known_to_meet`); and the one, with its CPU seconds, whose
    recording costs least, of those that step for less than FURTHER times as much."""
    found: dict[float, Alone] = {}
    known: dict[float, list[Alone]] = {t: [] for t in targets}
    for m in METHODS:
        if m.available(problem):
            continue
        row: list[tuple[float, Alone]] = []
        for value, error, stepping in runs_of(m, problem, truth):
            alone = Alone(m, value, stepping)
            row.append((error, alone))
            if not math.isfinite(stepping):
                continue
            if any(known_to_meet(row, t, so_far=True) is alone for t in targets):
                if not all(made.health.trusted for made in alone.recordings(problem)):
                    row[-1] = math.inf, alone
            met = [known_to_meet(row, t, so_far=True) for t in targets]
            # a step that is dearer than the best of another method ends the row, unless one before it may be best
            useless = (t in found and (one or row[-1][1]).stepping >= found[t].stepping for t, one in zip(targets, met, strict=True))
            seen = (one is not None and stepping >= FURTHER * one.stepping for one in met)
            if all(a or b for a, b in zip(useless, seen, strict=True)):
                break
        for t in targets:
            one = known_to_meet(row, t)
            known[t] += [] if one is None else [one]
            if one is not None and (t not in found or one.stepping < found[t].stepping):
                found[t] = one
    least: dict[float, tuple[Alone, float]] = {}
    for t in found:
        costs = [(x, x.recorded(problem)) for x in known[t] if x.stepping < FURTHER * found[t].stepping]
        if records := [x for x in costs if x[1] > 0.0]:
            least[t] = min(records, key=lambda x: x[1])
    return found, least


def known_to_meet(row: list[tuple[float, Alone]], target: float, so_far: bool = False) -> Alone | None:
    """The first run of a method, from coarse to fine, from which on all errors meet the target; None without one. The last error must
    be below CONVERGED of the target too, as far as references resolve it: a method whose error does not fall with its step is near the
    truth by chance, which nobody sees who does not know the truth. so_far: the row is not complete."""
    met = None
    for error, alone in row:
        met = None if not error <= target else met or alone
    return met if so_far or met is None or row[-1][0] <= max(CONVERGED * target, RESOLVED) else None


def measured(
    name: str, problem: Problem, truth: Reference, target: float, alone: Alone | None, recorded: tuple[Alone, float] | None, **asked: Any
) -> Iterator[Row]:  # fmt: skip
    """The rows of one problem and target."""
    stepping, whole, best = math.inf, math.inf, None
    for _ in range(TURNS):
        began = time.process_time()
        run = ml.simulate(problem.design, max_error=target, **asked)
        spent = time.process_time() - began
        best = (spent, run) if best is None or spent < best[0] else best
        if alone:
            began = time.process_time()
            stepping = min(stepping, alone.method.run(problem, alone.value).cpu_s)
            whole = min(whole, time.process_time() - began)
        if recorded and recorded[1] < DEAREST:
            recorded = recorded[0], min(recorded[1], recorded[0].recorded(problem, 1))
    assert best is not None
    spent, run = best
    at = np.clip(np.searchsorted(run.t, np.linspace(0.0, run.t[-1], problem.outputs + 1) * (1.0 - 1e-12)), 0, len(run.t) - 1)
    error = float(np.max(np.abs(tracked(problem, truth.names, run.q[at], run.v[at]) - truth.values)))
    stated = run.health.finding("max_error").value
    label = f"{name} {target:.0e}"
    yield Row(f"{label}: true error", error, "m or rad", "target", target, "ratio <= 1")
    yield Row(f"{label}: stated error", stated, "m or rad", "true error", error, "ratio >= 1" if error > RESOLVED else "")
    beside = f"{alone.name}, converging" if alone else "no method of the chart"
    whole, stepping = (whole, stepping) if alone else (math.nan, math.nan)
    if recorded:
        yield Row(f"{label}: whole run", spent, "s", f"{recorded[0].name}, converging, recorded", recorded[1], "ratio <= 3")
    yield Row(f"{label}: whole run", spent, "s", f"{beside}, bare states", whole, "" if recorded else "ratio <= 3")
    yield Row(f"{label}: choosing and solving", run.cost.cpu_s, "s", f"{beside}, stepping", stepping, "ratio <= 3")
    yield Row(f"{label}: exit code", float(run.exit_code), "", asked="value <= 0")


def of_benchmark(name: str, parameters: dict[str, Any]) -> Iterator[Row]:
    """The rows of a benchmark problem at all targets."""
    design = ml.load(name, **parameters).for_scene(None)
    problem = Problem(design, design.scene(), OUTPUTS)
    truth = reference_of(problem)
    alone, recorded = cheapest(problem, truth, TARGETS)
    for target in TARGETS:
        yield from measured(name, problem, truth, target, alone.get(target), recorded.get(target))


def of_scene(name: str, scene: str, duration: float | None, fidelity: str | None, target: float) -> Iterator[Row]:
    """The rows of a driven scene at one target."""
    design = ml.load(name).for_scene(scene)
    problem = Problem(design, design.scene(scene, fidelity, duration), OUTPUTS)
    truth = reference_of(problem)
    alone, recorded = cheapest(problem, truth, (target,))
    label = f"{name} {scene}{f' {fidelity}' if fidelity else ''}"
    asked: dict[str, Any] = {"scene": scene, "duration": duration, "fidelity": fidelity}
    yield from measured(label, problem, truth, target, alone.get(target), recorded.get(target), **asked)


def every(only: tuple[str, ...] = ()) -> Iterator[Row]:
    """All rows; of some mechanisms only."""
    for name, parameters in BENCHMARKS:
        if name in (only or (name,)):
            yield from of_benchmark(name, parameters)
    for case in DRIVEN:
        if case[0] in (only or (case[0],)):
            yield from of_scene(*case)


def rows() -> list[Row]:
    """All rows."""
    return list(every())


if __name__ == "__main__":
    for row in every(tuple(sys.argv[1:])):
        told = f"{row.name:58s}{row.value:10.3g} {row.unit:9s}{row.reference:10.3g} {row.ratio:8.3g}  {row.met}  {row.beside}"
        print(told, flush=True)
