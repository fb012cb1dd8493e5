"""One freedom, by its energy: the nodes are doubled until the motion no longer changes."""

from __future__ import annotations

import math

import numpy as np

from mechlab.errors import NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.error_control.branch import CLOSED, NEARLY
from mechlab.study.error_control.conservative import Potential
from mechlab.study.error_control.energy_method import EnergyMotion, Placed
from mechlab.study.error_control.judged import Asked, Found, judged
from mechlab.study.error_control.measure import Measure, compared
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.rows import BatchRows
from mechlab.study.error_control.rules import RULES
from mechlab.study.error_control.verdict import LOW

ENERGY = "energy quadrature"
CLOSING = 3e-4
"""Last correction of a pose, in errors asked for: tangents are off by so much, which the whole motion adds up."""


def by_energy(asked: Asked, tree: BatchTree, rows: BatchRows, energies: Potential) -> Result:
    """The scene along the branch of poses through its start; energies: as of `potential`. Raises NoSolution where the energy
    does not tell the motion."""
    problem, measure, max_error, t = asked.problem, asked.measure, asked.max_error, asked.t
    closed = min(max(CLOSING * max_error, CLOSED), NEARLY)
    motion = EnergyMotion(problem.mechanism, problem.scene, asked.q0, asked.v0, tree, rows, closed, energies)
    n, last = RULES.nodes
    n *= 1 if max_error > LOW else 2
    estimate, states, tracked = math.inf, None, None
    while n < last and asked.meter.work < RULES.work:
        n *= 2
        motion.refine(n)
        try:
            states = motion.states(t)
            away = motion.moved(states, t, every=2)
        except NoSolution:
            tracked = None
            continue
        tracked, change = compared(measure, t, states, away)
        before, estimate = estimate, change
        if RULES.safety * estimate <= max_error or (estimate <= 1e-9 and estimate > 0.3 * before):
            break
    if states is None or tracked is None:
        raise NoSolution("the speed is not resolved: the motion all but stands still on its way")
    # a motion that starts all but at rest on a top is told by the last digits of its energy, whatever was asked for
    told = max_error < LOW or motion.orbit.kind == "run"
    rounding = _rounding(motion, measure, t, states) if told else 0.0
    total = estimate + rounding
    share = total / estimate if estimate > 0.0 else 1.0
    orbit = {"swing": "swings between two turning points", "turn": "turns on and on", "run": "runs along"}[
        motion.orbit.kind
    ]
    chosen = (
        f"{ENERGY} along {motion.branch.name} with {motion.resolution}, because the mechanism "
        f"has one freedom and its forces depend on the position alone, so that its energy gives the motion without steps; it {orbit}"
    )
    found = Found(
        motion, states, tracked, total, rounding, chosen, ENERGY, float(n), "nodes", motion.evaluations, "energy", share
    )
    return judged(asked, found)


def _rounding(motion: EnergyMotion, measure: Measure, t: Array, states: Placed) -> float:
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
    return compared(measure, t, states, *away)[1] if away else math.inf
