"""The runs of one method, each with a smaller step or tolerance than the one before, and the error of the best."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.held_rates import captured
from mechlab.experiment.recording import Recording, Trace
from mechlab.experiment.scene import Settings
from mechlab.integrate import OutOfWork, count_work, work_done, work_limit
from mechlab.lab.accuracy.convergence import error_of_steps, error_of_tolerances, seen_order
from mechlab.lab.accuracy.dense import DenseStates, between_nodes, dense_states, meets_range
from mechlab.lab.accuracy.even_run import EvenRun
from mechlab.lab.accuracy.measure import ErrorMeasure, largest
from mechlab.lab.accuracy.next_step import FINE, RATIOS, first_step, next_tolerance, ratio_enough, shorter_step
from mechlab.lab.accuracy.result import NeighbourMotion
from mechlab.lab.accuracy.rules import EPSILON, RELIED, RULES, MethodRule
from mechlab.lab.methods import Method, Problem, has_kinks
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

CAPTURE_SHARE = 0.5
"""Share of their capture time with which held rates are run again, to see what that time does."""
TOLERANCE_SHARE = 2.0
"""Error of a channel over its change between a tolerance and a tenth of it, at most: LSODA's may fall by a third alone (flyball over
0.5 s from 1e-8 to 1e-9)."""
PATIENCE = 2.0
"""A run is stopped when it takes so many times the work that was expected of it, while other methods may be cheaper; it may be made
again, with twice as much."""


@dataclass
class RefinedMethod:
    """The runs of one method so far.

    values: their steps [s] or tolerances; traces: their states; row: the last states, plain and extrapolated (Richardson); runs: the best;
    changes: of the tracked quantities from each of those to the next. estimate: error of the last run; work, first_work [s]: of the last
    and the first run that got to the end; done [s], cpu_s: of all runs; failures: number of runs that failed; ended: why no sharper run
    can be made; recaptured: the best run once more, with half the time in which held rates are captured. longest: the longest first
    step, in distances of the outputs (a power of 2); a run with longer steps has fewer outputs, at its steps. dense: the last run at all
    outputs, where its steps are longer; filled: the error that this adds, once `fill` was called. stopped: work [s] after which the
    next run was stopped, as it took much more than expected. record: makes the Recording of the scene with some settings, where states
    alone do not make one; recorded: those of the last two runs, by their steps.
    """

    rule: MethodRule
    problem: Problem
    measure: ErrorMeasure
    fastest: float
    target: float
    values: list[float] = field(default_factory=list)
    traces: list[Trace] = field(default_factory=list)
    row: list[tuple[Array, Array]] = field(default_factory=list)
    runs: list[EvenRun] = field(default_factory=list)
    changes: list[float] = field(default_factory=list)
    estimate: float = math.inf
    work: float = 0.0
    first_work: float = 0.0
    done: float = 0.0
    cpu_s: float = 0.0
    failures: int = 0
    ended: str = ""
    recaptured: Trace | None = None
    longest: int = 1
    dense: DenseStates | None = None
    filled: float | None = None
    stopped: float = 0.0
    record: Callable[[Settings], Recording] | None = None
    recorded: dict[float, Recording] = field(default_factory=dict)

    @property
    def times(self) -> Array:
        """Times of the outputs [s]."""
        return np.linspace(0.0, self.problem.scene.duration, self.problem.outputs + 1)

    def fill(self) -> float:
        """Make the states of the last run at all outputs, and return the error [unit] that this adds: 0 where its steps are no longer
        than their distance, infinite where it meets the end of a range between them."""
        if self.filled is None:
            self.filled = self._fill()
        return self.filled

    def _fill(self) -> float:
        self.dense, best = None, self.runs[-1]
        if len(best.t) == self.problem.outputs + 1:
            return 0.0
        p, t = self.problem, self.times
        d = self.dense = dense_states(p.mechanism, p.scene, best.t, best.q, best.v, t)
        tracked = self.measure(t, d.q, d.v)
        if meets_range(p.mechanism, d.q):
            return math.inf
        return largest(self.measure(t, d.near_q, d.near_v) - tracked)

    @property
    def states(self) -> tuple[Array, Array]:
        """q (n, nq), v (n, nv) of the last run at all outputs, once `fill` was called."""
        found = self.dense or self.runs[-1]
        return found.q, found.v

    @property
    def run_s(self) -> float:
        """CPU time [s] of the last run, with those that it is extrapolated from."""
        return sum(x.cpu_s for x in self.traces) if self.rule.extrapolated else self.traces[-1].cpu_s

    @property
    def settings(self) -> Settings:
        """Settings of the last run."""
        return self.method.settings(self.values[-1])

    @cached_property
    def method(self) -> Method:
        """The method of the registry that is refined."""
        found = self.rule.method(self.problem)
        if found is None:
            raise MechlabError(f"{self.rule.name}: the registry of methods has no such method.")
        return found

    @cached_property
    def expected_work(self) -> float:
        """Expected work [s] of a step, or of an output interval under a tolerance, before the first run."""
        return self.rule.evaluations * self.method.price(self.problem)

    @property
    def next_cost(self) -> float:
        """Expected work [s] of the next run; infinite where there is none."""
        if self.ended:
            return math.inf
        return max(self._expected_next, 2.0 * self.stopped)

    @property
    def _expected_next(self) -> float:
        if self.traces:
            return self.work * self._growth
        value = self._next()
        if value is None:
            return math.inf
        count = self.problem.scene.duration / value if self.rule.control == "step" else self.problem.outputs
        return count * self.expected_work

    @property
    def _growth(self) -> float:
        """Work of the next run over that of the last."""
        if self.rule.control == "tolerance":
            return 1.6
        return self.values[-1] / (self._next() or math.nan) if self.traces else self._ratio

    @property
    def cost_to_target(self) -> float:
        """Expected work [s] until the error is met, if its runs go on to converge as they do; before there is an estimate, if
        the first one possible meets it. Infinite where no further run can be made."""
        cost, growth = self.next_cost, self._growth
        more = max(1, self._enough - len(self.runs))
        last = self.changes[-1] if self.changes else 0.0
        if math.isfinite(self.estimate) and last > 0.0 and self.rule.control == "step":
            order = seen_order(self.changes, self._steps, self._orders[1])
            needed = math.log(RULES.safety * last / self.target, growth) / order
            more = max(more, math.ceil(min(needed, 30.0)))
        return cost * (growth**more - 1.0) / (growth - 1.0)

    @property
    def _enough(self) -> int:
        """Number of runs that can give an estimate at best."""
        if self.rule.control == "tolerance":
            return 2 if self.rule.error_left[0] else RULES.runs
        return RULES.runs if self.rule.extrapolated or has_kinks(self.problem.scene) else 2

    def cost_given(self, others: Sequence[RefinedMethod]) -> float:
        """`cost_to_target`; before the first run at least that of the first run of another method with the same integrator,
        scaled by the prices of their equations of motion."""
        alike = [x for x in others if x.rule.integrator == self.rule.integrator and x.first_work]
        cost = self.cost_to_target
        if self.traces or self.ended or not alike:
            return cost
        least = min(x.first_work * self.expected_work / x.expected_work for x in alike)
        return cost * max(1.0, least / self.next_cost)

    def refine(self, budget: float) -> None:
        """Make one more run, within `budget` [s] of counted work."""
        value = self._next()
        if value is None:
            self.ended = self.ended or "its sharpest setting was used"
            return
        allowed = min(budget, max(PATIENCE * self.next_cost, 0.05))
        try:
            with work_limit(allowed):
                trace, work = self._run(self.problem, value)
        except OutOfWork:
            self.stopped = allowed
            if allowed < budget:
                return
            self.ended = f"its next run would take more than {budget:.2g} s of work"
            return
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError) as cause:
            self._note_failure(str(cause))
            return
        self.work, self.filled, self.stopped = work, None, 0.0
        if not trace.complete or not np.all(np.isfinite(trace.q)) or len(trace.q) != self._outputs(value) + 1:
            self.values.append(value)
            self._note_failure(trace.reason or "the state is not finite")
            return
        self.first_work = self.first_work or work
        self.values.append(value)
        self.traces.append(trace)
        self._combine(trace)
        self._estimate_error()

    def rounding_error(self) -> float:
        """Error [unit] by rounding: the change of the last run but one when the initial rates are moved by a few units
        in the last place."""
        scene = self.problem.scene
        names = tuple(scene.initial_rates) or self.problem.mechanism.scalar_names[:1]
        # the rates are moved, because assembly would undo so small a change of the pose; scaled by those of the motion
        small = RULES.rounding * EPSILON * max(1.0, float(np.max(np.abs(self.traces[-1].v))))
        rates = dict(scene.initial_rates) | {n: scene.initial_rates.get(n, 0.0) + small for n in names}
        moved = Problem(self.problem.design, replace(scene, initial_rates=rates), self.problem.outputs)
        return self._apart(self._run(moved, self.values[-2])[0], self.traces[-2])

    @property
    def captures(self) -> bool:
        """Whether it captures held rates, which another method may hold exactly."""
        laws = self.problem.scene.laws
        return self.rule.engine != "hybrid" and captured(laws, CAPTURE_SHARE) != laws

    def capture_error(self) -> float:
        """Error [unit] by the time in which held rates are captured: twice the change with half that time, as the error
        is of first order in it; 0 without such a law, and where rates are held exactly."""
        p = self.problem
        if not self.captures:
            return 0.0
        laws = captured(p.scene.laws, CAPTURE_SHARE)
        self.recaptured, _ = self._run(Problem(p.design, replace(p.scene, laws=laws), p.outputs), self.values[-1])
        return 2.0 * self._apart(self.recaptured, self.traces[-1])

    def _apart(self, one: Trace, other: Trace) -> float:
        """Largest difference [unit] of two runs with the same steps; infinite where one of them ended early."""
        if len(one.q) != len(other.q):
            return math.inf
        first, second = (EvenRun.of(self.measure, x.q, x.v) for x in (one, other))
        return first.apart(second, self.measure)

    def neighbours(self, rounding: float) -> Iterator[NeighbourMotion]:
        """Motions whose differences from the best run give the errors of all channels: the run before the last, with
        the factor safety x error / change of the tracked quantities; and the run with half the capture time. rounding:
        from `rounding_error`."""
        if len(self.runs) < 2:
            return
        last, error = self.changes[-1], self.estimate + rounding
        share, settings = error / last if last > 0.0 else 1.0, self.method.settings(self.values[-2])
        if self.rule.control == "tolerance":
            share = max(share, TOLERANCE_SHARE)
        coarse, best = self.runs[-2:]
        moved = coarse.q, coarse.v
        if len(coarse.t) != self.problem.outputs + 1:
            # the last run, moved by their difference at the nodes of the coarser one
            pairs = zip(self.states, (coarse.q, coarse.v), best.at(coarse.t), strict=True)
            moved = tuple(x + between_nodes(coarse.t, other - own, self.times) for x, other, own in pairs)  # type: ignore[assignment]
        yield NeighbourMotion(RULES.safety * share, settings, *moved)
        if self.dense is not None:
            yield NeighbourMotion(1.0, settings, self.dense.near_q, self.dense.near_v)
            return
        if self.recaptured is None:
            return
        # compared with the plain run, since the extrapolated one is another
        other, plain, q, v = self.recaptured, self.traces[-1], best.q, best.v
        if len(other.q) != len(plain.q):
            yield NeighbourMotion(math.inf, self.settings, q, v, captured=CAPTURE_SHARE)
            return
        q, v = q + other.q - plain.q, v + other.v - plain.v
        yield NeighbourMotion(2.0 * RULES.safety, self.settings, q, v, captured=CAPTURE_SHARE)

    def _outputs(self, value: float) -> int:
        """Number of output intervals of a run at a step [s] or tolerance."""
        count = self.problem.outputs
        if self.rule.control == "tolerance":
            return count
        return min(count, round(self.problem.scene.duration / value))

    def _run(self, problem: Problem, value: float) -> tuple[Trace, float]:
        """A run and its work [s], which is added to `done`, its CPU time to `cpu_s`."""
        before, began = work_done(), time.thread_time()
        try:
            if self._records and problem is self.problem:
                trace = self._recorded_run(value)
            else:
                trace = self.method.run(replace(problem, outputs=self._outputs(value)), value)
        except BaseException:  # a run that is stopped, or fails, is paid for too
            self.cpu_s += time.thread_time() - began
            raise
        finally:
            work = work_done() - before
            self.done += work
        self.cpu_s += trace.cpu_s
        return trace, work

    @property
    def _records(self) -> bool:
        """Whether its runs are made as Recordings at once, so that the last ones need not be made again."""
        return self.record is not None and self.rule.engine == "mujoco" and self.rule.control == "step" and not self.rule.extrapolated

    def _recorded_run(self, value: float) -> Trace:
        """The run at a step [s] by the recorder of the engine, which takes the same steps; its states at the outputs."""
        assert self.record is not None
        m, scene = self.problem.mechanism, self.problem.scene
        stages = 4.0 if self.rule.integrator == "RK4" else 1.0
        # the recorder counts the laws alone
        count_work(stages * engine(self.rule.engine).price(m, scene.laws).of(m) * scene.duration / value)
        made = self.record(self.method.settings(value))
        self.recorded = {x: r for x, r in self.recorded.items() if x in self.values[-1:]} | {value: made}
        t = self.times
        at = np.searchsorted(made.t, t * (1.0 - 1e-12))
        there = at < len(made.t)
        ended = "" if there.all() else f"ended at t = {made.t[-1]:.4g} s"
        return Trace(made.q[at[there]], made.v[at[there]], made.cost.cpu_s, made.cost.steps, ended)

    def _note_failure(self, why: str) -> None:
        """Record a failed run: the runs before it no longer count, and too many failures end the refinement."""
        self.failures += 1
        self.traces, self.row, self.runs, self.changes, self.estimate = [], [], [], [], math.inf
        if self.failures > RULES.failures or self.rule.control == "tolerance":
            self.ended = why

    def _next(self) -> float | None:
        """The step [s] or tolerance of the next run; None where there is none."""
        if self.rule.control == "tolerance":
            return next_tolerance(self.rule, self.target, self.values)
        p = self.problem
        if self.values:
            return shorter_step(self.values[-1], self._ratio, p.scene.duration, p.outputs)
        longest = 1 if self.rule.extrapolated else self.longest
        return first_step(p.scene.duration / p.outputs, longest, self.rule.stable, self.fastest)

    @property
    def _ratio(self) -> float:
        """The last step over the next one, about."""
        m = self.problem.mechanism
        if self.target < FINE or self.rule.extrapolated or has_kinks(self.problem.scene) or m.nq != m.nv:
            return RATIOS[-1]
        if len(self.runs) < 2:
            # a step that had to be short for other reasons than the error is near enough
            return RATIOS[0] if self.rule.least and self.runs else RATIOS[-1]
        return ratio_enough(self.changes, self._steps, self.rule.order, self.target)

    def _combine(self, trace: Trace) -> None:
        row = [(trace.q, trace.v)]
        if self.rule.extrapolated:
            for j, (q, v) in enumerate(self.row, start=1):
                weight = 1.0 / (2.0**j - 1.0)
                fine_q, fine_v = row[-1]
                row.append((fine_q + weight * (fine_q - q), fine_v + weight * (fine_v - v)))
        self.row = row

    def _estimate_error(self) -> None:
        run = EvenRun.of(self.measure, *self.row[-1])
        self.changes += [run.apart(x, self.measure) for x in self.runs[-1:]]
        self.runs.append(run)
        if self.rule.control == "tolerance":
            self.estimate = error_of_tolerances(self.changes, self._enough)
        else:
            kinks, long = has_kinks(self.problem.scene), len(run.t) <= self.problem.outputs
            self.estimate = error_of_steps(self.changes, self._steps, self._orders, self.rule.extrapolated, kinks, long)

    @property
    def _steps(self) -> list[float]:
        """The steps [s] of the runs."""
        return self.values[-len(self.runs) :]

    @property
    def _orders(self) -> tuple[float, float]:
        """The largest power of the step with which the errors are taken to fall, and the one with which they are expected to."""
        if self.rule.extrapolated:
            return RELIED, RELIED
        m, rule = self.problem.mechanism, self.rule
        if rule.with_rows and m.is_closed and not engine(rule.engine).projects(m, self.problem.scene.laws):
            return rule.with_rows
        return min(rule.order, RELIED), rule.order
