"""Runs a plan: a reference for each row, every method at every timestep, and the outcome of each run."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.energy import energy, kinetic_energy, potential_energy
from mechlab.experiment.prices import OBSERVED_POSE
from mechlab.experiment.recording import Trace
from mechlab.integrate import OutOfWork, count_work, work_done, work_limit
from mechlab.lab.methods import METHODS, Method, Problem, method
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.studies.stability.data import MethodPanel, RunOutcome, StabilityCell
from mechlab.studies.stability.plan import StabilityPlan
from mechlab.studies.stability.vary import rough_parts

REFERENCE_TOLERANCE = 1e-9
REFERENCE_SHARE = 0.6
"""Share of the work of a map for all its reference runs."""
RUNAWAY = 1e2
"""A run has blown up when its error exceeds the extent of the motion, or its energy error the turnover, by this
factor."""
TRUSTED = 1e-4
"""Largest energy error of a conservative reference run, relative to its turnover."""
EVERY = 2
SMALLEST_SPAN = 1e-3
"""Lower bound of the extent of a motion [rad or m] that errors are divided by."""


@dataclass(frozen=True)
class ReferenceRun:
    """A reference run: coordinates q (n, nq); energies [J] at every second output; spans (nq,): largest extent of
    motion among joints of the same kind [rad or m]; turnover: largest kinetic energy or span of the potential energy
    [J]."""

    q: Array
    energies: Array
    spans: Array
    turnover: float
    method: str


def sharp_method(problem: Problem) -> Method:
    """The reference method of a row: located friction events where there are any, else rigid dynamics at a sharp
    tolerance. Raises MechlabError when Pinocchio is missing."""
    named = {m.name: m for m in METHODS}
    hybrid, rigid = named["hybrid DOP853"], named["Pinocchio DOP853"]
    if not hybrid.available(problem):
        return hybrid
    why = rigid.available(problem)
    if why:
        raise MechlabError(f"{problem.design.name}: a stability map needs Pinocchio as reference: {why}")
    return rigid


def reference_run(problem: Problem, reference: str = "") -> ReferenceRun:
    """The reference run of a row: the first method that reaches the end and, in a conservative scene, keeps its energy.

    A method can lose energy where the motion passes a singular position. Raises MechlabError when no method qualifies.
    """
    reasons = []
    named = {m.name: m for m in METHODS}
    first = method(reference) if reference else sharp_method(problem)
    steps = [
        (named["Pinocchio RK4, stiff stabilisation"], problem.scene.duration / problem.outputs / k) for k in (40, 100)
    ]
    for way, value in [(first, REFERENCE_TOLERANCE), *steps]:
        why = way.available(problem)
        if why:
            continue
        found = way.run(problem, value)
        if not found.complete or not np.all(np.isfinite(found.q)):
            reasons.append(f"{way.name} does not reach the end: {found.reason or 'not finite'}")
            continue
        truth, drift = _truth(problem, found, way)
        if drift <= TRUSTED:
            return truth
        reasons.append(f"{way.name} loses {drift:.1e} of its energy")
    raise MechlabError(f"no reference run can be trusted: {'; '.join(reasons)}")


def conservative(problem: Problem) -> bool:
    """True when the scene has no laws, no damping and no dry friction."""
    m = problem.mechanism
    damped = [x.damping for x in m.joints] + [x.damping for x in m.shafts] + [x.damping for x in m.springs]
    return not problem.scene.laws and not any(damped) and not rough_parts(m)


def _truth(problem: Problem, run: Trace, way: Method) -> tuple[ReferenceRun, float]:
    """The run as a reference, and its energy error relative to the turnover (0 unless the scene is conservative)."""
    m = problem.mechanism
    kinetic, potential = kinetic_energy(m, run.q, run.v), potential_energy(m, run.q)
    turnover = max(float(np.max(kinetic)), float(np.ptp(potential)), 1e-12)
    total, drift = kinetic + potential, 0.0
    if conservative(problem):
        drift = float(np.max(np.abs(total - total[0]))) / turnover
        total = np.full_like(total, total[0])
    return ReferenceRun(run.q, total[::EVERY], _spans(m, run.q), turnover, way.name), drift


def _spans(m: Mechanism, q: Array) -> Array:
    """(nq,) for each coordinate, the largest extent of motion among joints of the same kind [rad or m]."""
    reach = np.ptp(q, axis=0)
    largest: dict[str, float] = {}
    for joint in m.joints:
        largest[joint.kind] = max(largest.get(joint.kind, SMALLEST_SPAN), float(np.max(reach[m.q_slice[joint.name]])))
    return np.array([largest[j.kind] for j in m.joints for _ in range(j.nq)])


def outcome_of(plan: StabilityPlan, problem: Problem, truth: ReferenceRun | None, run: Trace) -> StabilityCell:
    """The outcome of a run, by its error, energy error or gap against the limits of the plan."""
    count_work(OBSERVED_POSE.of(problem.mechanism) * len(run.q) / EVERY)
    if not run.complete or not np.all(np.isfinite(run.q)) or not np.all(np.isfinite(run.v)):
        return StabilityCell(RunOutcome.BLOWN_UP, math.nan, run.reason or "the state is not finite")
    if truth is None:
        value = _gap(problem.mechanism, run.q)
        gone = not math.isfinite(value)
    else:
        error = float(np.max(np.abs(run.q - truth.q) / truth.spans))
        with np.errstate(over="ignore", invalid="ignore"):
            now = energy(problem.mechanism, run.q[::EVERY], run.v[::EVERY])
            drift = float(np.max(np.abs(now - truth.energies))) / truth.turnover
        gone = not (error < RUNAWAY and drift < RUNAWAY)
        value = drift if plan.measure == "energy" else error
    if gone or not math.isfinite(value):
        return StabilityCell(RunOutcome.BLOWN_UP, value, "it ran away")
    if value <= plan.right:
        return StabilityCell(RunOutcome.RIGHT, value)
    return StabilityCell(RunOutcome.DRIFTING if value <= plan.wrong else RunOutcome.WRONG, value)


def _gap(m: Mechanism, q: Array) -> float:
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    return float(max(np.max(np.abs(constraints.residual(tree.set(x))), initial=0.0) for x in q))


@dataclass(frozen=True)
class ReadyRow:
    """A row of a plan with its problem and reference run, or the reason why it has none."""

    y: float
    problem: Problem | None
    truth: ReferenceRun | None
    reason: str = ""
    outcome: RunOutcome = RunOutcome.REFUSED


def rows_of(plan: StabilityPlan, seconds: float) -> list[ReadyRow]:
    """The rows of a plan, each with its reference run; a row without one keeps the reason."""
    out = []
    began = work_done()
    for k, y in enumerate(plan.y.values):
        share = REFERENCE_SHARE * seconds - (work_done() - began)
        left = max(0.2, 3.0 * share / (len(plan.y.values) - k + 2))
        try:
            with work_limit(left):
                problem = plan.problem(y)
                out.append(ReadyRow(y, problem, reference_run(problem, plan.reference) if plan.compare else None))
        except OutOfWork:
            late = f"its reference run takes more than {left:.2g} s of work"
            out.append(ReadyRow(y, None, None, late, RunOutcome.NOT_RUN))
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError) as failed:
            out.append(ReadyRow(y, None, None, str(failed)))
    return out


def panels(
    plan: StabilityPlan, seconds: float, progress: Callable[[str], None]
) -> tuple[tuple[MethodPanel, ...], dict[str, str]]:
    """All methods of a plan over its grid, large timesteps first, within `seconds` of counted work; and method -> why
    missing."""
    began = work_done()
    rows = rows_of(plan, seconds)
    usable = next((r.problem for r in rows if r.problem is not None), None)
    skipped: dict[str, str] = {}
    able = []
    for m in plan.methods:
        why = m.available(usable) if usable is not None else ""
        if why:
            skipped[m.name] = why
        else:
            able.append(m)
    out = []
    for k, m in enumerate(able):
        progress(f"{plan.kind}: {m.name}")
        left = (seconds - (work_done() - began)) / (len(able) - k)
        out.append(_panel(plan, rows, m, max(0.3, left)))
    return tuple(out), skipped


def _panel(plan: StabilityPlan, rows: list[ReadyRow], way: Method, seconds: float) -> MethodPanel:
    end = work_done() + seconds
    cells: dict[tuple[int, int], StabilityCell] = {}
    for i in sorted(range(len(plan.steps)), key=lambda i: -plan.steps[i]):
        for k, row in enumerate(rows):
            cells[k, i] = _cell(plan, row, way, plan.steps[i], end - work_done())
    return MethodPanel(way.name, tuple(tuple(cells[k, i] for i in range(len(plan.steps))) for k in range(len(rows))))


def _cell(plan: StabilityPlan, row: ReadyRow, way: Method, step: float, left: float) -> StabilityCell:
    if row.problem is None:
        return StabilityCell(row.outcome, math.nan, row.reason)
    if left <= 0.0:
        return StabilityCell(RunOutcome.NOT_RUN, math.nan, "the work that this method may take was done")
    try:
        with work_limit(left):
            run = plan.tune(way, row.y).run(row.problem, step)
            return outcome_of(plan, row.problem, row.truth, run)
    except OutOfWork:
        return StabilityCell(RunOutcome.NOT_RUN, math.nan, f"stopped after {left:.3g} s of work")
    except MechlabError as refused:
        return StabilityCell(RunOutcome.REFUSED, math.nan, str(refused))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
        # a state that ran away: Python's floats raise where numpy's become infinite
        return StabilityCell(RunOutcome.BLOWN_UP, math.nan, str(problem))
