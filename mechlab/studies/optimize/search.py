"""The search of an optimization, and the front of two goals; both with constraints.

Differential evolution over the whole box (Storn & Price 1997, constraints by the rules of Lampinen 2002), then COBYQA
from the best design (Ragonneau & Zhang 2023), which takes no derivatives and so allows goals with kinks
(a least angle, a reach). The front comes from epsilon-constraint searches, which also find its non-convex parts: the
second goal becomes a constraint that is tightened step by step, each search starting from the known designs (Haimes,
Lasdon & Wismer 1971).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution, minimize

from mechlab.mechanism.geometry import Array
from mechlab.studies.optimize.problem import MET, OptimisationGoal, OptimisationProblem, QuantityBound, TriedDesign

MEMBERS = 12
"""Members of the population for each variable; the population has at least 20."""


def fewest(variables: int) -> int:
    """Number of designs of the shortest global search: the first population and one generation."""
    return 2 * max(20, MEMBERS * variables)


POLISH = 60
"""The local search takes at most POLISH (n + 1) evaluations for n variables."""
ROUNDS, SETTLED = 5, 1e-7
"""Largest number of local searches, each from the best design so far; relative gain below which they end."""
RADIUS, FINEST = 0.02, 1e-11
"""First and last trust radius of the local search, relative to the ranges."""
FAR = 1e3
"""Constraint violation, relative to the bounds, that is assigned to a design which cannot exist."""


def search(
    problem: OptimisationProblem,
    goal: OptimisationGoal,
    constraints: Sequence[QuantityBound],
    evaluations: int,
    seed: int,
    starts: Sequence[TriedDesign] = (),
    polish: int | None = None,
) -> TriedDesign | None:
    """The best trial that meets the constraints, None where none was found.

    starts: known designs, part of the first population. polish: as POLISH. Every trial stays in `problem.trials`, and
    the best of all of them is returned.
    """
    evolve(problem, lambda t: -goal.sign * t.values[goal.quantity], constraints, evaluations, seed, starts)
    # no design meets the constraints yet: search for the one that violates them least
    if problem.best(goal, constraints) is None:
        evolve(problem, lambda t: -t.worst(constraints), (), evaluations, seed + 1, starts)
    found = problem.best(goal, constraints)
    evaluations_each = min(POLISH, max(8, evaluations // (2 * len(problem.variables) + 2)))
    for _ in range(ROUNDS if len(problem.variables) > 1 else 1):
        if found is None:
            return None
        before = found.values[goal.quantity]
        refine(problem, goal, constraints, found, polish or evaluations_each)
        found = problem.best(goal, constraints)
        if found is not None and abs(found.values[goal.quantity] - before) <= SETTLED * abs(before):
            break
    return found


def evolve(
    problem: OptimisationProblem,
    cost: Callable[[TriedDesign], float],
    constraints: Sequence[QuantityBound],
    evaluations: int,
    seed: int,
    starts: Sequence[TriedDesign] = (),
) -> None:
    """Minimize `cost` by differential evolution; the trials are kept in `problem.trials`."""
    low, high = problem.box
    size = max(20, MEMBERS * len(low))

    def held(x: Array) -> Array:
        t = problem.trial(x)
        if t.failure:
            return np.full(len(constraints) + 1, -FAR)
        return np.array([1.0, *(c.slack(t.values) for c in constraints)])

    def objective(x: Array) -> float:
        t = problem.trial(x)
        return np.inf if t.failure else cost(t)

    first = _population(problem, size, seed, starts)
    differential_evolution(
        objective, list(zip(low, high, strict=True)), init=first, maxiter=max(1, evaluations // size - 1), tol=1e-9, atol=0.0,
        rng=np.random.default_rng(seed), polish=False, integrality=[v.whole for v in problem.variables],
        constraints=NonlinearConstraint(held, 0.0, np.inf), mutation=(0.4, 0.9), recombination=0.8,
    )  # fmt: skip


def _population(problem: OptimisationProblem, size: int, seed: int, starts: Sequence[TriedDesign]) -> Array:
    """First population (size, n): a Latin hypercube in which the starts replace the last members."""
    from scipy.stats.qmc import LatinHypercube

    low, high = problem.box
    cube = LatinHypercube(len(low), rng=np.random.default_rng(seed)).random(size)
    out = low + cube * (high - low)
    for k, t in enumerate(starts[: size // 2]):
        out[-1 - k] = problem.inside(t.x)
    return np.asarray(out)


def refine(
    problem: OptimisationProblem,
    goal: OptimisationGoal,
    constraints: Sequence[QuantityBound],
    start: TriedDesign,
    evaluations: int,
) -> None:
    """Local search by COBYQA from a trial, with the ranges scaled to 0..1; whole variables stay fixed.

    The trials are kept in `problem.trials`.
    """
    low, high = problem.box
    free = np.array([not v.whole for v in problem.variables])
    if not free.any():
        return
    origin = np.array(start.x)
    size = abs(start.values[goal.quantity]) or 1.0

    def place(u: Array) -> Array:
        x = origin.copy()
        x[free] = low[free] + np.clip(u, 0.0, 1.0) * (high - low)[free]
        return x

    def objective(u: Array) -> float:
        t = problem.trial(place(u))
        return 10.0 if t.failure else -goal.sign * t.values[goal.quantity] / size

    def held(u: Array) -> Array:
        t = problem.trial(place(u))
        return np.full(len(constraints), -1.0) if t.failure else np.array([c.slack(t.values) for c in constraints])

    kept = [NonlinearConstraint(held, 0.1 * MET, np.inf)] if constraints else []
    begin = ((origin - low) / (high - low))[free]
    minimize(
        objective, begin, method="COBYQA", bounds=[(0.0, 1.0)] * int(free.sum()), constraints=kept,
        options={"maxfev": evaluations * (int(free.sum()) + 1), "initial_tr_radius": RADIUS, "final_tr_radius": FINEST},
    )  # fmt: skip


LEVELS = 12
CLOSE = 1e-3
"""Designs of a front that are closer in the second goal than this share of its range count as one."""
SHARE = 6
"""The search at one level takes 1 / SHARE of the evaluations of a whole search."""


def front(
    problem: OptimisationProblem,
    second: OptimisationGoal,
    constraints: Sequence[QuantityBound],
    evaluations: int,
    seed: int,
    levels: int = LEVELS,
) -> tuple[TriedDesign, ...]:
    """Non-dominated designs, the best of the first goal first; a single design where the goals do not conflict.

    Empty where no design meets the constraints.
    """
    goal = problem.goal
    bounded = problem.best(goal, problem.constraints)
    known = [bounded] if bounded is not None else []
    ends = [search(problem, g, constraints, evaluations // 2, seed + k, known) for k, g in enumerate((goal, second))]
    if ends[0] is None or ends[1] is None:
        return ()
    low, high = (t.values[second.quantity] for t in ends if t is not None)
    found = [t for t in (*ends, bounded) if t is not None]
    for k, level in enumerate(np.linspace(low, high, levels + 1)[1:-1]):
        kept = (*constraints, QuantityBound(second.quantity, second.sign, float(level)))
        near = problem.best(goal, kept)
        best = search(problem, goal, kept, evaluations // SHARE, seed + 2 + k, [near] if near else [])
        found += [best] if best is not None else []
    return apart(non_dominated(found, goal, second), second)


def apart(trials: Sequence[TriedDesign], second: OptimisationGoal) -> tuple[TriedDesign, ...]:
    """The designs without those closer than CLOSE to the one before in the second goal."""
    values = [t.values[second.quantity] for t in trials]
    room = CLOSE * abs(values[-1] - values[0]) if trials else 0.0
    out: list[TriedDesign] = []
    for t, value in zip(trials, values, strict=True):
        if not out or abs(value - out[-1].values[second.quantity]) > room:
            out.append(t)
    return tuple(out)


def non_dominated(
    trials: Sequence[TriedDesign], first: OptimisationGoal, second: OptimisationGoal
) -> tuple[TriedDesign, ...]:
    """The designs that no other design beats in both goals, the best of the first goal first."""
    order = sorted(
        trials, key=lambda t: (-first.sign * t.values[first.quantity], -second.sign * t.values[second.quantity])
    )
    out: list[TriedDesign] = []
    for t in order:
        if not out or second.sign * (t.values[second.quantity] - out[-1].values[second.quantity]) > 0.0:
            out.append(t)
    return tuple(out)
