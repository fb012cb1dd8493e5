"""A scene solved to a stated error: the method and its step or tolerance are chosen, the error is estimated and checked.

Three ways, the first that applies: a single hinge under its weight is a pendulum, whose motion is known in elliptic functions;
one freedom under forces of position alone follows from its energy (both in `by_energy`); everything else is run by steps: always
the method whose next run costs least is refined, until one of them meets the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.acting import is_rough, why_no_smooth_tree
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.lab.accuracy.branch import candidate_joints
from mechlab.lab.accuracy.by_energy import SolveTask, solve_as_pendulum, solve_by_energy
from mechlab.lab.accuracy.check import CheckRunner
from mechlab.lab.accuracy.energies import OneJointEnergies, energies_of, why_energy_is_not_enough
from mechlab.lab.accuracy.measure import CostCounter, ErrorMeasure, largest
from mechlab.lab.accuracy.refinement import RefinedMethod
from mechlab.lab.accuracy.result import (
    LIMITED_BY_CAPTURE,
    LIMITED_BY_ROUNDING,
    ROUNDING_COUNTS,
    MethodCheck,
    Solution,
    conclusion,
)
from mechlab.lab.accuracy.rules import METHOD_RULES, RULES, default_budget
from mechlab.lab.design import Design
from mechlab.lab.fastest_rate import command_rate, fastest_rate
from mechlab.lab.methods import Problem, has_kinks
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.singularity import may_pass_singular
from mechlab.mechanism.structure import structure

T = TypeVar("T")
ROUNDING = 100.0 * float(np.finfo(float).eps)
"""Least error of stepped states that is stated, relative to the size of the mechanism: poses are closed to some tens of roundings."""


def solve_to(
    design: Design, scene: Scene | str | None, max_error: float, outputs: int = 100, sparse: bool = True,
    budget: float | None = None, record: Callable[[Scene, Settings], Recording] | None = None,
) -> Solution:  # fmt: skip
    """The scene of a design at `outputs` + 1 even times with an error of at most `max_error` [m or rad].

    sparse: steps may be longer than the distance of the outputs, where the motion is smooth. budget: most counted work [s];
    default: `default_budget`. record: makes a Recording of a scene, where states alone do not make one: then the runs of an engine are made
    by it, and the last two are kept.
    Raises MechlabError for an error that is not positive, NoSolution when no method gets to the end at all.
    """
    if not (math.isfinite(max_error) and max_error > 0.0):
        raise MechlabError(f"max_error: expected a number > 0, got {max_error!r}.")
    made = design
    if not isinstance(scene, Scene):
        made = design.for_scene(scene)
        scene = made.scene(scene)
    problem = Problem(made, scene, outputs)
    m = problem.mechanism
    tree = BatchTree(m) if all(j.nv == 1 for j in m.joints) else None
    measure = ErrorMeasure(problem, tree)
    work = default_budget(scene.duration) if budget is None else budget
    why = why_energy_is_not_enough(m, scene)
    if not m.is_closed and m.nv != 1:
        why = f"{m.nv} degrees of freedom"
    if not why and tree is not None:
        counter = CostCounter()
        try:
            solved = _solve_without_steps(problem, measure, max_error, tree, counter, work)
        except NoSolution as cause:
            why = str(cause)
        else:
            if solved.reached or solved.estimate < RULES.floor:
                return solved
            other = solve_by_refinement(
                problem, measure, max_error, 1, f"{solved.method} stays at {solved.estimate:.2g}", counter, work, sparse, record
            )  # fmt: skip
            best = other if other.reached or other.estimate < solved.estimate else solved
            return replace(best, cpu_s=other.cpu_s)
    freedoms = structure(m).freedoms if m.is_closed else m.nv
    if freedoms != 1:
        why = f"{freedoms} degrees of freedom"
    return solve_by_refinement(problem, measure, max_error, freedoms, why, CostCounter(), work, sparse, record)


def _solve_without_steps(
    problem: Problem, measure: ErrorMeasure, max_error: float, tree: BatchTree, counter: CostCounter, budget: float
) -> Solution:
    """One freedom under forces of position alone: in closed form, else by its energy. Raises NoSolution where neither applies."""
    with counter.building():
        q0, v0 = initial_state(problem.mechanism, problem.scene)
        rows = BatchRows(tree)
        joints = candidate_joints(problem.mechanism, q0, rows)  # first, since it refuses more than one freedom
        energies = energies_of(tree, problem.scene)
        t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
        checker = CheckRunner(problem, "one_freedom", 0.0, max_error < ROUNDING_COUNTS)
        asked = SolveTask(problem, measure, max_error, t, q0, v0, checker, counter, budget)
    if isinstance(energies, OneJointEnergies) and not rows.count:
        try:
            return solve_as_pendulum(asked, energies)
        except NoSolution:
            pass  # other forces, or a motion without a period
    return solve_by_energy(asked, tree, rows, energies, joints)


def solve_by_refinement(
    problem: Problem, measure: ErrorMeasure, max_error: float, freedoms: int, why: str, counter: CostCounter,
    budget: float, sparse: bool = False, record: Callable[[Scene, Settings], Recording] | None = None,
) -> Solution:  # fmt: skip
    """The scene by the cheapest method that meets the error. why: the reason, in words, that the energy quadrature does not apply.

    Raises NoSolution where no method gets to the end of the scene, MechlabError where no engine is installed that could.
    """
    t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
    fastest = fastest_rate(problem.mechanism, problem.scene)
    longest = _longest_step(problem) if sparse else 1
    once = None if record is None else partial(record, problem.scene)
    candidates = [RefinedMethod(rule, problem, measure, fastest, max_error, longest=longest, record=once) for rule in METHOD_RULES]
    with counter.building():
        candidates = [x for x in candidates if _usable(x, freedoms)]
    if not candidates:
        raise MechlabError(f"{problem.design.name}: no engine is installed that can control the error of this scene.")
    winner: RefinedMethod | None = None
    while winner is None:
        left = budget - counter.work
        affordable = [one for one in candidates if one.next_cost <= left]
        if not affordable:
            break
        x = min(affordable, key=lambda one: one.cost_given(candidates))
        _counting_runs_only(counter, x, partial(x.refine, left))
        if RULES.safety * x.estimate <= max_error and RULES.safety * (x.estimate + x.fill()) <= max_error:
            winner = x
    rounding = 0.0
    # a tolerance needs no such run: its error per step grows as rounding does, is 100 times as large, and is estimated
    if winner is not None and winner.rule.control == "step" and max_error < 1e-6 and len(winner.traces) > 1:
        rounding = _counting_runs_only(counter, winner, winner.rounding_error)
    ran = [x for x in candidates if x.traces]
    if not ran:
        raise NoSolution(f"{problem.design.name}: no method gets to the end of the scene ({_why_ended(candidates)}).")
    best = winner or min(ran, key=lambda x: x.estimate)
    capture = _counting_runs_only(counter, best, best.capture_error)
    filled = best.fill() if best is not winner or best.dense is not None else 0.0
    q, v = best.states
    tracked = measure(t, q, v)
    others = [x for x in ran if x is not best]
    checked = _check_by_other(best, others, t, problem)
    far = max(max_error, APART * largest(tracked - tracked[0]))
    passes = checked is not None and may_pass_singular(problem.mechanism, q)
    branches = passes and checked is not None and not checked.confirms(max_error)
    for _ in range((CONFIRMATIONS_OF_WAY if branches else CONFIRMATIONS) if winner is not None else 0):
        left = budget - counter.work
        again = [x for x in others if checked is not None and x.rule.name == checked.method and x.next_cost <= left]
        if checked is None or (checked.confirms(max_error) if branches else checked.difference <= far) or not again:
            break
        _counting_runs_only(counter, again[0], partial(again[0].refine, left))
        checked = _check_by_other(best, others, t, problem) or checked
    apart = winner is not None and checked is not None and checked.difference > far and not _explained(checked, problem.mechanism)
    another_way = apart or (branches and winner is not None and checked is not None and not checked.confirms(max_error))
    if checked is None:
        with counter.building():
            checker = CheckRunner(problem, best.rule.engine, fastest, max_error < ROUNDING_COUNTS)
        checked = checker.check(measure, tracked, counter)
    sharp = f"{'step' if best.rule.control == 'step' else 'tolerance'} {best.values[-1]:.3g}"
    stiff = f", whose fastest rate is {fastest:.3g} 1/s" if fastest * t[1] > 1.0 else ""
    chosen = (
        f"{best.rule.name}, {sharp}{' s' if best.rule.control == 'step' else ''}, the cheapest of {len(candidates)} methods to get "
        f"there ({why}{stiff})"
    )
    size = float(np.max(np.abs(tracked), initial=1.0))
    rounding = max(rounding, ROUNDING * min(1.0, problem.mechanism.length_scale))
    total = RULES.safety * (best.estimate + filled) + rounding + capture
    if passes and checked is not None:
        total = max(total, checked.difference)  # past such a place errors fall by chance, and two runs of one method may agree
    part = cause = ""
    if capture > max(best.estimate, rounding) and not another_way:
        part, cause = f"the capture of held rates {capture:.1g}", LIMITED_BY_CAPTURE
    elif another_way and checked is not None:
        total = math.inf  # what one of them says of itself is no bound
        cause = ANOTHER_WAY if apart else UNCONFIRMED_WAY
    elif rounding > best.estimate and max_error < ROUNDING_COUNTS:
        part, cause = f"rounding {rounding:.1g}", LIMITED_BY_ROUNDING
    ok, sentence = conclusion(total, max_error, measure, chosen, checked, size, part, cause)
    if winner is None:
        ok = False
        sentence += f"; the budget of {budget:.3g} s or the sharpest settings were used up: {_why_ended(candidates)}"
    return Solution(
        t, q, v, total, max_error, measure.unit, best.rule.name, best.values[-1], best.rule.control, counter.cpu_s,
        best.traces[-1].steps, ok, sentence, replace(best.settings, preset="max_error"), checked,
        extrapolated=best.rule.extrapolated, neighbours=() if another_way else tuple(best.neighbours(rounding)), run_s=best.run_s,
        capture=capture, recorded=best.recorded, between=None if best.dense is None else (best.dense.a, best.dense.forces),
    )  # fmt: skip


APART, CONFIRMATIONS, CONFIRMATIONS_OF_WAY = 0.01, 3, 8
"""Share of the motion by which another method may differ at last, and how often it is made sharper to see whether it comes nearer. Past
places where assembly modes meet, each method may go on, and settle, another way: there it is made sharper more often, until it differs by
no more than what is asked for."""
EXPLAINED = 1e-6
"""Of a motion that is nearly rest, another method may not show even the APART share: a difference that is less than its own last
change, and that change less than this share of the size of the mechanism, is its error and no other way."""
ANOTHER_WAY = "two methods whose runs both get to the end are far apart there, as past a place where assembly modes meet"
UNCONFIRMED_WAY = (
    "the run passes, or nearly, a place where assembly modes meet, and another method does not confirm the way: it differs, or still "
    "changes, by more than what is asked for"
)
LONGEST, FEWEST_STEPS = 16, 25
"""The longest first step, in distances of the outputs, and the fewest first steps."""
RESOLVED_COMMAND = 0.5
"""Largest step times the rate of what laws command [rad]: longer steps might see the same phase again and again."""


def _longest_step(problem: Problem) -> int:
    """The longest first step in distances of the outputs, a power of 2; 1 where the motion may have kinks or laws change at a rate
    that is not known."""
    m, scene = problem.mechanism, problem.scene
    rate = command_rate(scene)
    rough = is_rough(m) or any(x.range is not None for x in m.springs)
    if math.isinf(rate) or rough:
        return 1
    longest = 1
    while longest < LONGEST:
        fewer = problem.outputs // (2 * longest)
        if problem.outputs % (2 * longest) or fewer < FEWEST_STEPS or scene.duration / fewer * rate > RESOLVED_COMMAND:
            break
        longest *= 2
    return longest


def _counting_runs_only(counter: CostCounter, one: RefinedMethod, work: Callable[[], T]) -> T:
    """The result of `work`; only the runs of the method count as cost."""
    with counter.stepping() as cost:
        cpu_s, done = one.cpu_s, one.done
        found = work()
        cost.cpu_s, cost.work = one.cpu_s - cpu_s, one.done - done
    return found


def _explained(checked: MethodCheck, mechanism: Mechanism) -> bool:
    """Whether the other method's own error explains that it differs: see EXPLAINED."""
    return checked.difference <= checked.own <= EXPLAINED * min(1.0, mechanism.length_scale)


