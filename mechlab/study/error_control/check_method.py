"""The accepted motion against another method: over as much of the scene as a share of the CPU spent allows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.conservative import scalars
from mechlab.study.error_control.measure import Measure
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.rules import LADDERS, RULES, LadderRule
from mechlab.study.methods import METHODS, Method, Problem


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
    problem: Problem, measure: Measure, tracked: Array, used: str, fastest: float, meter: Meter
) -> Checked | None:
    """Runs the first step ladder of another engine over the first output times, with two steps; None where none
    can: no engine with fixed steps follows dry friction.

    tracked (n, names): the accepted motion at all output times; used: engine of the accepted method.
    """
    if any(x.friction for x in scalars(problem.mechanism)):
        return None
    for rule in LADDERS:
        if rule.control != "step" or rule.engine == used or (used == "mujoco" and rule.engine == "mujoco"):
            continue
        method = _registered(rule, problem)
        if method is None:
            continue
        with meter.building():
            why = method.available(problem)
        if why:
            continue
        found = _compare(problem, measure, tracked, method, rule, fastest, meter)
        if found is not None:
            return found
    return None


def _registered(rule: LadderRule, problem: Problem) -> Method | None:
    rows = problem.mechanism.loops or problem.mechanism.relations
    kind = "default" if rule.engine == "mujoco" and not rows else rule.constraints
    for m in METHODS:
        if (m.engine, m.integrator, m.constraints) == (rule.engine, rule.integrator, kind):
            return m
    return None


def _compare(
    problem: Problem, measure: Measure, tracked: Array, method: Method, rule: LadderRule, fastest: float, meter: Meter
) -> Checked | None:
    between = problem.scene.duration / problem.outputs
    few, most = RULES.check_steps
    each = few
    if rule.stable and fastest > 0.0:
        each = max(few, math.ceil(between * fastest / rule.stable))
    if each > most:
        return None
    budget = max(RULES.check_share * meter.spent, 1e-4)
    count = 1
    while True:
        part = Problem(problem.design, replace(problem.scene, duration=count * between), count)
        t = np.linspace(0.0, part.scene.duration, count + 1)
        try:
            with meter.stepping() as told:
                runs = [method.run(part, between / n) for n in (each, 2 * each)]
                told += [r.cpu_s for r in runs]
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None
        if not all(r.complete and len(r.q) == count + 1 for r in runs):
            return None
        coarse, fine = (measure(t, r.q, r.v) for r in runs)
        sure = np.max(np.abs(coarse - fine), axis=1) <= RULES.check_own * max(
            1e-3, float(np.ptp(tracked, axis=0).max())
        )
        good = len(sure) if sure.all() else int(np.argmin(sure))
        if good < 2:
            return None
        own = float(np.max(np.abs(coarse - fine)[:good]))
        away = float(np.max(np.abs(fine - tracked[: count + 1])[:good]))
        cost = max(sum(told) / count, 1e-7)
        more = min(problem.outputs, int(budget / cost) - count)
        if count > 1 or more <= 1:
            break
        count = more
    until = float(t[good - 1])
    sentence = (
        f"check by {method.name} up to t = {until:.4g} s: it differs by {away:.2g} {measure.unit}, and changes by "
        f"{own:.2g} {measure.unit} when its own step is halved"
    )
    return Checked(method.name, away, own, until, sentence)
