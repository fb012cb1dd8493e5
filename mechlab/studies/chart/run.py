"""Runs every method on a scene at ever smaller steps and makes the chart of speed against accuracy.

x: CPU time [s] of stepping alone, one thread, median of several runs, the same output times for all methods. y: the
largest position error against a reference of another formulation; e_G, energy and loop gap are listed with it. Counted
work, not time, limits the runs, so that every machine makes the same ones. Each method has at least four step sizes; a
run that diverges is listed without numbers; an engine's defaults are always shown.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.acting import what_acts
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene
from mechlab.integrate import OutOfWork, work_done, work_limit
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.methods import METHODS, PEER_METHODS, TOLERANCES, Method, Problem, steps
from mechlab.lab.single_run import versions
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import silent
from mechlab.studies.chart.advice import flat_defaults, recommend
from mechlab.studies.chart.data import DIVERGED, FEWEST, NOT_RUN, OK, PUBLISHED, Chart, ChartPoint
from mechlab.studies.chart.peers import TARGETS, compare
from mechlab.studies.chart.score import Reference, Score, reference_of, score

FEWER = 0.9
"""Half the step takes at least twice this work: with shorter steps loops close in fewer iterations."""


@dataclass(frozen=True)
class Budget:
    """Limits in counted work [s] (`mechlab.integrate.work`).

    A method is refined until one run takes `one`, or all its runs together `method`. Its timing is repeated up to `repeats`
    times, as long as the repeats take less than `repeat` together.
    """

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
    progress: Callable[[int, int], None] = silent,
) -> Chart:
    """The chart of a scene. target [m or rad]: the error that the recommendation must meet (default: the scene's).

    peers: compare error control with other people's engines (`mechlab.studies.chart.peers`), as far as they are installed.
    Raises MechlabError for unknown names, or when there is no reference.
    """
    if target is not None and not target > 0:
        raise MechlabError(f"target: expected an error > 0, got {target!r}.")
    chosen = design.for_scene(scene)
    made = chosen_scene(chosen, scene, fidelity, duration)
    problem = Problem(chosen, made)
    truth = reference_of(problem)
    points: list[ChartPoint] = []
    skipped: dict[str, str] = {}
    others_to_do = len(TARGETS) + len(PEER_METHODS) if peers else 0
    total = len(methods) + others_to_do
    for k, m in enumerate(methods):
        progress(k, total)
        why = m.available(problem)
        if why:
            skipped[m.name] = why
            continue
        values = steps(problem) if m.control == "step" else TOLERANCES
        points += refine(
            m.name,
            m.control,
            m.is_default,
            values,
            partial(m.run, problem),
            partial(score, problem, truth),
            budget or Budget(),
        )
    aim = made.tolerance if target is None else target
    changed = bool(design.given) or duration is not None
    names = {m.name: m for m in METHODS}
    others = compare(problem, truth, lambda done: progress(len(methods) + done, total)) if peers else None
    error, confirmed = _confirm(points, truth, {n for n, m in names.items() if m.engine == "analytic"})
    return Chart(
        design.name, design.entry.title, made.name, made.duration, truth.unit, truth.names, truth.text + confirmed, error,
        (*points, *(others.points if others else ())), skipped | (others.skipped if others else {}),
        recommend(points, aim, truth.unit), tuple(flat_defaults(points, aim, truth.unit, _has_rows(design, made))),
        () if changed else PUBLISHED.get(design.name, ()), versions(), others,
        what_acts(chosen.mechanism(made.fidelity), made),
    )  # fmt: skip


def refine(
    name: str,
    control: str,
    default: bool,
    values: Sequence[float],
    run: Callable[[float], Trace],
    scored: Callable[[Trace], Score],
    budget: Budget,
) -> list[ChartPoint]:
    """The points of a method at ever smaller steps or tolerances, until the budget is spent; at least FEWEST of them. A run that the
    last one shows to be beyond the budget is not begun: shorter steps are more of them, a sharper tolerance costs no less."""
    out: list[ChartPoint] = []
    lost = ChartPoint.without_numbers
    began, last = work_done(), (values[0], 0.0)
    for k, value in enumerate(values):
        left = budget.method - (work_done() - began)
        if left <= 0.0:
            if k < FEWEST:
                out.append(lost(name, value, control, NOT_RUN, f"{budget.method:g} s of work were done", default))
            continue
        needed = last[1] * (FEWER * last[0] / value if control == "step" else 1.0)
        if needed > left:
            if k < FEWEST:
                why = f"it would take at least {needed:.3g} s of work, {left:.3g} s are left"
                out.append(lost(name, value, control, NOT_RUN, why, default))
            continue
        try:
            before = work_done()
            with work_limit(left):
                trace = run(value)
            work = work_done() - before
            last = value, work
        except OutOfWork:
            if k < FEWEST:
                out.append(lost(name, value, control, NOT_RUN, f"stopped after {left:.3g} s of work", default))
            continue
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
            # a state that ran away: Python's floats raise where numpy's become infinite
            out.append(lost(name, value, control, DIVERGED, str(problem), default))
            continue
        found = scored(trace)
        if not math.isfinite(found.error):
            why = trace.reason or "the state is not finite"
            out.append(lost(name, value, control, DIVERGED, why, default))
            continue
        cpu = _median(run, value, trace.cpu_s, work, budget)
        numbers = (cpu, found.error, found.e_g, found.energy, found.gap)
        out.append(ChartPoint(name, value, control, *numbers, OK, "", default, getattr(trace, "evaluations", 0)))
        if sum(p.ok for p in out) >= FEWEST and work > budget.one:
            break
    return out


def _median(run: Callable[[float], Trace], value: float, first: float, work: float, budget: Budget) -> float:
    """Median CPU time [s] of stepping, over an odd number of runs, as many as the budget allows; work [s]: of one run."""
    times = [first]
    while len(times) < budget.repeats and (len(times) + 2) * work < budget.repeat:
        times += [run(value).cpu_s, run(value).cpu_s]
    return statistics.median(times)


def _confirm(points: Sequence[ChartPoint], truth: Reference, own: set[str]) -> tuple[float, str]:
    """Estimated error of the reference, nan where there is no estimate, and text on the methods that agree with it.

    The least of: its own estimate, the error of its own formulation (`own`), and that of the closest other method.
    """
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
    return m.is_closed