def _why_ended(candidates: list[RefinedMethod]) -> str:
    return "; ".join(f"{x.rule.name}: {x.ended or f'would need {x.next_cost:.2g} s more'}" for x in candidates)


def _usable(one: RefinedMethod, freedoms: int) -> bool:
    """Whether this method may run this problem; dry friction only with a method that locates its events, which may hold rates too."""
    m = one.problem.mechanism
    if is_rough(m) and one.rule.engine != "hybrid":
        return False
    if one.rule.engine == "one_freedom" and freedoms != 1:
        return False
    kinks = has_kinks(one.problem.scene)
    if one.rule.extrapolated and (kinks or m.is_closed or not why_no_smooth_tree(m, one.problem.scene.laws)):
        return False
    between = one.problem.scene.duration / one.problem.outputs
    if one.rule.least and (one.target < one.rule.least or not (kinks or one.fastest * between > 1.0)):
        return False
    method = one.rule.method(one.problem)
    return method is not None and not method.available(one.problem)


def _check_by_other(best: RefinedMethod, others: list[RefinedMethod], t: Array, problem: Problem) -> MethodCheck | None:
    """The check by a method of another engine with at least two runs: that of the smallest last change; None without one. One that
    captures held rates is none for another that holds them exactly."""
    others_run = [x for x in others if x.changes and x.rule.engine != best.rule.engine and x.captures == best.captures]
    if not others_run:
        return None
    other = min(others_run, key=lambda x: x.changes[-1])
    own, difference = other.changes[-1], other.runs[-1].apart(best.runs[-1], best.measure)
    unit = best.measure.unit
    sentence = (
        f"check by {other.rule.name} up to t = {t[-1]:.4g} s: it differs by {difference:.2g} {unit}, and changes by {own:.2g} {unit} "
        "in its last refinement"
    )
    return MethodCheck(other.rule.name, difference, own, float(t[-1]), sentence)
