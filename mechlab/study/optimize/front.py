"""The front of two goals: epsilon-constraint sweeps, which also find the parts of a front that bulge inwards.

Haimes, Lasdon & Wismer 1971: the second goal becomes a constraint that is tightened step by step, each step starting from the
designs that are known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.study.optimize.problem import Constraint, Goal, Problem, Trial
from mechlab.study.optimize.search import search

LEVELS = 12
CLOSE = 1e-3
"""Designs of a front that are nearer in the second goal, as a share of its range, are one."""
SHARE = 6
"""A level may take this part of the evaluations of a whole search."""


def front(
    problem: Problem,
    second: Goal,
    constraints: Sequence[Constraint],
    evaluations: int,
    seed: int,
    levels: int = LEVELS,
) -> tuple[Trial, ...]:
    """Non-dominated designs, the best of the first goal first; one alone where the goals do not conflict."""
    goal = problem.goal
    bounded = problem.best(goal, problem.constraints)
    known = [bounded] if bounded is not None else []
    ends = [search(problem, g, constraints, evaluations // 2, seed + k, known) for k, g in enumerate((goal, second))]
    if ends[0] is None or ends[1] is None:
        return ()
    low, high = (t.values[second.quantity] for t in ends if t is not None)
    found = [t for t in (*ends, bounded) if t is not None]
    for k, level in enumerate(np.linspace(low, high, levels + 1)[1:-1]):
        kept = (*constraints, Constraint(second.quantity, second.sign, float(level)))
        near = problem.best(goal, kept)
        best = search(problem, goal, kept, evaluations // SHARE, seed + 2 + k, [near] if near else [])
        found += [best] if best is not None else []
    return apart(non_dominated(found, goal, second), second)


def apart(trials: Sequence[Trial], second: Goal) -> tuple[Trial, ...]:
    """Without those that differ from the one before in the last digits alone."""
    values = [t.values[second.quantity] for t in trials]
    room = CLOSE * abs(values[-1] - values[0]) if trials else 0.0
    out: list[Trial] = []
    for t, value in zip(trials, values, strict=True):
        if not out or abs(value - out[-1].values[second.quantity]) > room:
            out.append(t)
    return tuple(out)


def non_dominated(trials: Sequence[Trial], first: Goal, second: Goal) -> tuple[Trial, ...]:
    """Those that no other one beats in both goals, the best of the first goal first."""
    order = sorted(
        trials, key=lambda t: (-first.sign * t.values[first.quantity], -second.sign * t.values[second.quantity])
    )
    out: list[Trial] = []
    for t in order:
        if not out or second.sign * (t.values[second.quantity] - out[-1].values[second.quantity]) > 0.0:
            out.append(t)
    return tuple(out)
