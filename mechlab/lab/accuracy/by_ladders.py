"""A race of ladders: the method whose next run is the cheapest is refined, until one of them meets the error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from mechlab.engines.protocol import is_rough, why_no_smooth_tree
from mechlab.errors import MechlabError, NoSolution
from mechlab.lab.accuracy.ladder import Ladder
from mechlab.lab.accuracy.measure import Measure, Meter, most
from mechlab.lab.accuracy.result import CAPTURE, LOW, ROUNDING, Checked, Checker, Result, verdict
from mechlab.lab.accuracy.rules import LADDERS, RULES, fastest_rate
from mechlab.lab.methods import Problem
from mechlab.mechanism.geometry import Array

T = TypeVar("T")


def by_ladders(problem: Problem, measure: Measure, max_error: float, freedoms: int, why: str, meter: Meter) -> Result:
    """The scene by the cheapest ladder; why: the energy does not do. Raises NoSolution where no method gets to its end,
    MechlabError where no engine is installed that could."""
    t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
    fastest = fastest_rate(problem.mechanism, problem.scene)
    ladders = [Ladder(rule, problem, measure, fastest, max_error) for rule in LADDERS]
    with meter.building():
        ladders = [x for x in ladders if _usable(x, freedoms)]
    if not ladders:
        raise MechlabError(f"{problem.design.name}: no engine is installed that can control the error of this scene.")
    winner: Ladder | None = None
    while winner is None:
        cost, x = min(((one.cost_beside(ladders), one) for one in ladders), key=lambda pair: pair[0])
        left = RULES.work - meter.work
        if math.isinf(cost) or cost > left:
            break
        _counted(meter, x, partial(x.climb, left))
        if RULES.safety * x.estimate <= max_error:
            winner = x
    rounding = 0.0
    # what a tolerance leaves at every step is amplified as rounding is, and a hundred times as large: it is in the estimate
    if winner is not None and winner.rule.control == "step" and max_error < 1e-6 and len(winner.traces) > 1:
        rounding = _counted(meter, winner, winner.rounding)
    ran = [x for x in ladders if x.traces]
    if not ran:
        raise NoSolution(f"{problem.design.name}: no method gets to the end of the scene ({_ends(ladders)}).")
    best = winner or min(ran, key=lambda x: x.estimate)
    capture = _counted(meter, best, best.capture)
    q, v = best.best
    tracked = measure(t, q, v)
    checked = _against(best, [x for x in ran if x is not best], t, problem)
    if checked is None:
        with meter.building():
            checker = Checker(problem, best.rule.engine, fastest, max_error < LOW)
        checked = checker.check(measure, tracked, meter)
    sharp = f"{'step' if best.rule.control == 'step' else 'tolerance'} {best.values[-1]:.3g}"
    stiff = f", whose fastest rate is {fastest:.3g} 1/s" if fastest * t[1] > 1.0 else ""
    chosen = (
        f"{best.rule.name}, {sharp}{' s' if best.rule.control == 'step' else ''}, the cheapest of {len(ladders)} methods to get "
        f"there ({why}{stiff})"
    )
    size = float(np.max(np.abs(tracked), initial=1.0))
    total = best.estimate + rounding + capture
    part = cause = ""
    if capture > max(best.estimate, rounding):
        part, cause = f"the capture of held rates {capture:.1g}", CAPTURE
    elif rounding > best.estimate and max_error < LOW:
        part, cause = f"rounding {rounding:.1g}", ROUNDING
    ok, sentence = verdict(total, max_error, measure, chosen, checked, size, part, cause)
    if winner is None:
        ok = False
        sentence += f"; {RULES.work:g} s of work or the sharpest settings were used up: {_ends(ladders)}"
    return Result(
        t, q, v, total, max_error, measure.unit, best.rule.name, best.values[-1], best.rule.control, meter.cpu_s,
        best.traces[-1].steps, ok, sentence, replace(best.settings, preset="max_error"), checked,
        extrapolated=best.rule.extrapolated, neighbours=tuple(best.neighbours(rounding)),
    )  # fmt: skip


def _counted(meter: Meter, ladder: Ladder, work: Callable[[], T]) -> T:
    """What the work gives; only that of the runs of the ladder counts."""
    with meter.stepping() as told:
        cpu_s, done = ladder.cpu_s, ladder.done
        found = work()
        told.cpu_s, told.work = ladder.cpu_s - cpu_s, ladder.done - done
    return found


def _ends(ladders: list[Ladder]) -> str:
    return "; ".join(f"{x.rule.name}: {x.ended or f'would need {x.next_cost:.2g} s more'}" for x in ladders)


def _usable(ladder: Ladder, freedoms: int) -> bool:
    """Whether the rules let this method run this problem: dry friction is for located events alone."""
    m = ladder.problem.mechanism
    if is_rough(m) != (ladder.rule.engine == "hybrid"):
        return False
    if ladder.rule.engine == "one_freedom" and freedoms != 1:
        return False
    if ladder.rule.extrapolated and (m.loops or m.relations or not why_no_smooth_tree(m, ladder.problem.scene.laws)):
        return False
    try:
        return not ladder.method.available(ladder.problem)
    except StopIteration:
        return False


def _against(best: Ladder, others: list[Ladder], t: Array, problem: Problem) -> Checked | None:
    """The check by the ladder of another method that was climbed beside: the sharpest of its runs."""
    told = [x for x in others if len(x.tracked) >= 2]
    if not told:
        return None
    other = min(told, key=lambda x: most(x.tracked[-1] - x.tracked[-2]))
    own = most(other.tracked[-1] - other.tracked[-2])
    away = most(other.tracked[-1] - best.tracked[-1])
    unit = best.measure.unit
    sentence = (
        f"check by {other.rule.name} up to t = {t[-1]:.4g} s: it differs by {away:.2g} {unit}, and changes by {own:.2g} {unit} "
        "in its last refinement"
    )
    return Checked(other.rule.name, away, own, float(t[-1]), sentence)
