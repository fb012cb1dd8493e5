"""Solution without steps: a single hinge under its weight by elliptic functions, one freedom under forces of position by its energy."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.physical_pendulum import PhysicalPendulum
from mechlab.errors import NoSolution
from mechlab.experiment.scene import Settings
from mechlab.lab.accuracy.branch import CLOSED_TO, NEARLY_CLOSED
from mechlab.lab.accuracy.check import CheckRunner
from mechlab.lab.accuracy.energies import EnergyFunction, OneJointEnergies
from mechlab.lab.accuracy.energy_motion import EnergyMotion, PlacedStates
from mechlab.lab.accuracy.measure import (
    ContinuousMotion,
    CostCounter,
    ErrorMeasure,
    States,
    largest,
    tracked_and_change,
)
from mechlab.lab.accuracy.result import LIMITED_BY_ROUNDING, ROUNDING_COUNTS, NeighbourMotion, Solution, conclusion
from mechlab.lab.accuracy.rules import EPSILON, RULES
from mechlab.lab.methods import Problem
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class SolveTask:
    """A problem at the times t (n,) from q0 (nv,), v0 (nv,), to be solved to `max_error` of what `measure` tracks; the check, ready
    to run, the counter of its cost, and the budget [s] of that."""

    problem: Problem
    measure: ErrorMeasure
    max_error: float
    t: Array
    q0: Array
    v0: Array
    checker: CheckRunner
    counter: CostCounter
    budget: float


@dataclass(frozen=True)
class SolvedMotion:
    """A motion, its states at the output times and their tracked quantities.

    error: the whole estimate; rounding: the part of it that is rounding; chosen: the method and why it applies, in
    words; method, step, control, evaluations: as of `Solution`; integrator: as of `Settings`; share: error over the
    difference from `motion.cruder()`.
    """

    motion: ContinuousMotion
    states: States
    tracked: Array
    error: float
    rounding: float
    chosen: str
    method: str
    step: float
    control: str
    evaluations: int
    integrator: str
    share: float = 1.0


def with_check(asked: SolveTask, solved: SolvedMotion) -> Solution:
    """The solution: a motion, checked by an engine over as much of the scene as the work done so far allows."""
    a, x, unit = asked, solved, asked.measure.unit
    run_s = a.counter.cpu_s
    checked = a.checker.check(a.measure, x.tracked, a.counter)
    spent, size = a.counter.cpu_s, float(abs(x.tracked).max(initial=1.0))
    part, cause = (f"rounding {x.rounding:.1g}", LIMITED_BY_ROUNDING) if a.max_error < ROUNDING_COUNTS else ("", "")
    ok, sentence = conclusion(x.error, a.max_error, a.measure, x.chosen, checked, size, part, cause)
    settings = Settings(
        engine="one_freedom", integrator=x.integrator, timestep=a.problem.scene.duration / a.problem.outputs,
        tolerance=max(x.error, 1e-16), preset="max_error",
    )  # fmt: skip
    neighbour = NeighbourMotion(x.share, settings, x.states.q, x.states.v, x.motion.cruder())
    return Solution(
        a.t, x.states.q, x.states.v, x.error, a.max_error, unit, x.method, x.step, x.control, spent, x.evaluations,
        ok, sentence, settings, checked, x.motion, neighbours=(neighbour,), run_s=run_s,
    )  # fmt: skip


ELLIPTIC = "elliptic functions"


@dataclass(frozen=True)
class PendulumMotion:
    """The motion of one hinge under its weight: a physical pendulum about its lowest position, the coordinate `lowest` [rad]."""

    pendulum: PhysicalPendulum
    lowest: float

    @staticmethod
    def of(energies: OneJointEnergies, q0: float, v0: float) -> PendulumMotion:
        """V = c - A cos(q - lowest), w^2 = A / J. Raises NoSolution where other forces act or nothing pulls it down."""
        if not energies.turns or energies.load or energies.springs or len(energies.stiffness):
            raise NoSolution("not a hinge under a weight alone")
        pull = math.hypot(energies.by_sine, energies.by_rest)
        if not (pull > 0.0 and energies.inertia > 0.0):
            raise NoSolution("nothing turns the hinge")
        lowest = math.atan2(-energies.by_sine, energies.by_rest)
        return PendulumMotion(PhysicalPendulum(math.sqrt(pull / energies.inertia), q0 - lowest, v0), lowest)

    def states(self, t: Array, accelerations: bool = False) -> States:
        """q, v (P, 1) at times t (P,); a where it is asked for."""
        theta, rate = self.pendulum.motion(t)
        a = -(self.pendulum.frequency**2) * np.sin(theta) if accelerations else None
        return States((theta + self.lowest)[:, None], rate[:, None], None if a is None else a[:, None])

    def cruder(self) -> PendulumMotion:
        """The motion of a pendulum whose frequency and start differ by a few units in the last place."""
        p, more = self.pendulum, 1.0 + RULES.rounding * EPSILON
        return PendulumMotion(PhysicalPendulum(p.frequency * more, p.angle * more, p.rate * more), self.lowest)

    def rounding(self, t: Array, states: States) -> Array:
        """(P, 1) largest change [rad] of the poses by a few units in the last place of energy, frequency and time."""
        m, units = self.pendulum.modulus_squared, RULES.rounding * EPSILON
        later, other = self.pendulum.sensitivity()
        energy = units * max(m, math.sqrt(m))
        shifts = (units + later * energy) * np.abs(states.v) * t[:, None]
        return np.asarray(shifts + other * energy)


def solve_as_pendulum(asked: SolveTask, energies: OneJointEnergies) -> Solution:
    """The solution for one hinge under its weight alone. Raises NoSolution for anything else, and for a motion without a period."""
    motion = PendulumMotion.of(energies, float(asked.q0[0]), float(asked.v0[0]))
    states = motion.states(asked.t)
    tracked, rounding = tracked_and_change(asked.measure, asked.t, states, motion.rounding(asked.t, states))
    chosen = (
        f"{ELLIPTIC}, because the mechanism is one hinge under its weight alone, a physical pendulum; it "
        f"{'goes over' if motion.pendulum.goes_over else 'swings'}"
    )
    solved = SolvedMotion(
        motion, states, tracked, rounding, rounding, chosen, ELLIPTIC, 0.0, "closed form", len(asked.t), "elliptic"
    )
    return with_check(asked, solved)


ENERGY = "energy quadrature"
LOOSE = 1e-5
"""Errors [m or rad] that are asked for above this one are met with few nodes."""
NEGLIGIBLE = 1e-3
"""Share of the change by half the nodes that a change by rounding may be and not count."""
STILL, SLOW = 1e-10, 1e-6
"""Largest kinetic energy, as a share of the parts of the potential energy, of motions that the energy does not tell, and of those whose
rounding counts whatever error is asked for."""
CLOSING, BENT = 3e-4, 10.0
"""Last correction of a pose over the error asked for: the tangents are off by so much, times what they turn by with the pose, which adds up
along the motion. BENT is counted for it; Myard's linkage was seen to need 2.2, most need .1."""


