"""Work-precision charts: what each method costs and how wrong it is, on one scene, under one honest protocol.

x: CPU time of stepping alone, one thread, the median of several runs, the same output times for all (which runs are made, counted
work decides: the same ones on every machine). y: the largest
position error against a reference of another formulation; beside it e_G, energy and loop gap, never energy alone. At
least four step sizes a method; divergence is shown as missing; an engine's defaults are always shown.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.acting import what_acts
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene
from mechlab.integrate import OutOfWork, work_done, work_limit
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.methods import METHODS, TOLERANCES, Method, Problem, steps
from mechlab.lab.run import versions
from mechlab.studies.chart.data import PUBLISHED
from mechlab.studies.chart.score import Reference, Score, reference_of, score

if TYPE_CHECKING:
    from mechlab.studies.chart.peers import PeerTable
from mechlab.studies.chart.advice import flat_defaults, recommend
from mechlab.studies.chart.data import DIVERGED, FEWEST, NOT_RUN, OK, Chart, Point


@dataclass(frozen=True)
class Budget:
    """Counted work [s] (`mechlab.integrate.work`): a method is refined until one run takes `one`; no more runs after `method`
    together; repeats of the timing while they take less than `repeat` together."""

    one: float = 0.06
    method: float = 1.0
    repeat: float = 0.12
    repeats: int = 5


def chart(
    design: Design,
    scene: str | None = None,
    *,
    fidelity: str | None = None,
    duration: float | None = None,
    target: float | None = None,
    budget: Budget | None = None,
    methods: Sequence[Method] = METHODS,
    peers: bool = False,
    progress: Callable[[str], None] = lambda line: None,
) -> Chart:
    """The chart of a scene. target [m or rad]: the error that the recommendation must meet (default: the scene's).

    peers: compare error control with other people's engines (`mechlab.studies.chart.peers`), as far as they are installed.
    Raises MechlabError for unknown names, or when there is nothing to hold the methods against.
    """
    if target is not None and not target > 0:
        raise MechlabError(f"target: expected an error > 0, got {target!r}.")
    lived = design.for_scene(scene)
    made = chosen_scene(lived, scene, fidelity, duration)
    problem = Problem(lived, made)
    progress("reference")
    truth = reference_of(problem)
    points: list[Point] = []
    skipped: dict[str, str] = {}
    for m in methods:
        why = m.available(problem)
        if why:
            skipped[m.name] = why
            continue
        progress(m.name)
        values = steps(problem) if m.control == "step" else TOLERANCES
        points += sweep(m.name, m.control, m.is_default, values, *_work(m, problem, truth), budget or Budget())
    aim = made.tolerance if target is None else target
    changed = bool(design.given) or duration is not None
    names = {m.name: m for m in METHODS}
    others = _compare(problem, truth, progress) if peers else None
    error, confirmed = _confirm(points, truth, {n for n, m in names.items() if m.engine == "analytic"})
    return Chart(
        design.name, design.entry.title, made.name, made.duration, truth.unit, truth.names, truth.text + confirmed, error,
        (*points, *(others.points if others else ())), skipped | (others.skipped if others else {}),
        recommend(points, aim, truth.unit), tuple(flat_defaults(points, aim, truth.unit, _has_rows(design, made))),
        () if changed else PUBLISHED.get(design.name, ()), versions(), others,
        what_acts(lived.mechanism(made.fidelity), made),
    )  # fmt: skip


def _compare(problem: Problem, truth: Reference, progress: Callable[[str], None]) -> PeerTable:
    from mechlab.studies.chart.peers import compare

    return compare(problem, truth, progress)


def _work(m: Method, problem: Problem, truth: Reference) -> tuple[Callable[[float], Trace], Callable[[Trace], Score]]:
    return lambda value: m.run(problem, value), lambda trace: score(problem, truth, trace)


def sweep(
    name: str,
    control: str,
    default: bool,
    values: Sequence[float],
    run: Callable[[float], Trace],
    judge: Callable[[Trace], Score],
    budget: Budget,
) -> list[Point]:
    """A method at ever smaller values. Refinement ends with the budget; the first FEWEST values are always told of."""
    out: list[Point] = []
    began = work_done()
    for k, value in enumerate(values):
        left = budget.method - (work_done() - began)
        if left <= 0.0:
            if k < FEWEST:
                out.append(_missing(name, value, control, NOT_RUN, f"{budget.method:g} s of work were done", default))
            continue
        try:
            before = work_done()
            with work_limit(left):
                trace = run(value)
            work = work_done() - before
        except OutOfWork:
            if k < FEWEST:
                out.append(_missing(name, value, control, NOT_RUN, f"stopped after {left:.3g} s of work", default))
            continue
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
            # a state that ran away: Python's floats raise where numpy's become infinite
            out.append(_missing(name, value, control, DIVERGED, str(problem), default))
            continue
        found = judge(trace)
        if not math.isfinite(found.error):
            why = trace.reason or "the state is not finite"
            out.append(_missing(name, value, control, DIVERGED, why, default))
            continue
        cpu = _median(run, value, trace.cpu_s, work, budget)
        numbers = (cpu, found.error, found.e_g, found.energy, found.gap)
        out.append(Point(name, value, control, *numbers, OK, "", default, getattr(trace, "evaluations", 0)))
        if sum(p.ok for p in out) >= FEWEST and work > budget.one:
            break
    return out


def _missing(name: str, value: float, control: str, status: str, reason: str, default: bool) -> Point:
    nan = math.nan
    return Point(name, value, control, nan, nan, nan, nan, nan, status, reason, default)


def _median(run: Callable[[float], Trace], value: float, first: float, work: float, budget: Budget) -> float:
    """Median CPU time of the stepping over as many runs of so much work as the budget allows (an odd number)."""
    times = [first]
    while len(times) < budget.repeats and (len(times) + 2) * work < budget.repeat:
        times += [run(value).cpu_s, run(value).cpu_s]
    return statistics.median(times)


def _confirm(points: Sequence[Point], truth: Reference, own: set[str]) -> tuple[float, str]:
    """The error of the reference as far as it is known: another formulation agrees to this."""
    others = [p for p in points if p.ok and p.method not in own and p.error > 0.0]
    mine = [p for p in points if p.ok and p.method in own]
    known = [] if math.isnan(truth.own_error) else [truth.own_error]
    text = ""
    if mine:
        sharpest = min(mine, key=lambda p: p.error)
        known.append(max(sharpest.error, 1e-15))
        text = f"; itself at tolerance {sharpest.step:.0e}: {sharpest.error:.1e}"
    if others:
        best = min(others, key=lambda p: p.error)
        known.append(best.error)
        text += f"; {best.method} agrees to {best.error:.1e}"
    return min(known, default=math.nan), text


def _has_rows(design: Design, scene: Scene) -> bool:
    m = design.mechanism(scene.fidelity)
    return bool(m.loops or m.relations)
