"""The check of a motion by another engine, over as much of the scene as a share of the work done so far allows.

The engine runs twice, at two steps or tolerances. The difference of its runs is its own error; as long as that is
small, the difference of the sharper run from the checked motion must be explained by the errors of both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.acting import is_rough
from mechlab.experiment.prices import BUILDING
from mechlab.integrate import work_done
from mechlab.lab.accuracy.measure import CostCounter, ErrorMeasure, largest
from mechlab.lab.accuracy.result import MethodCheck
from mechlab.lab.accuracy.rules import METHOD_RULES, RULES
from mechlab.lab.methods import Method, Problem, Stepper
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

CHECK_ENGINES = ("mujoco", "pinocchio")
_FAILURES = (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError)
LEAST_CHECK_WORK = 1e-4
"""A check may always take this much work [s]."""
FIRST_INTERVAL = 20.0
"""Work of an adaptive method on the first output interval over that on a later one: a stiff motion starts with a transient."""


class CheckRunner:
    """Runs the cheapest engine other than `used` that can follow the scene, twice. Dry friction is not checked.

    fastest: rate of the mechanism [1/s]. sharp: False where a low accuracy is enough: then a check without soft rows, of a tree or
    of MuJoCo by another engine, may take a quarter of the steps, and a tolerance is ten times as large. The constructor builds models.
    """

    def __init__(self, problem: Problem, used: str, fastest: float, sharp: bool = True) -> None:
        self.problem = problem
        rough = is_rough(problem.mechanism)
        self.settings = [] if rough else sorted(_check_settings(problem, used, fastest, sharp), key=lambda x: x.cost)
        self.pair: list[Stepper] = []
        self._prepare()

    def _prepare(self) -> None:
        """Prepare the two runs of the first setting that can run the problem; drop the settings before it."""
        while self.settings:
            setting = self.settings[0]
            if not setting.method.available(self.problem):
                try:
                    self.pair = [setting.method.stepper(self.problem, x) for x in setting.values]
                except _FAILURES:
                    pass
                else:
                    return
            del self.settings[0]

    def check(self, measure: ErrorMeasure, tracked: Array, counter: CostCounter) -> MethodCheck | None:
        """The check of `tracked` (n, names), the motion at all output times; None where no other method can follow it."""
        while self.settings:
            found = _compare(self.problem, measure, tracked, self.settings[0], self.pair, counter)
            if found is not None:
                return found
            with counter.building():
                del self.settings[0]
                self._prepare()
        return None


@dataclass(frozen=True)
class _CheckSetting:
    """A method that may check, its two steps [s] or tolerances, and the expected work [s] of its model and the first output interval."""

    method: Method
    values: tuple[float, float]
    cost: float


def _check_settings(problem: Problem, used: str, fastest: float, sharp: bool) -> Iterator[_CheckSetting]:
    between = problem.scene.duration / problem.outputs
    few, most_steps = RULES.check_steps
    for rule in METHOD_RULES:
        if rule.engine not in CHECK_ENGINES or rule.engine == used or rule.order < 2.0:
            continue
        method = rule.method(problem)
        if method is None:
            continue
        # a sharp check goes as far as its work allows; where one interval is enough, most of it is the making of its model
        price, building = method.price(problem), 0.0 if sharp else BUILDING[rule.engine].of(problem.mechanism)
        if rule.control == "tolerance":
            looser = 1.0 if sharp else 10.0
            coarse, fine = RULES.check_tolerances
            yield _CheckSetting(method, (looser * coarse, looser * fine), building + FIRST_INTERVAL * rule.evaluations * price)
            continue
        rigid = used == "mujoco" or not problem.mechanism.is_closed
        fewer = rigid and not sharp
        least = math.ceil(between * fastest / rule.stable) if rule.stable and fastest > 0.0 else 0
        for each in sorted({max(x, least) for x in ((few // 4, few // 2, few) if fewer else (few,))}):
            if each > most_steps:
                continue
            yield _CheckSetting(method, (between / each, 0.5 * between / each), building + 3.0 * each * price)


def _round_down(count: float) -> int:
    """The largest of 1, 2, 3, 4, 6, 8, 12, ... that is not more than `count`. The evaluations of methods with step-size
    control vary a little between processors; the length of a check must not."""
    if count < 2.0:
        return 1
    power = 2 ** int(math.log2(count))
    return power + (power // 2 if count >= 1.5 * power else 0)


def _compare(
    problem: Problem,
    measure: ErrorMeasure,
    tracked: Array,
    setting: _CheckSetting,
    pair: list[Stepper],
    counter: CostCounter,
) -> MethodCheck | None:
    between = problem.scene.duration / problem.outputs
    size = max(1e-3, largest(tracked - tracked[0]))
    budget = max(RULES.check_share * counter.work, LEAST_CHECK_WORK)
    count, more, spent = 0, 1, 0.0
    both: Array | None = None  # of both runs: (2, count + 1, names)
    while True:
        try:
            with counter.stepping() as cost:
                before = work_done()
                runs = [stepper.advance(more) for stepper in pair]
                cost.cpu_s, cost.work = sum(run.cpu_s for run in runs), work_done() - before
        except _FAILURES:
            return None
        if any(run.reason or len(run.q) != more + 1 for run in runs):
            return None
        q, v = np.concatenate([run.q for run in runs]), np.concatenate([run.v for run in runs])
        t = between * np.arange(count, count + more + 1)
        new = measure(np.concatenate([t, t]), q, v).reshape(2, more + 1, -1)
        both = new if both is None else np.concatenate([both, new[:, 1:]], axis=1)
        count, spent = count + more, spent + cost.work
        change = np.abs(both[0] - both[1]).max(axis=1)
        good = int(np.argmax(change > RULES.check_own * size)) or count + 1
        if good < 2:
            return None
        reach = _round_down(count + (budget - spent) / max(spent / count, 1e-7))
        more = min(problem.outputs, reach) - count
        if good <= count or more < 3 * count:
            break
    own, difference, until = (
        float(change[:good].max()),
        largest(both[1, :good] - tracked[:good]),
        float(between * (good - 1)),
    )
    sentence = (
        f"check by {setting.method.name} up to t = {until:.4g} s: it differs by {difference:.2g} {measure.unit}, and changes by "
        f"{own:.2g} {measure.unit} when it is made sharper"
    )
    return MethodCheck(setting.method.name, difference, own, until, sentence)
