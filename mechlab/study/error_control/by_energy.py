"""One freedom, by its energy: the nodes are doubled until the motion no longer changes."""

from __future__ import annotations

import math

import numpy as np

from mechlab.errors import NoSolution
from mechlab.experiment.settings import Settings
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.error_control.branch import CLOSED, NEARLY
from mechlab.study.error_control.check_method import check
from mechlab.study.error_control.conservative import potential
from mechlab.study.error_control.energy_method import EnergyMotion, States
from mechlab.study.error_control.measure import Measure, most
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.rows import BatchRows
from mechlab.study.error_control.rules import RULES
from mechlab.study.error_control.verdict import LOW, verdict
from mechlab.study.methods import Problem

ENERGY = "energy quadrature"
CLOSING = 3e-4
"""Last correction of a pose, in errors asked for: tangents are off by so much, which the whole motion adds up."""


def by_energy(
    problem: Problem,
    measure: Measure,
    max_error: float,
    tree: BatchTree,
    rows: BatchRows,
    q0: Array,
    v0: Array,
    meter: Meter,
) -> Result:
    """The scene along the branch of poses through q0, v0. Raises NoSolution where the energy does not tell the motion."""
    with meter.building():
        t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
        energies = potential(tree, problem.scene)
    closed = min(max(CLOSING * max_error, CLOSED), NEARLY)
    motion = EnergyMotion(problem.mechanism, problem.scene, q0, v0, tree, rows, closed, energies)
    n, last = RULES.nodes
    n *= 1 if max_error > LOW else 2
    estimate, states, tracked = math.inf, None, None
    while n < last and meter.spent < RULES.cpu_limit:
        n *= 2
        motion.refine(n)
        try:
            states = motion.states(t)
            away = motion.moved(states, t, every=2)
        except NoSolution:
            tracked = None
            continue
        tracked, change = _compared(measure, t, states, away)
        before, estimate = estimate, change
        if RULES.safety * estimate <= max_error or (estimate <= 1e-9 and estimate > 0.3 * before):
            break
    if states is None or tracked is None:
        raise NoSolution("the speed is not resolved: the motion all but stands still on its way")
    # a motion that starts all but at rest on a top is told by the last digits of its energy, whatever was asked for
    told = max_error < LOW or motion.orbit.kind == "run"
    rounding = _rounding(motion, measure, t, states) if told else 0.0
    total = estimate + rounding
    size = float(np.abs(tracked).max(initial=1.0))
    checked = check(problem, measure, tracked, "one_freedom", 0.0, meter, max_error < LOW)
    orbit = {"swing": "swings between two turning points", "turn": "turns on and on", "run": "runs along"}[
        motion.orbit.kind
    ]
    chosen = (
        f"{ENERGY} along {motion.branch.name} with {motion.resolution}, because the mechanism "
        f"has one freedom and its forces depend on the position alone, so that its energy gives the motion without steps; it {orbit}"
    )
    ok, sentence = verdict(total, max_error, measure.unit, chosen, checked, size, f"of which rounding {rounding:.1g}")
    settings = Settings(
        engine="one_freedom", integrator="energy", timestep=problem.scene.duration / problem.outputs,
        tolerance=max(total, 1e-16), preset="max_error",
    )  # fmt: skip
    return Result(
        t, states.q, states.v, total, max_error, measure.unit, ENERGY, float(n), "nodes", meter.spent, motion.evaluations,
        ok, sentence, settings, checked, motion,
    )  # fmt: skip


def _compared(measure: Measure, t: Array, states: States, *away: Array) -> tuple[Array, float]:
    """The tracked quantities of states, and their largest change when the poses move by `away`."""
    count = len(t)
    q = np.concatenate([states.q, *(states.q + x for x in away)])
    every = measure(np.concatenate([t] * (1 + len(away))), q, np.concatenate([states.v] * (1 + len(away))))
    tracked = every[:count]
    return tracked, max(most(every[k * count : (k + 1) * count] - tracked) for k in range(1, 1 + len(away)))


def _rounding(motion: EnergyMotion, measure: Measure, t: Array, states: States) -> float:
    """What a change of the energy by a few units in the last place does to the motion."""
    assert motion.samples is not None
    scale = float(np.max(np.abs(motion.samples.height)))
    shift = RULES.rounding * 2.2e-16 * max(scale, abs(motion.energy))
    away = []
    for s in (shift, -shift):
        try:
            away.append(motion.moved(states, t, shift=s))
        except NoSolution:
            continue
    return _compared(measure, t, states, *away)[1] if away else math.inf
