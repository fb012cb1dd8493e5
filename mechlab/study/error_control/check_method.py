"""The accepted motion against another method: over as much of the scene as a share of the CPU spent allows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.measure import Measure, most
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.rules import LADDERS, RULES, LadderRule
from mechlab.study.methods import METHODS, Method, Problem, is_rough

CHECKING = ("mujoco", "pinocchio")
FIRST_INTERVAL = 20.0
"""What an adaptive method spends on the first output interval, in later ones: the start of a stiff motion is rough."""


@dataclass(frozen=True)
class Checked:
    """What the check method says: it differs by `difference` up to time `until`; by itself it is good to `own`."""

    method: str
    difference: float
    own: float
    until: float
    sentence: str

    def contradicts(self, estimate: float, size: float) -> bool:
        """Whether the difference is more than both errors explain; `size`: of the tracked quantities."""
        return self.difference > RULES.contradiction * (self.own + estimate) + 1e-11 * size


def check(
    problem: Problem, measure: Measure, tracked: Array, used: str, fastest: float, meter: Meter, sharp: bool = True
) -> Checked | None:
    """Runs the cheapest ladder of another engine over the first output times, at two sharpnesses; None where none can: no
    engine that may check follows dry friction.

    tracked (n, names): the accepted motion at all output times; used: engine of the accepted method; sharp: False where half
    of the steps will do for a tree, which has no softness that goes with them.
    """
    if is_rough(problem.mechanism):
        return None
    found = None
    for way in sorted(_ways(problem, used, fastest, sharp), key=lambda x: x.cost):
        with meter.building():
            why = way.method.available(problem)
        if not why:
            found = _compare(problem, measure, tracked, way, meter)
        if found is not None:
            return found
    return None


@dataclass(frozen=True)
class _Way:
    """A method that may check, the two values that it is run at, and what the first output interval may cost [s]."""

    method: Method
    values: tuple[float, float]
    cost: float


def _ways(problem: Problem, used: str, fastest: float, sharp: bool) -> Iterator[_Way]:
    between = problem.scene.duration / problem.outputs
    few, most_steps = RULES.check_steps
    for rule in LADDERS:
        if rule.engine not in CHECKING or rule.engine == used or rule.extrapolated:
            continue
        method = _registered(rule, problem)
        if method is None:
            continue
        if rule.control == "tolerance":
            yield _Way(method, RULES.check_tolerances, FIRST_INTERVAL * rule.cost)
            continue
        half = not (sharp or problem.mechanism.loops or problem.mechanism.relations)
        least = math.ceil(between * fastest / rule.stable) if rule.stable and fastest > 0.0 else 0
        for each in sorted({max(x, least) for x in ((few // 2, few) if half else (few,))}):
            if each > most_steps:
                continue
            yield _Way(method, (between / each, 0.5 * between / each), 3.0 * each * rule.cost)


def _registered(rule: LadderRule, problem: Problem) -> Method | None:
    rows = problem.mechanism.loops or problem.mechanism.relations
    kind = "default" if rule.engine == "mujoco" and rule.control == "step" and not rows else rule.constraints
    for m in METHODS:
        if (m.engine, m.integrator, m.constraints) == (rule.engine, rule.integrator, kind):
            return m
    return None


def _compare(problem: Problem, measure: Measure, tracked: Array, way: _Way, meter: Meter) -> Checked | None:
    method, between = way.method, problem.scene.duration / problem.outputs
    size = max(1e-3, float((tracked.max(axis=0) - tracked.min(axis=0)).max()))
    budget = max(RULES.check_share * meter.spent, 1e-4)
    count = 1
    while True:
        with meter.building():
            part = Problem(problem.design, replace(problem.scene, duration=count * between), count)
            t = np.linspace(0.0, part.scene.duration, count + 1)
        try:
            with meter.stepping() as told:
                runs = [method.run(part, x) for x in way.values]
                told += [r.cpu_s for r in runs]
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None
        if not all(r.complete and len(r.q) == count + 1 for r in runs):
            return None
        both = measure(np.concatenate([t, t]), *(np.concatenate([getattr(r, x) for r in runs]) for x in ("q", "v")))
        coarse, fine = both[: count + 1], both[count + 1 :]
        change = np.abs(coarse - fine).max(axis=1)
        sure = change <= RULES.check_own * size
        good = len(sure) if sure.all() else int(np.argmin(sure))
        if good < 2:
            return None
        own = float(change[:good].max())
        away = most((fine - tracked[: count + 1])[:good])
        left = budget - sum(told)
        more = min(problem.outputs, int(left / max(sum(told) / count, 1e-7)))
        if good < len(sure) or more < 4 * count:
            break
        budget, count = left, more
    until = float(t[good - 1])
    sentence = (
        f"check by {method.name} up to t = {until:.4g} s: it differs by {away:.2g} {measure.unit}, and changes by "
        f"{own:.2g} {measure.unit} when it is made sharper"
    )
    return Checked(method.name, away, own, until, sentence)
