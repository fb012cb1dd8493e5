"""The check."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mechlab.engines.protocol import is_rough
from mechlab.errors import MechlabError
from mechlab.integrate import work_done
from mechlab.lab.accuracy.measure import CostMeter, ErrorMeasure, largest
from mechlab.lab.accuracy.rules import METHOD_RULES, RULES, MethodRule
from mechlab.lab.methods import METHODS, Method, Problem, Stepper
from mechlab.mechanism.geometry import Array

CHECK_ENGINES = ("mujoco", "pinocchio")
_FAILURES = (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError)
LEAST_CHECK_WORK = 1e-4
"""Work that a check may take at least [s]."""
FIRST_INTERVAL = 20.0
"""What an adaptive method spends on the first output interval, in later ones: the start of a stiff motion is rough."""


@dataclass(frozen=True)
class MethodCheck:
    """What the check method says: it differs by `difference` up to time `until`; by itself it is good to `own`."""

    method: str
    difference: float
    own: float
    until: float
    sentence: str

    def contradicts(self, estimate: float, size: float) -> bool:
        """Whether the difference is more than both errors explain; `size`: of the tracked quantities."""
        return self.difference > RULES.contradiction * (self.own + estimate) + 1e-11 * size


class CheckRunner:
    """Another engine than `used`, ready to follow a motion over its first output times, at two sharpnesses: the cheapest that
    can. None can where there is dry friction.

    fastest: rate of the mechanism [1/s]; sharp: False where a quarter of the steps may do for a tree, which has no softness
    that goes with them, and ten times the tolerance. Making one builds models.
    """

    def __init__(self, problem: Problem, used: str, fastest: float, sharp: bool = True) -> None:
        self.problem = problem
        rough = is_rough(problem.mechanism)
        self.ways = [] if rough else sorted(_check_settings(problem, used, fastest, sharp), key=lambda x: x.cost)
        self.pair: list[Stepper] = []
        self._prepare()

    def _prepare(self) -> None:
        """Drops the ways that cannot run the problem, and gets the first that can ready."""
        while self.ways:
            way = self.ways[0]
            if not way.method.available(self.problem):
                try:
                    self.pair = [way.method.stepper(self.problem, x) for x in way.values]
                except _FAILURES:
                    pass
                else:
                    return
            del self.ways[0]

    def check(self, measure: ErrorMeasure, tracked: Array, meter: CostMeter) -> MethodCheck | None:
        """What it says of tracked (n, names), the accepted motion at all output times; None where nothing could follow it."""
        while self.ways:
            found = _compare(self.problem, measure, tracked, self.ways[0], self.pair, meter)
            if found is not None:
                return found
            with meter.building():
                del self.ways[0]
                self._prepare()
        return None


@dataclass(frozen=True)
class _CheckSetting:
    """A method that may check, the two values that it is run at, and the work that the first output interval may take [s]."""

    method: Method
    values: tuple[float, float]
    cost: float


def _check_settings(problem: Problem, used: str, fastest: float, sharp: bool) -> Iterator[_CheckSetting]:
    between = problem.scene.duration / problem.outputs
    few, most_steps = RULES.check_steps
    for rule in METHOD_RULES:
        if rule.engine not in CHECK_ENGINES or rule.engine == used or rule.extrapolated:
            continue
        method = _registered_method(rule, problem)
        if method is None:
            continue
        price = method.price(problem)
        if rule.control == "tolerance":
            looser = 1.0 if sharp else 10.0
            coarse, fine = RULES.check_tolerances
            yield _CheckSetting(method, (looser * coarse, looser * fine), FIRST_INTERVAL * rule.evaluations * price)
            continue
        fewer = not (sharp or problem.mechanism.loops or problem.mechanism.relations)
        least = math.ceil(between * fastest / rule.stable) if rule.stable and fastest > 0.0 else 0
        for each in sorted({max(x, least) for x in ((few // 4, few // 2, few) if fewer else (few,))}):
            if each > most_steps:
                continue
            yield _CheckSetting(method, (between / each, 0.5 * between / each), 3.0 * each * price)


def _round_down(count: float) -> int:
    """The largest of 1, 2, 3, 4, 6, 8, 12, ... that is not more: evaluations of methods with step-size control differ in their last
    digits between processors, and how far a check goes does not."""
    if count < 2.0:
        return 1
    power = 2 ** int(math.log2(count))
    return power + (power // 2 if count >= 1.5 * power else 0)


def _registered_method(rule: MethodRule, problem: Problem) -> Method | None:
    rows = problem.mechanism.loops or problem.mechanism.relations
    kind = "default" if rule.engine == "mujoco" and rule.control == "step" and not rows else rule.constraints
    for m in METHODS:
        if (m.engine, m.integrator, m.constraints) == (rule.engine, rule.integrator, kind):
            return m
    return None


def _compare(
    problem: Problem, measure: ErrorMeasure, tracked: Array, way: _CheckSetting, pair: list[Stepper], meter: CostMeter
) -> MethodCheck | None:
    between = problem.scene.duration / problem.outputs
    size = max(1e-3, largest(tracked - tracked[0]))
    budget = max(RULES.check_share * meter.work, LEAST_CHECK_WORK)
    count, more, spent = 0, 1, 0.0
    said: Array | None = None  # of both runs: (2, count + 1, names)
    while True:
        try:
            with meter.stepping() as told:
                before = work_done()
                runs = [stepper.advance(more) for stepper in pair]
                told.cpu_s, told.work = sum(run.cpu_s for run in runs), work_done() - before
        except _FAILURES:
            return None
        if any(run.reason or len(run.q) != more + 1 for run in runs):
            return None
        q, v = np.concatenate([run.q for run in runs]), np.concatenate([run.v for run in runs])
        t = between * np.arange(count, count + more + 1)
        new = measure(np.concatenate([t, t]), q, v).reshape(2, more + 1, -1)
        said = new if said is None else np.concatenate([said, new[:, 1:]], axis=1)
        count, spent = count + more, spent + told.work
        change = np.abs(said[0] - said[1]).max(axis=1)
        good = int(np.argmax(change > RULES.check_own * size)) or count + 1
        if good < 2:
            return None
        reach = _round_down(count + (budget - spent) / max(spent / count, 1e-7))
        more = min(problem.outputs, reach) - count
        if good <= count or more < 3 * count:
            break
    own, away, until = float(change[:good].max()), largest(said[1, :good] - tracked[:good]), float(between * (good - 1))
    sentence = (
        f"check by {way.method.name} up to t = {until:.4g} s: it differs by {away:.2g} {measure.unit}, and changes by "
        f"{own:.2g} {measure.unit} when it is made sharper"
    )
    return MethodCheck(way.method.name, away, own, until, sentence)
