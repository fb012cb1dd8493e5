"""A scene solved to a stated error: the method and its sharpness are chosen, the error is estimated and checked."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.initial import initial_state
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import structure
from mechlab.study.design import Design
from mechlab.study.error_control.batch import BatchRows, BatchTree
from mechlab.study.error_control.check_method import Checked, check
from mechlab.study.error_control.conservative import scalars, why_not
from mechlab.study.error_control.energy_method import EnergyMotion
from mechlab.study.error_control.ladder import Ladder
from mechlab.study.error_control.measure import Measure
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.rates import fastest_rate
from mechlab.study.error_control.rules import LADDERS, RULES
from mechlab.study.methods import Problem

ENERGY = "energy quadrature"


@dataclass(frozen=True)
class Result:
    """A motion with its error.

    t (n,); q (n, nq), v (n, nv): at the output times. estimate [unit]: of the largest error of the tracked quantities;
    method, step (a step [s], a tolerance, or the nodes of a cell; see `control`); cpu_s: all CPU spent, probing and check
    included, imports and building of models excluded; reached: whether the estimate meets `max_error`; sentence: what was
    chosen and why, or why it cannot be reached; accelerations (n, nv) where the method knows them.
    """

    t: Array
    q: Array
    v: Array
    estimate: float
    max_error: float
    unit: str
    method: str
    step: float
    control: str
    cpu_s: float
    evaluations: int
    reached: bool
    sentence: str
    settings: Settings
    checked: Checked | None
    accelerations: Array | None = None
    motion: EnergyMotion | None = None
    extrapolated: bool = False


def solve_to(design: Design, scene: Scene | str | None, max_error: float, outputs: int = 100) -> Result:
    """The scene of a design at `outputs` + 1 even times with an error of at most `max_error` [m or rad].

    Raises MechlabError for an error that is not positive, NoSolution when no method gets to the end at all.
    """
    if not (math.isfinite(max_error) and max_error > 0.0):
        raise MechlabError(f"max_error: expected a number > 0, got {max_error!r}.")
    lived = design
    if not isinstance(scene, Scene):
        lived = design.for_scene(scene)
        scene = lived.scene(scene)
    problem = Problem(lived, scene, outputs)
    m = problem.mechanism
    tree = BatchTree(m) if all(j.nv == 1 for j in m.joints) else None
    measure = Measure(problem, tree)
    why = why_not(m, scene)
    freedoms = structure(m).freedoms if m.loops or m.relations else m.nv
    if freedoms != 1:
        why = f"{freedoms} degrees of freedom"
    if not why and tree is not None:
        q0, v0 = initial_state(m, scene)
        rows = BatchRows(tree)
        meter = Meter()
        try:
            found = _by_energy(problem, measure, max_error, tree, rows, q0, v0, meter)
        except NoSolution as cause:
            why = str(cause)
        else:
            if found.reached or found.estimate < RULES.floor:
                return found
            other = _by_ladders(problem, measure, max_error, freedoms, f"{ENERGY} stays at {found.estimate:.2g}", meter)
            best = other if other.reached or other.estimate < found.estimate else found
            return replace(best, cpu_s=other.cpu_s)
    return _by_ladders(problem, measure, max_error, freedoms, why, Meter())


# -- one freedom, by its energy --------------------------------------------------------------------------------------------


def _by_energy(
    problem: Problem,
    measure: Measure,
    max_error: float,
    tree: BatchTree,
    rows: BatchRows,
    q0: Array,
    v0: Array,
    meter: Meter,
) -> Result:
    t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
    motion = EnergyMotion(problem.mechanism, problem.scene, q0, v0, tree, rows)
    n, last = RULES.nodes
    motion.refine(n)
    coarse = measure_or_none(lambda: motion.states(t), measure, t)
    estimate, states, tracked = math.inf, None, coarse
    while n < last and meter.spent < RULES.cpu_limit:
        n *= 2
        motion.refine(n)
        try:
            states = motion.states(t)
        except NoSolution:
            continue
        tracked = measure(t, states.q, states.v)
        before, estimate = estimate, math.inf if coarse is None else _most(tracked - coarse)
        coarse = tracked
        if RULES.safety * estimate <= max_error or (estimate <= 1e-9 and estimate > 0.3 * before):
            break
    if states is None or tracked is None:
        raise NoSolution("the speed is not resolved: the motion all but stands still on its way")
    rounding = _rounding(motion, measure, t, tracked) if max_error < 1e-7 else 0.0
    total = estimate + rounding
    size = float(np.max(np.abs(tracked), initial=1.0))
    checked = check(problem, measure, tracked, "one_freedom", 0.0, meter)
    orbit = {"swing": "swings between two turning points", "turn": "turns on and on", "run": "runs along"}[
        motion.orbit.kind
    ]
    chosen = (
        f"{ENERGY} along {motion.branch.name} with {n + 1} nodes in each of {motion.orbit.cells} cells, because the mechanism "
        f"has one freedom and its forces depend on the position alone, so that its energy gives the motion without steps; it {orbit}"
    )
    ok, sentence = _verdict(total, max_error, measure.unit, chosen, checked, size, f"of which rounding {rounding:.1g}")
    settings = Settings(
        engine="one_freedom", integrator="energy", timestep=problem.scene.duration / problem.outputs,
        tolerance=max(total, 1e-16), preset="max_error",
    )  # fmt: skip
    return Result(
        t, states.q, states.v, total, max_error, measure.unit, ENERGY, float(n), "nodes", meter.spent, motion.evaluations,
        ok, sentence, settings, checked, states.a, motion,
    )  # fmt: skip


def measure_or_none(states: Callable[[], object], measure: Measure, t: Array) -> Array | None:
    """The tracked quantities of states, or None where they cannot be had."""
    try:
        found = states()
    except NoSolution:
        return None
    return measure(t, found.q, found.v)  # type: ignore[attr-defined]


def _rounding(motion: EnergyMotion, measure: Measure, t: Array, tracked: Array) -> float:
    """What a change of the energy by a few units in the last place does to the motion."""
    assert motion.samples is not None
    scale = float(np.max(np.abs(motion.samples.height)))
    shift = RULES.rounding * 2.2e-16 * max(scale, abs(motion.energy))
    changes = []
    for s in (shift, -shift):
        try:
            moved = motion.states(t, shift=s)
        except NoSolution:
            continue
        changes.append(_most(measure(t, moved.q, moved.v) - tracked))
    return max(changes, default=math.inf)


def _most(difference: Array) -> float:
    return float(np.max(np.abs(difference), initial=0.0))


# -- everything else, by ladders -------------------------------------------------------------------------------------------


def _by_ladders(problem: Problem, measure: Measure, max_error: float, freedoms: int, why: str, meter: Meter) -> Result:
    t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
    fastest = fastest_rate(problem.mechanism, problem.scene)
    ladders = [Ladder(rule, problem, measure, fastest) for rule in LADDERS]
    with meter.building():
        ladders = [x for x in ladders if _usable(x, freedoms)]
    if not ladders:
        raise MechlabError(f"{problem.design.name}: no engine is installed that can control the error of this scene.")
    winner: Ladder | None = None
    while winner is None:
        x = min(ladders, key=lambda one: one.next_cost)
        left = RULES.cpu_limit - meter.spent
        if math.isinf(x.next_cost) or x.next_cost > left:
            break
        with meter.stepping() as told:
            before = x.spent
            x.climb(left)
            told.append(x.spent - before)
        if RULES.safety * x.estimate <= max_error:
            winner = x
    rounding = 0.0
    if winner is not None and max_error < 1e-6 and len(winner.traces) > 1:
        with meter.stepping() as told:
            before = winner.spent
            rounding = winner.rounding()
            told.append(winner.spent - before)
    ran = [x for x in ladders if x.traces]
    if not ran:
        ends = "; ".join(f"{x.rule.name}: {x.ended}" for x in ladders)
        raise NoSolution(f"{problem.design.name}: no method gets to the end of the scene ({ends}).")
    best = winner or min(ran, key=lambda x: x.estimate)
    q, v = best.best
    tracked = measure(t, q, v)
    checked = _against(best, [x for x in ran if x is not best], t, problem)
    if checked is None:
        checked = check(problem, measure, tracked, best.rule.engine, fastest, meter)
    sharp = f"{'step' if best.rule.control == 'step' else 'tolerance'} {best.values[-1]:.3g}"
    stiff = f", whose fastest rate is {fastest:.3g} 1/s" if fastest * t[1] > 1.0 else ""
    chosen = (
        f"{best.rule.name}, {sharp}{' s' if best.rule.control == 'step' else ''}, the cheapest of {len(ladders)} methods to get "
        f"there ({why}{stiff})"
    )
    size = float(np.max(np.abs(tracked), initial=1.0))
    total = best.estimate + rounding
    of = f"of which rounding {rounding:.1g}" if rounding > best.estimate else ""
    ok, sentence = _verdict(total, max_error, measure.unit, chosen, checked, size, of)
    if winner is None:
        ok = False
        sentence += f"; {RULES.cpu_limit:g} s of CPU or the sharpest settings were used up: {_ends(ladders)}"
    return Result(
        t, q, v, total, max_error, measure.unit, best.rule.name, best.values[-1], best.rule.control, meter.spent,
        best.traces[-1].steps, ok, sentence, replace(best.settings, preset="max_error"), checked,
        extrapolated=best.rule.extrapolated,
    )  # fmt: skip


def _ends(ladders: list[Ladder]) -> str:
    return "; ".join(f"{x.rule.name} {x.ended or f'would need {x.next_cost:.2g} s more'}" for x in ladders)


def _usable(ladder: Ladder, freedoms: int) -> bool:
    """Whether the rules let this method run this problem: dry friction is for located events alone."""
    m = ladder.problem.mechanism
    rough = _rough(m)
    if rough != (ladder.rule.engine == "hybrid"):
        return False
    if ladder.rule.engine == "one_freedom" and freedoms != 1:
        return False
    if ladder.rule.extrapolated and (m.loops or m.relations):
        return False
    try:
        return not ladder.method.available(ladder.problem)
    except StopIteration:
        return False


def _rough(mechanism: Mechanism) -> bool:
    return any(x.friction for x in scalars(mechanism))


def _against(best: Ladder, others: list[Ladder], t: Array, problem: Problem) -> Checked | None:
    """The check by the ladder of another method that was climbed beside: the sharpest of its runs."""
    told = [x for x in others if len(x.tracked) >= 2]
    if not told:
        return None
    other = min(told, key=lambda x: _most(x.tracked[-1] - x.tracked[-2]))
    own = _most(other.tracked[-1] - other.tracked[-2])
    away = _most(other.tracked[-1] - best.tracked[-1])
    unit = best.measure.unit
    sentence = (
        f"check by {other.rule.name} up to t = {t[-1]:.4g} s: it differs by {away:.2g} {unit}, and changes by {own:.2g} {unit} "
        "in its last refinement"
    )
    return Checked(other.rule.name, away, own, float(t[-1]), sentence)


# -- verdict ---------------------------------------------------------------------------------------------------------------


def _verdict(
    estimate: float, max_error: float, unit: str, chosen: str, checked: Checked | None, size: float, of: str
) -> tuple[bool, str]:
    """Whether the error is met and believed, and the sentence that says so."""
    told = f"error estimated at {estimate:.2g} {unit} ({max_error:g} {unit} asked for{', ' + of if of and max_error < 1e-7 else ''})"
    says = checked.sentence if checked is not None else "no other method could check it"
    against = checked is not None and checked.contradicts(estimate, size)
    ok = estimate <= max_error and not against
    text = f"{told}; {chosen}; {says}"
    if against:
        text += "; the two contradict each other: do not trust this run"
    elif not ok:
        text += "; the error asked for cannot be reached: " + (
            "double precision does not allow it" if of and max_error < 1e-7 else "this is the best that was found"
        )
    return ok, text
