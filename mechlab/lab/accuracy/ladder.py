"""A ladder of runs of one method, each rung sharper than the last, with the error of the best estimated from the rungs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.held_rates import captured
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Settings
from mechlab.integrate import OutOfWork, work_done, work_limit
from mechlab.lab.accuracy.measure import Measure
from mechlab.lab.accuracy.result import Neighbour
from mechlab.lab.accuracy.rules import EXTRAPOLATED, LOOPS_ORDER, RULES, LadderRule
from mechlab.lab.methods import METHODS, Method, Problem, has_kinks
from mechlab.mechanism.geometry import Array

EPSILON = 2.2e-16
ERRATIC = 2.0
"""A change that falls so many times faster than theory promises is not yet on its way: it is not believed to go on."""
HALF = 0.5
"""Of the time in which held rates are captured, for what that time does."""
KINK_RATIO = 16.0
"""No more than this the changes are believed to fall when a step of a motion with kinks is halved."""


@dataclass
class Ladder:
    """The runs of one method so far; `estimate` of the best, `work` of the last (`first_work` of the first) that got to the end
    [s], `done`: work, and `cpu_s`: CPU seconds of all that did, `ended`: why it cannot go on,
    `recaptured`: the best in which held rates are captured in half the time."""

    rule: LadderRule
    problem: Problem
    measure: Measure
    fastest: float
    target: float
    values: list[float] = field(default_factory=list)
    traces: list[Trace] = field(default_factory=list)
    tables: list[list[tuple[Array, Array]]] = field(default_factory=list)
    tracked: list[Array] = field(default_factory=list)
    estimate: float = math.inf
    work: float = 0.0
    first_work: float = 0.0
    done: float = 0.0
    cpu_s: float = 0.0
    failures: int = 0
    ended: str = ""
    recaptured: Trace | None = None

    @property
    def best(self) -> tuple[Array, Array]:
        """q, v of the sharpest rung (extrapolated where the rule says so)."""
        return self.tables[-1][-1]

    @property
    def settings(self) -> Settings:
        """Those of the sharpest rung."""
        return self.method.settings(self.values[-1])

    @property
    def method(self) -> Method:
        """The method of the registry that the rungs are runs of."""
        r = self.rule
        kind = r.constraints
        if r.engine == "mujoco" and r.control == "step" and not _rows(self.problem):
            kind = "default"
        return next(
            m
            for m in METHODS
            if (m.engine, m.integrator, m.constraints, m.control) == (r.engine, r.integrator, kind, r.control)
        )

    @property
    def expected(self) -> float:
        """Expected work [s] of a step, or of an output interval under a tolerance, before a run has told."""
        return self.rule.evaluations * self.method.price(self.problem)

    @property
    def next_cost(self) -> float:
        """Expected work [s] of the next rung; infinite at the end of the ladder."""
        if self.ended:
            return math.inf
        if not self.traces:
            value = self._next()
            if value is None:
                return math.inf
            count = self.problem.scene.duration / value if self.rule.control == "step" else self.problem.outputs
            return count * self.expected
        return self.work * (2.0 if self.rule.control == "step" else 1.6)

    def cost_beside(self, others: Sequence[Ladder]) -> float:
        """`next_cost`; of a first rung that another ladder has climbed by the same integrator, what it took there, in
        proportion to the equations of motion."""
        alike = [x for x in others if x.rule.integrator == self.rule.integrator and x.first_work]
        if self.traces or self.ended or not alike:
            return self.next_cost
        return max(self.next_cost, min(x.first_work * self.expected / x.expected for x in alike))

    def climb(self, budget: float) -> None:
        """One rung more, within `budget` seconds of work."""
        value = self._next()
        if value is None:
            self.ended = self.ended or "its sharpest setting was used"
            return
        try:
            with work_limit(max(budget, 0.05)):
                trace, work = self._run(self.problem, value)
        except OutOfWork:
            self.ended = f"its next run would take more than {budget:.2g} s of work"
            return
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError) as cause:
            self._failed(str(cause))
            return
        self.work = work
        if not trace.complete or not np.all(np.isfinite(trace.q)) or len(trace.q) != self.problem.outputs + 1:
            self.values.append(value)
            self._failed(trace.reason or "the state is not finite")
            return
        self.first_work = self.first_work or work
        self.values.append(value)
        self.traces.append(trace)
        self._combine(trace)
        self._judge()

    def rounding(self) -> float:
        """What a change of the start by a few units in the last place does to the last run but one."""
        scene = self.problem.scene
        names = tuple(scene.initial_rates) or self.problem.mechanism.scalar_names[:1]
        # of the rates, because assembly rounds away so small a change of the pose; their scale is that of the motion
        small = RULES.rounding * EPSILON * max(1.0, float(np.max(np.abs(self.traces[-1].v))))
        rates = dict(scene.initial_rates) | {n: scene.initial_rates.get(n, 0.0) + small for n in names}
        moved = Problem(self.problem.design, replace(scene, initial_rates=rates), self.problem.outputs)
        trace, _ = self._run(moved, self.values[-2])
        plain = self.traces[-2]
        if len(trace.q) != len(plain.q):
            return math.inf
        t = np.linspace(0.0, scene.duration, self.problem.outputs + 1)
        return _distance(self.measure(t, trace.q, trace.v), self.measure(t, plain.q, plain.v))

    def capture(self) -> float:
        """What the time in which held rates are captured adds to the error: twice what half of it does, as it is of first
        order; 0 without such a law."""
        p = self.problem
        laws = captured(p.scene.laws, HALF)
        if laws == p.scene.laws:
            return 0.0
        trace, _ = self._run(Problem(p.design, replace(p.scene, laws=laws), p.outputs), self.values[-1])
        plain, self.recaptured = self.traces[-1], trace
        if len(trace.q) != len(plain.q):
            return math.inf
        t = np.linspace(0.0, p.scene.duration, p.outputs + 1)
        return 2.0 * _distance(self.measure(t, trace.q, trace.v), self.measure(t, plain.q, plain.v))

    def neighbours(self, rounding: float) -> Iterator[Neighbour]:
        """What the errors of all channels follow from: the run before the best, with the share of the change that the estimate
        takes of the tracked quantities, and as much again; and the capture of held rates, whose part is of first order.
        rounding: as of the method of this name."""
        if len(self.tables) < 2:
            return
        change, error = _distance(self.tracked[-1], self.tracked[-2]), self.estimate + rounding
        share = error / change if change > 0.0 else 1.0
        q, v = self.tables[-2][-1]
        yield Neighbour(RULES.safety * share, self.method.settings(self.values[-2]), q, v)
        if self.recaptured is None:
            return
        # beside the plain run, not the extrapolated one, which is another
        other, plain, (q, v) = self.recaptured, self.traces[-1], self.best
        if len(other.q) != len(plain.q):
            yield Neighbour(math.inf, self.settings, q, v, captured=HALF)
            return
        q, v = q + other.q - plain.q, v + other.v - plain.v
        yield Neighbour(2.0 * RULES.safety, self.settings, q, v, captured=HALF)

    def _run(self, problem: Problem, value: float) -> tuple[Trace, float]:
        """A run and its work [s]; both count, CPU time too."""
        before = work_done()
        trace = self.method.run(problem, value)
        work = work_done() - before
        self.done += work
        self.cpu_s += trace.cpu_s
        return trace, work

    def _failed(self, why: str) -> None:
        """A rung that did not come through; too many end the ladder, and runs before it do not count."""
        self.failures += 1
        self.traces, self.tables, self.tracked, self.estimate = [], [], [], math.inf
        if self.failures > RULES.failures or self.rule.control == "tolerance":
            self.ended = why

    def _next(self) -> float | None:
        if self.rule.control == "tolerance":
            return self._next_tolerance()
        between = self.problem.scene.duration / self.problem.outputs
        if self.values:
            return 0.5 * self.values[-1]
        first = between
        if self.rule.stable and self.fastest > 0.0:
            first = min(first, self.rule.stable / self.fastest)
        return between / 2 ** math.ceil(math.log2(between / first) - 1e-9)

    def _next_tolerance(self) -> float | None:
        factor, power = self.rule.leaves
        if not factor:
            left = [x for x in RULES.tolerances if not self.values or x < self.values[-1]]
            return left[0] if left else None
        first, last = RULES.tolerances[0], RULES.sharpest
        start = min(max((self.target / factor) ** (1.0 / power), 10.0 * last), first)
        value = 0.1 * self.values[-1] if self.values else start
        return value if value > 0.5 * last else None

    def _combine(self, trace: Trace) -> None:
        row = [(trace.q, trace.v)]
        if self.rule.extrapolated and self.tables:
            for j, (q, v) in enumerate(self.tables[-1], start=1):
                weight = 1.0 / (2.0**j - 1.0)
                fine_q, fine_v = row[-1]
                row.append((fine_q + weight * (fine_q - q), fine_v + weight * (fine_v - v)))
        self.tables.append(row)

    def _judge(self) -> None:
        t = np.linspace(0.0, self.problem.scene.duration, self.problem.outputs + 1)
        rows = self.tables
        self.tracked.append(self.measure(t, *rows[-1][-1]))
        if len(self.tracked) < 2:
            return
        last = _distance(self.tracked[-1], self.tracked[-2])
        if self.rule.control == "tolerance":
            # the change is the error of the coarser run; one that started far above the target may agree by chance
            enough = 2 if self.rule.leaves[0] else RULES.rungs
            self.estimate = last if len(self.tracked) >= enough else math.inf
            return
        if len(self.tracked) < RULES.rungs:
            # two runs of a method that does not extrapolate: the change itself, not a share of it
            self.estimate = math.inf if self.rule.extrapolated or has_kinks(self.problem.scene) else last
            return
        before = _distance(self.tracked[-2], self.tracked[-3])
        if has_kinks(self.problem.scene):
            # which step a kink falls into is chance: two runs may agree by luck, and none is better than the change
            self.estimate = max(last, before / KINK_RATIO)
            return
        ratio, theory = before / last if last > 0.0 else math.inf, 2.0**self._order
        if ratio > ERRATIC * theory and not self.rule.extrapolated:
            self.estimate = last
            return
        # the observed ratio, never better than theory promises; without a falling error the change itself counts
        ratio = min(ratio, theory)
        self.estimate = last / (ratio - 1.0) if ratio > 1.5 else 2.0 * max(last, before)

    @property
    def _order(self) -> float:
        """With which power of the step the errors are believed to fall."""
        if self.rule.extrapolated:
            return EXTRAPOLATED
        return LOOPS_ORDER if self.rule.engine == "mujoco" and _rows(self.problem) else self.rule.order


def _distance(a: Array, b: Array) -> float:
    return float(np.max(np.abs(a - b), initial=0.0))


def _rows(problem: Problem) -> bool:
    return bool(problem.mechanism.loops or problem.mechanism.relations)