def solve_by_energy(
    asked: SolveTask, tree: BatchTree, rows: BatchRows, energies: EnergyFunction, joints: list[int]
) -> Solution:  # fmt: skip
    """The solution along the branch of closed poses through the start, followed along one of `joints`: the nodes are doubled until the
    motion no longer changes. Raises NoSolution where the energy does not determine the motion."""
    problem, measure, max_error, t = asked.problem, asked.measure, asked.max_error, asked.t
    closed = min(max(CLOSING * max_error, CLOSED_TO), NEARLY_CLOSED)
    motion = EnergyMotion(problem.mechanism, problem.scene, asked.q0, asked.v0, tree, rows, closed, energies, joints)
    n, last = RULES.nodes
    n *= 1 if max_error > LOOSE else 2 if max_error > ROUNDING_COUNTS else 4
    estimate, states, tracked, far = math.inf, None, None, False
    while n < last and asked.counter.work < asked.budget:
        n *= 2
        motion.refine(n)
        if motion.lively < STILL:
            raise NoSolution("what moves it is rounding beside its potential energy")
        if far and 2 * n <= last and asked.counter.work < asked.budget:
            far = False
            continue
        try:
            states = motion.states(t)
            shifts = motion.moved(states, t, every=2)
        except NoSolution:
            tracked = None
            continue
        tracked, change = tracked_and_change(measure, t, states, shifts)
        before, estimate = estimate, change
        if RULES.safety * estimate <= max_error or (estimate <= 1e-9 and estimate > 0.3 * before):
            break
        # errors fall geometrically: with twice the nodes their share of the motion is squared. What cannot be enough is not measured
        size = largest(tracked - tracked[0])
        far = RULES.safety * min(estimate, size) ** 2 > max_error * size
    if states is None or tracked is None:
        raise NoSolution("the speed is not resolved: the motion all but stands still on its way")
    # a motion that starts nearly at rest on a maximum of V depends on the last digits of its energy, whatever error was asked for
    counts = max_error < ROUNDING_COUNTS or motion.orbit.kind == "run" or motion.lively < SLOW
    negligible = 0.0 if max_error < ROUNDING_COUNTS else NEGLIGIBLE * largest(shifts)
    rounding = _rounding(motion, measure, t, states, negligible) if counts else 0.0
    # the time on the way is off by at most the share by which tangents are
    speed = np.abs(np.diff(tracked, axis=0)).max(axis=1, initial=0.0) / np.diff(t)
    total = estimate + rounding + BENT * motion.corrected * largest(speed * t[1:])
    share = total / estimate if estimate > 0.0 else 1.0
    orbit = {"swing": "swings between two turning points", "turn": "turns on and on", "run": "runs along"}[
        motion.orbit.kind
    ]
    chosen = (
        f"{ENERGY} along {motion.branch.name} with {motion.resolution}, because the mechanism "
        f"has one freedom and its forces depend on the position alone, so that its energy gives the motion without steps; it {orbit}"
    )
    solved = SolvedMotion(
        motion, states, tracked, total, rounding, chosen, ENERGY, float(n), "nodes", motion.evaluations, "energy", share
    )
    return with_check(asked, solved)


def _rounding(motion: EnergyMotion, measure: ErrorMeasure, t: Array, states: PlacedStates, negligible: float) -> float:
    """Largest change of the tracked quantities when the energy changes by a few units in the last place; 0 where no coordinate changes
    by more than `negligible` [rad or m]."""
    assert motion.samples is not None
    scale = max(float(np.max(np.abs(motion.samples.height))), motion.size, abs(motion.energy))
    shift = RULES.rounding * EPSILON * scale
    shifts = []
    for s in (shift, -shift):
        try:
            shifts.append(motion.moved(states, t, shift=s))
        except NoSolution:
            continue
    if shifts and max(largest(x) for x in shifts) <= negligible:
        return 0.0
    return tracked_and_change(measure, t, states, *shifts)[1] if shifts else math.inf
